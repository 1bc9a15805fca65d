"""`livebode margins` and `livebode validate` on a run, and the margins beside the fits of a run."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from livebode.analysis import margins
from livebode.fitting import mean_response
from livebode.records import RunRecord
from livebode.records.summary_file import to_document
from livebode.simulation.two_mass_loop import RATE_HZ
from livebode_control.margins.loop_margins import margins_of_run
from tests.support.belt_loops import read
from tests.support.command import livebode
from tests.support.loop_runs import AXIS, LINES, record
from tools.loops import BELT, Case, parameters, values


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("loop")
    record(folder / "log.parquet", 1)
    record(folder / "fresh.parquet", 2)
    (folder / "axis.toml").write_text(AXIS.format(gain=0.2308, delay=0), encoding="utf-8")
    done = livebode("run", folder / "axis.toml", "--out", folder / "run")
    assert done.code == 0, done.err
    return folder / "run"


def test_margins_of_a_run_hold_the_true_ones(run: Path) -> None:
    done = livebode("margins", run, "--json")
    assert done.code == 0, done.err
    found, true = json.loads(done.out)["margins"], read(Case(BELT))
    for i, name in enumerate(true.names):
        one = found[name]
        assert abs(one["value"] - true.value[0, i]) < 2 * one["bound_95"] + 1e-9, name
        assert one["place"] == true.place[0, i] or abs(one["frequency_hz"] - 20) < 1, name
    assert (run / "margins.svg").stat().st_size > 3_000
    assert json.loads(done.out)["tuning"]["verdict"] == "none needed"


def test_a_loop_that_is_described_beside_the_run_is_judged_and_tuned(run: Path) -> None:
    """As if the same machine ran under a sharper controller: the description alone changes the loop."""
    sharp = run.parent / "sharp.toml"
    sharp.write_text(AXIS.format(gain=4 * 0.2308, delay=8), encoding="utf-8")
    done = livebode("margins", run, "--axis", sharp)
    assert done.code == 0, done.err
    assert "suggested: Ms is up to" in done.out
    assert "notch at 59" in done.out
    assert "at 4000 Hz:" in done.out
    assert "EXTRAPOLATED" in done.out
    assert "lines alone" in done.out
    assert livebode("margins", run, "--max-sensitivity", 1.0).code == 2


def test_a_run_with_a_delay_gets_margins_with_it_and_none_where_it_is_held_at_zero(run: Path) -> None:
    """u is logged two ticks before it acts; the loop described is four times sharper."""
    folder = run.parent / "late"
    folder.mkdir()
    record(folder / "log.parquet", 3, late=2)
    axis = AXIS.format(gain=4 * 0.2308, delay=0)
    for name, more in (("free", ""), ("held", "fixed = {delay = 0.0}\n")):
        (folder / f"{name}.toml").write_text(axis + more, encoding="utf-8")
        done = livebode("run", folder / f"{name}.toml", "--out", folder / name)
        assert done.code == 0, done.err
    free, held = (json.loads(livebode("margins", folder / name, "--json").out) for name in ("free", "held"))
    true = margins(replace(parameters(BELT[np.newaxis]), value=delayed(2)), Case(BELT, gain=4 * 0.2308).open, (20, 140))
    for i, name in enumerate(true.names):
        one = free["margins"][name]
        assert abs(one["value"] - true.value[0, i]) < 2 * one["bound_95"] + 1e-9, name
    assert held["status"] == "contradicted by the lines"
    assert held["margins"]["gain_margin"]["value"] is None
    assert held["tuning"]["verdict"] == "refused"
    assert "free a parameter" in held["message"]
    assert "no margins: the two-mass model contradicts the lines" in livebode("margins", folder / "held").out


def delayed(ticks: float) -> np.ndarray:
    at = values(BELT[np.newaxis])
    at[:, -1] = ticks / RATE_HZ
    return at


def test_the_run_itself_holds_its_margins(run: Path) -> None:
    summary = RunRecord.open(run).summary["loop"]
    assert summary["status"] == "ok"
    assert set(summary["margins"]) == set(read(Case(BELT)).names)
    table = pq.read_table(run / "parameters.parquet")
    columns = {name: np.array(table[name].to_pylist()) for name in ("model", "name", "value", "status", "sample")}
    phase = (columns["model"] == "margins") & (columns["name"] == "phase_margin")
    fitted = (columns["model"] == "two-mass") & (columns["name"] == "Keff")
    assert np.array_equal(columns["sample"][phase], columns["sample"][fitted])
    good = columns["status"][fitted] == "ok"
    assert good.sum() > 20
    assert set(columns["status"][phase][good]) <= {"interpolated", "extrapolated"}
    true = read(Case(BELT)).of("phase_margin")[0]
    assert abs(np.median(columns["value"][phase][good]) - true) < 2


def test_a_true_model_passes_on_fresh_data_and_a_wrong_one_does_not(run: Path) -> None:
    fresh = run.parent / "fresh.parquet"
    done = livebode("validate", run, "--on", fresh, "--samples", 3000, "--json")
    assert done.code == 0, done.err
    one = json.loads(done.out)["models"][0]
    assert one["verdict"] == "passes"
    assert one["samples"] == 3000
    assert {c["with"] for c in one["correlations"]} == {"u", "ŷ", "w"}
    assert (run / "validation.svg").stat().st_size > 3_000
    done = livebode("validate", run, "--on", fresh, "--model", "two-mass", "--model", "rigid")
    assert "two-mass passes" in done.out
    assert "rigid was not fitted" in done.out


def test_margins_leave_out_the_transient_that_the_run_names(run: Path, tmp_path: Path) -> None:
    left_out = shutil.copytree(run, tmp_path / "run") / "run.json"
    left_out.write_bytes(to_document(RunRecord.open(run).summary | {"left_out_samples": 5 * LINES.window}))
    found, every = margins_of_run(left_out.parent).report.responses, mean_response(RunRecord.open(run).responses())
    assert np.array_equal(found.value, mean_response(RunRecord.open(left_out.parent).steady_batches()).value)
    assert not np.any(found.value == every.value)


def test_impossible_options_of_margins_and_validate_are_refused_in_one_sentence(run: Path, tmp_path: Path) -> None:
    fresh = run.parent / "fresh.parquet"
    for arguments, sentence in (
        (("validate", run, "--on", fresh, "--samples", 10**7), "clean ones in a row"),
        (("validate", run, "--on", tmp_path / "none.parquet"), "none.parquet"),
        (("validate", tmp_path, "--on", fresh), "not the directory of a run"),
        (("validate", run, "--on", fresh, "--model", "nonsense"), "two-mass-gain, modal, rational"),
        (("margins", tmp_path), "not the directory of a run"),
        (("margins", run, "--model", "nonsense"), "no model 'nonsense'"),
    ):
        done = livebode(*arguments)
        assert done.code == 2, done
        assert sentence in done.err
