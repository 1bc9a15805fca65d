"""The commands on matrix runs: entries are selected with --entry, and a missing one is answered by their names."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import pyuff
import scipy.io
import xarray as xr

from livebode.core import Block
from livebode.dashboard import Quantities
from livebode.dashboard.overlays import overlays_of
from livebode.dashboard.run_entry import entry
from livebode.records import RunRecord
from tests.support.command import livebode
from tests.support.gantry_runs import NAMES, RATE_HZ, gantry_block, gantry_log

SHARED = ["--lines", "10:60:5", "--window", "800", "--hop", "200"]
EVERY = "velocity1/u1, velocity1/u2, velocity2/u1, velocity2/u2"


LIMITS = """
[[report.limits]]
quantity = "|G|"
max = 40
band_hz = [10, 60]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of the gantry, and one of it with twice the second speed."""
    folder, block = tmp_path_factory.mktemp("gantry"), gantry_block()
    other = block.data.copy()
    other[5] *= 2
    for name, one in (("before", block), ("after", Block(other, NAMES, rate_hz=RATE_HZ))):
        gantry_log(folder / f"{name}.parquet", one)
        (folder / f"{name}.toml").write_text(
            f"""
            [source]
            log = "{name}.parquet"
            [signals]
            output = ["velocity1", "velocity2"]
            input = ["u1", "u2"]
            excitation = ["w1", "w2"]
            [lines]
            frequencies = "10:60:5"
            window = 800
            [tracking]
            average = true
            [experiments]
            dwell_periods = 6
            settle_periods = 4
            """
        )
        assert livebode("run", folder / f"{name}.toml", "--out", folder / name).code == 0
    return folder


def test_the_result_lists_the_entries_and_the_condition(folder: Path) -> None:
    found = livebode("run", folder / "before.toml", "--out", folder / "again", "--force")
    assert found.code == 0
    assert "velocity2/u1  valid at 11 of 11 lines, largest " in found.out
    assert "inputs: condition number at most " in found.out


def test_a_run_draws_its_pictures_and_is_replaced_with_them(folder: Path) -> None:
    again = ("run", folder / "before.toml", "--out", folder / "drawn", "--force")
    for _ in range(2):
        found = livebode(*again)
        assert (found.code, found.err) == (0, "")
    assert sorted(path.name for path in (folder / "drawn").iterdir()) == [
        "bode.svg", "covariance.parquet", "events.jsonl", "manifest.jsonl", "responses.parquet", "run-copy.json",
        "run.json", "singular-values.svg",
    ]  # fmt: skip


def test_repeated_options_make_a_matrix(folder: Path) -> None:
    roles = [("--output", "velocity1"), ("--output", "velocity2"), ("--input", "u1"), ("--input", "u2")]
    roles += [("--excitation", "w1"), ("--excitation", "w2")]
    options = [word for role in roles for word in role]
    found = livebode("run", folder / "before.parquet", *options, *SHARED, "--out", folder / "options")
    assert "compare [experiments]" in found.out + found.err  # by default each lasts two periods
    signals = json.loads((folder / "options" / "run.json").read_text())["configuration"]["signals"]
    assert signals["input"] == ["u1", "u2"]


def test_one_run_of_several_outputs(folder: Path) -> None:
    options = ["--output", "velocity1", "--output", "velocity2", "--input", "u1", "--estimator", "direct", "--matrix"]
    livebode("run", folder / "before.parquet", *options, *SHARED, "--out", folder / "outputs")
    assert json.loads((folder / "outputs" / "run.json").read_text())["found"]["outputs"] == ["velocity1", "velocity2"]


@pytest.mark.parametrize("command", [["margins"], ["tune"], ["report", "--check", "--template", "LIMITS"]])
def test_a_missing_entry_is_answered_by_the_names(folder: Path, command: list[str]) -> None:
    (folder / "limits.toml").write_text(LIMITS)
    found = livebode(*(folder / "limits.toml" if word == "LIMITS" else word for word in command), folder / "before")
    assert found.code == 2
    assert f"choose an entry: {EVERY}" in found.err
    assert len(found.err.strip().splitlines()) == 1


def test_entries_of_one_input_have_common_poles(folder: Path) -> None:
    entries = ["--entry", "velocity1/u1", "--entry", "velocity2/u1"]
    found = livebode("fit", folder / "before", *entries, "--model", "modal", "--order", 1, "--json")
    assert json.loads(found.out)["outputs"] == ["velocity1", "velocity2"]


def test_a_comparison_names_the_entries_that_differ(folder: Path) -> None:
    found = json.loads(livebode("compare", folder / "before", folder / "after", "--json").out)
    assert found["differing"] == ["velocity2/u1", "velocity2/u2"]
    assert found["entries"]["velocity1/u1"]["tested_together"] == 44
    one = json.loads(livebode("compare", folder / "before", folder / "after", "--entry", "velocity1/u2", "--json").out)
    assert one["tested_together"] == 11


def test_a_model_is_validated_at_the_lines_of_another_run(folder: Path) -> None:
    options = ["--entry", "velocity1/u1", "--model", "rational", "--json"]
    found = livebode("validate", folder / "before", "--on", folder / "again2", *options)
    assert found.code == 2
    found = livebode("validate", folder / "before", "--on", folder / "before", *options)
    assert "the other inputs of a matrix" in found.out


def test_a_query_sees_the_columns(folder: Path) -> None:
    sql = "SELECT output, input, count(*) FROM responses WHERE reason = '' GROUP BY ALL ORDER BY ALL"
    rows = json.loads(livebode("export", folder / "before", "--sql", sql, "--json").out)["rows"]
    assert [row[:2] for row in rows] == [
        ["velocity1", "u1"],
        ["velocity1", "u2"],
        ["velocity2", "u1"],
        ["velocity2", "u2"],
    ]
    factors = json.loads(
        livebode("export", folder / "before", "--sql", "SELECT DISTINCT factor FROM covariance", "--json").out
    )
    assert sorted(row[0] for row in factors["rows"]) == ["noise", "spread"]


def test_every_format_of_a_whole_matrix_run(folder: Path) -> None:
    matrix = RunRecord.open(folder / "before", matrix=True).matrix()
    for to, ending in {"csv": ".csv", "mat": ".mat", "netcdf": ".nc", "uff": ".uff"}.items():
        done = livebode("export", folder / "before", "--to", to, "--out", folder / f"whole{ending}")
        assert (done.code, done.err) == (0, "")
    table = pd.read_csv(folder / "whole.csv")
    assert len(table) == matrix.value.size
    last = table[(table.output == "velocity2") & (table.input == "u1") & (table["sample"] == matrix.sample[-1])]
    found = last.re.to_numpy() + 1j * last.im.to_numpy()
    assert np.allclose(found, matrix.value[-1, :, 1, 0], rtol=1e-14, atol=0)
    struct = scipy.io.loadmat(folder / "whole.mat")["livebode"][0, 0]
    assert struct["H"].shape == (2, 2, len(matrix.lines), len(matrix))
    with xr.open_dataset(folder / "whole.nc") as dataset:
        assert dataset.sizes["output"] == dataset.sizes["input"] == 2
    valid = int(np.count_nonzero(matrix.valid.sum(axis=1) >= 2)) * 2  # of each column two outputs
    assert pyuff.UFF(str(folder / "whole.uff")).get_n_sets() == valid


def test_the_newest_matrix_and_one_entry(folder: Path) -> None:
    matrix = RunRecord.open(folder / "before", matrix=True).matrix().newest()
    assert livebode("export", folder / "before", "--to", "mat", "--mean", "--out", folder / "mean.mat").code == 0
    found = scipy.io.loadmat(folder / "mean.mat")["livebode"][0, 0]["H"]
    assert np.array_equal(found[..., 0] if found.ndim == 4 else found, np.moveaxis(matrix.value[0], 0, -1))
    options = ["--to", "mat", "--mean", "--entry", "velocity2/u1", "--out", folder / "entry.mat"]
    assert livebode("export", folder / "before", *options).code == 0
    one = scipy.io.loadmat(folder / "entry.mat")["livebode"][0, 0]["H"]
    assert np.array_equal(one.ravel(), matrix.value[0, :, 1, 0])


@pytest.mark.parametrize(
    ("options", "remedy"),
    [
        (["--to", "xlsx"], "choose csv, mat, netcdf or uff"),
        (["--to", "csv", "--at", "1"], "use --mean for the newest matrix"),
        (["--to", "csv", "--entry", "velocity3/u1"], f"choose one of {EVERY}"),
    ],
)
def test_what_cannot_be_exported_is_refused_in_one_sentence(folder: Path, options: list[str], remedy: str) -> None:
    found = livebode("export", folder / "before", *options, "--out", folder / "refused")
    assert found.code == 2
    assert remedy in found.err
    assert len(found.err.strip().splitlines()) == 1
    assert not (folder / "refused").exists()


@pytest.mark.parametrize(
    ("refused", "says", "followed"),
    [
        (
            "export {0}/before --to csv --at 1 --out {0}/m.csv",
            "use --mean",
            "export {0}/before --to csv --mean --out {0}/m.csv",
        ),
        (
            "report {0}/before --on {0}/after.parquet --out {0}/r.html",
            "`livebode validate RUN --entry OUTPUT/INPUT --on RUN`",
            "validate {0}/before --entry velocity1/u1 --on {0}/after --model modal",
        ),
    ],
)
def test_the_command_that_a_remedy_for_a_matrix_run_names_works(
    folder: Path, refused: str, says: str, followed: str
) -> None:
    before = livebode(*refused.format(folder).split())
    assert (before.code, says in before.err) == (2, True), before
    after = livebode(*followed.format(folder).split())
    assert after.code == 0, after.err


def test_a_report_of_one_entry(folder: Path) -> None:
    options = ["--entry", "velocity2/u1", "--out", folder / "entry", "--json"]
    found = livebode("report", folder / "before", *options)
    assert found.code == 0, found.err
    page = (folder / "entry.html").read_text()
    assert "<h1>before.parquet · velocity2 ← u1</h1>" in page
    end_s = 4 * 2 * 6 * 800 / RATE_HZ  # of the recording: the average is from all of it
    assert f"the average up to {end_s:g} s" in page
    assert "velocity1" not in page
    refused = livebode("report", folder / "before", *options, "--force", "--on", folder / "after.parquet")
    assert refused.code == 2
    assert "livebode validate RUN --entry" in refused.err


def test_a_report_of_the_whole_matrix_has_every_entry_and_its_figures(folder: Path) -> None:
    done = livebode("report", folder / "before", "--out", folder / "whole-report", "--json")
    assert done.code == 0, done.err
    page = (folder / "whole-report.html").read_text()
    assert page.count("<figure>") == 2  # singular values, and one block of Bode plots
    newest = RunRecord.open(folder / "before", matrix=True).matrix().newest()
    for o, i in np.ndindex(2, 2):
        one = newest.entry(o, i)
        row = page[page.index(f"<td>{newest.outputs[o]} ← {newest.inputs[i]}</td>") :].split("</tr>")[0]
        assert "11 of 11" in row
        assert f">{one.magnitude_db[0].max():.2f}<" in row
    assert f">{newest.condition[0].max():.3g}<" in page
    assert "livebode report before --entry velocity2/u2" in page
    refused = livebode("report", folder / "before", "--on", folder / "after.parquet")
    assert refused.code == 2
    assert "has no --on" in refused.err


@pytest.mark.parametrize(("language", "word"), [("de", "Konditionszahl der Eingänge"), ("zh-CN", "输入的条件数")])
def test_the_report_of_the_matrix_speaks_the_language_of_its_reader(folder: Path, language: str, word: str) -> None:
    out = folder / f"whole-{language}"
    assert livebode("report", folder / "before", "--out", out, "--language", language).code == 0
    page = out.with_suffix(".html").read_text()
    assert word in page
    assert "singular values" not in page


def test_a_comparison_of_matrices_is_a_document_with_every_entry(folder: Path) -> None:
    done = livebode("compare", folder / "before", folder / "after", "--out", folder / "both")
    assert done.code == 0, done.err
    page = (folder / "both.html").read_text()
    assert [page.count(f"<h2>{o} ← {i}</h2>") for o in ("velocity1", "velocity2") for i in ("u1", "u2")] == [1] * 4
    assert page.count("<figure>") == 4
    entries = json.loads(livebode("compare", folder / "before", folder / "after", "--json").out)["entries"]
    order = ("velocity2/u1", "velocity2/u2", "velocity1/u1", "velocity1/u2")  # those that differ first
    seen = [[100 * line["detectable"] for line in entries[name]["lines"]] for name in order]
    rows = page.split("smallest detectable change of a line")[1:]
    assert len(rows) == 5  # of all entries, and of each
    for sizes, row in zip((np.concatenate(seen), *seen), rows):
        least, median, most = np.quantile(sizes, (0, 0.5, 1))
        known = most if most < 1.5 * least else median
        assert f"≥ {known:.2g} %" in row[:100]


CONTROLLERS = "".join(
    f"""
    [[loop.controllers]]
    output = "velocity{n}"
    input = "u{n}"
    velocity = {{ gain = GAIN, integral_time_s = 0.05, rate_hz = 4000 }}
    """
    for n in (1, 2)
)


def test_each_controller_of_a_matrix_is_checked_with_its_own_signals(folder: Path) -> None:
    words = (folder / "before.toml").read_text()
    for name, gain in (("right", "0.3"), ("wrong", "0.33")):
        (folder / f"{name}.toml").write_text(words + CONTROLLERS.replace("GAIN", gain))
    found = json.loads(livebode("validate", folder / "before", "--loop", "--axis", folder / "wrong.toml", "--json").out)
    for one in found["controllers"].values():
        assert one["verdict"] == "one change"
        assert abs(one["explanations"][0]["value"] - 0.3) < 1e-4
    tune = ("tune", folder / "before", "--axis", folder / "right.toml", "--entry")
    assert "livebode validate --loop" in livebode(*tune, "velocity1/u1").err  # another description was checked
    found = json.loads(livebode("validate", folder / "before", "--loop", "--axis", folder / "right.toml", "--json").out)
    assert [one["verdict"] for one in found["controllers"].values()] == ["as described"] * 2
    # The loop crosses beside the lowest line, and it is refused as for a single response.
    assert "add the lines" in livebode(*tune, "velocity1/u1").err
    assert "no controller joins velocity1 and u2" in livebode(*tune, "velocity1/u2").err
    assert "no controller is described" in livebode("validate", folder / "before", "--loop").err


@pytest.mark.parametrize("command", [["tune", "--shaper"], ["learn", "--out", "baseline.json"]])
def test_what_needs_a_single_response_refuses_a_matrix_in_one_sentence(folder: Path, command: list[str]) -> None:
    found = livebode(*command, folder / "before")
    assert found.code == 2
    assert "is a matrix run" in found.err
    assert len(found.err.strip().splitlines()) == 1


def test_the_list_of_runs_names_the_channels_of_a_matrix(folder: Path) -> None:
    row = entry(folder / "before")
    assert (row.state, row.signals) == ("finished", "velocity1, velocity2 / u1, u2 / w1, w2")


def test_a_relative_baseline_is_found_from_other_directories(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (folder / "after.toml").read_text() + '[monitoring]\nbaseline = "before"\n'
    (folder / "judged.toml").write_text(text)
    for name, *options in (("judged.toml",), ("after.toml", "--baseline", "before")):
        monkeypatch.chdir(folder)
        assert livebode("run", name, *options, "--out", "judged", "--force").code == 0
        run = RunRecord.open(folder / "judged", matrix=True)
        monkeypatch.chdir("/")
        one = run.entry("velocity2", "u1").summary
        _, healthy, remark = overlays_of(one, Quantities.of(one))
        assert healthy is not None, remark
        assert run.summary["monitoring"]["changes"] == 1


def test_the_page_of_an_entry_shows_its_loop_where_its_controller_is_described(folder: Path) -> None:
    described = (folder / "before.toml").read_text() + CONTROLLERS.replace("GAIN", "0.3")
    (folder / "described.toml").write_text(described)
    assert livebode("run", folder / "described.toml", "--out", folder / "described").code == 0
    for name in EVERY.split(", "):
        quantities = Quantities.of(RunRecord.open(folder / "described", entry=name).summary)
        shown = [not quantities.why_not(q) for q in ("plant", "open loop", "closed loop", "sensitivity")]
        assert shown == [True] + [name in ("velocity1/u1", "velocity2/u2")] * 3
