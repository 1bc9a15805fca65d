"""An archive of matrices has what their runs have; its queries know outputs and inputs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from livebode import RecordError
from livebode.core import Block, MatrixResponses
from livebode.records import RunRecord
from livebode_plant.lake import Lake, LakeRun, compact, runs_of
from tests.support.archives import loop
from tests.support.command import livebode as command
from tests.support.gantry_runs import NAMES, RATE_HZ, SECTIONS, gantry_axis, gantry_block, gantry_log, gantry_run

ROUNDED = 2.0**-24
"""Half of the last bit of float32, relative."""
TRACKING = SECTIONS["tracking"] | {"average": True}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two machines, the second with twice the second speed, its baseline before that, and a recipe of one response."""
    folder, block = tmp_path_factory.mktemp("archive"), gantry_block(repetitions=3)
    other = block.data.copy()
    other[5] *= 2
    gantry_log(folder / "left.parquet", block)
    gantry_log(folder / "right.parquet", Block(other, NAMES, rate_hz=RATE_HZ))
    gantry_run(gantry_axis(folder / "left.parquet", tracking=TRACKING), folder / "baselines" / "right")
    (folder / "recipe.toml").write_text(toml(SECTIONS | {"tracking": TRACKING}))
    single = {"signals": {"output": "velocity1", "input": "u1", "excitation": "w1"}, "lines": SECTIONS["lines"]}
    (folder / "single.toml").write_text(toml(single | {"tracking": TRACKING}))
    for name, recipe in (("archive", "recipe"), ("other", "single")):
        lines = ['inputs = ["{machine}.parquet"]', f'recipe = "{recipe}.toml"', 'lake = "lake"']
        lines += ['baselines = "baselines/{machine}"'] if name == "archive" else []
        (folder / f"{name}.toml").write_text("\n".join(lines))
        loop(folder / f"{name}.toml", str(folder / "lake"))
    return folder


def toml(sections: dict[str, Any]) -> str:
    return "".join(
        f"[{name}]\n" + "".join(f"{key} = {json.dumps(value)}\n" for key, value in section.items())
        for name, section in sections.items()
    )


def matrix_run(folder: Path, machine: str) -> LakeRun:
    every = runs_of(Lake(str(folder / "lake")))
    (found,) = (run for run in every if run.is_matrix and run.row["machine"] == machine)
    return found


def check_rounded(found: MatrixResponses, expected: MatrixResponses) -> None:
    assert (found.outputs, found.inputs, found.units) == (expected.outputs, expected.inputs, expected.units)
    for name in ("reason", "first", "sample", "time_s"):
        assert np.array_equal(getattr(found, name), getattr(expected, name)), name
    for name in ("value", "noise", "spread", "dof", "coherence", "condition"):
        one, other = getattr(found, name), getattr(expected, name)
        for part in (np.real, np.imag):
            np.testing.assert_allclose(part(one), part(other), rtol=ROUNDED, err_msg=name)


def test_matrices_and_their_covariance_are_those_of_the_run_rounded_also_after_compaction(folder: Path) -> None:
    expected = RunRecord.open(folder / "baselines" / "right", matrix=True)  # of the same recording as "left"
    run = matrix_run(folder, "left")
    check_rounded(run.matrix(), expected.matrix())
    assert run.row["responses"] == len(expected.matrix()) > 5
    entry, own = run.entry("velocity2", "u1"), expected.entry("velocity2", "u1")
    assert (entry.kinds, entry.lines) == (own.kinds, own.lines)
    assert entry.responses().unit == own.responses().unit
    np.testing.assert_allclose(entry.responses().sigma, own.responses().sigma, rtol=2 * ROUNDED)
    compact(run.lake)
    check_rounded(matrix_run(folder, "left").matrix(), expected.matrix())


def test_where_one_response_is_needed_the_entries_are_named(folder: Path) -> None:
    run = matrix_run(folder, "left")
    with pytest.raises(RecordError, match="choose an entry: velocity1/u1, velocity1/u2, velocity2/u1") as caught:
        run.responses()
    assert caught.value.code == "record.entry-missing"
    with pytest.raises(RecordError, match="no entry 'velocity3/u1'"):
        run.entry("velocity3", "u1")


def test_a_machine_is_compared_with_the_run_at_the_place_of_its_baseline(folder: Path) -> None:
    left, right = (matrix_run(folder, machine).row for machine in ("left", "right"))
    assert (left["baseline"], left["alarms"]) == (None, 0)
    assert right["baseline"] is not None
    assert right["alarms"] == 1


def test_learning_names_the_baseline_of_a_matrix(folder: Path) -> None:
    for arguments in (("archive", "learn", folder / "archive.toml", "--machine", "left"),
                      ("learn", folder / "baselines" / "right")):  # fmt: skip
        found = command(*arguments, "--out", folder / "learned.json")
        assert found.code == 2
        assert "set monitoring.baseline (--baseline)" in found.err


def test_a_query_knows_outputs_and_inputs_and_single_responses_beside_them(folder: Path) -> None:
    sql = (
        "SELECT machine, output, input, count(*) AS n, max(list_max(re)) FROM responses JOIN runs "
        "USING (content, recipe) WHERE machine = 'left' AND list_bool_and(valid) GROUP BY ALL ORDER BY ALL"
    )
    found = command("archive", "list", folder / "archive.toml", "--sql", sql, "--json")
    assert (found.code, found.err) == (0, "")
    rows = json.loads(found.out)["rows"]
    names = [(output, input) for output in NAMES[4:] for input in NAMES[2:4]]
    assert [tuple(row[1:3]) for row in rows] == [*names, (None, None)]
    matrix = matrix_run(folder, "left").matrix()
    whole = matrix[np.flatnonzero(matrix.valid.all(axis=(1, 2)))]
    for (output, input), row in zip(names, rows):
        responses = whole.entry(output, input)
        assert row[3] == len(responses)
        assert row[4] == pytest.approx(responses.value.real.max(), rel=1e-6)
    factors = command(
        "archive", "list", folder / "lake", "--sql", "SELECT DISTINCT factor FROM covariance ORDER BY 1", "--csv"
    )
    assert factors.out == "factor\nnoise\nspread\n"
    assert (
        "query the tables of this lake: runs, files"
        in command("archive", "list", folder / "lake", "--sql", "SELECT x").err
    )
