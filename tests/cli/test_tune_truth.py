"""`livebode tune` on a run of the simulated loop: table, picture, filters, refusals."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from livebode.configuration import Axis
from livebode.core import Lines
from livebode.excitation import multisine
from livebode.records import to_json
from livebode.simulation.two_mass_loop import RATE_HZ, TwoMassLoop
from tests.support.command import livebode, write_parquet
from tests.support.loop_runs import AXIS

FREQUENCIES = "4:100:2, 104:400:8"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("tune")
    w = 0.1 * multisine(Lines.parse(FREQUENCIES, RATE_HZ, 2000))
    u, y = TwoMassLoop().run(w, 10, sigma=0.02, seed=1)
    write_parquet(folder / "log.parquet", {"w": np.resize(w, u.size), "u": u[0], "y": y[0]})
    words = AXIS.format(gain=0.2308, delay=0).replace('"20:140:10"', f'"{FREQUENCIES}"')
    words = words.replace("window = 400", "window = 2000").replace("hop = 200", "hop = 2000")
    (folder / "axis.toml").write_text(words, encoding="utf-8")
    done = livebode("run", folder / "axis.toml", "--out", folder / "run")
    assert done.code == 0, done.err
    return folder / "run"


def test_a_run_is_tuned_and_nothing_is_proposed_for_an_unchecked_loop(run: Path) -> None:
    refused = livebode("tune", run)
    assert refused.code == 2
    assert "--loop-checked" in refused.err
    done = livebode("tune", run, "--loop-checked")
    assert done.code == 0, done.err
    assert "velocity.gain" in done.out
    assert "is promised" in done.out
    assert (run / "tune.png").stat().st_size > 20_000
    assert "LIVEBODE_FILTERS" in (run / "filters.h").read_text(encoding="utf-8")


def test_a_bandwidth_out_of_reach_ends_with_the_best_and_exit_code_two(run: Path) -> None:
    done = livebode("tune", run, "--loop-checked", "--bandwidth-hz", 300, "--json")
    assert done.code == 2
    found = json.loads(done.out.splitlines()[0])
    assert not found["met"]
    assert found["limited_by"]
    assert "the best promises" in done.out + done.err


def test_the_stored_check_of_the_loop_decides(run: Path) -> None:
    section = Axis.read(run.parent / "axis.toml").loop.model_dump(mode="json")
    stored = run / "loop-check.json"
    for verdict, code, words in (
        ("as described", 0, "is promised"),
        ("one change", 2, "the gain differs"),
        ("not checked", 2, "not checked"),
    ):
        stored.write_text(to_json({"verdict": verdict, "sentence": "the gain differs", "loop": section}))
        done = livebode("tune", run)
        assert done.code == code, verdict
        assert words in done.out + done.err
    stored.write_text("[]")
    assert livebode("tune", run).code == 2
    stored.unlink()
