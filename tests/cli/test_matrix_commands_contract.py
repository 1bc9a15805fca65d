"""The commands on matrix runs: entries are selected with --entry, and a missing one is answered by their names."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from livebode.core import Block
from tests.support.command import livebode
from tests.support.gantry_runs import NAMES, RATE_HZ, gantry_block, gantry_log

SHARED = ["--lines", "10:60:5", "--window", "800", "--hop", "200"]
EVERY = "velocity1/u1, velocity1/u2, velocity2/u1, velocity2/u2"


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


@pytest.mark.parametrize("command", [["fit"], ["margins"], ["report"]])
def test_a_missing_entry_is_answered_by_the_names(folder: Path, command: list[str]) -> None:
    found = livebode(*command, folder / "before")
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
    rows = json.loads(livebode("query", folder / "before", sql, "--json").out)["rows"]
    assert [row[:2] for row in rows] == [
        ["velocity1", "u1"],
        ["velocity1", "u2"],
        ["velocity2", "u1"],
        ["velocity2", "u2"],
    ]
    factors = json.loads(livebode("query", folder / "before", "SELECT DISTINCT factor FROM covariance", "--json").out)
    assert sorted(row[0] for row in factors["rows"]) == ["noise", "spread"]
