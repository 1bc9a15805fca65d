"""Damage in the tables of a matrix run is reported, and everything else is read; other files are refused."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from livebode.core import DamageWarning, RecordError
from livebode.records import MATRIX_TABLES, RunDirectory, RunRecord
from livebode.records.json_format import VERSIONS
from livebode.records.summary_file import to_document
from tests.support.errors import refused
from tests.support.gantry_runs import gantry_axis, gantry_block, gantry_log, gantry_run

NO_KIND = {"output": None, "input": None, "output_unit": "", "input_unit": ""}


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return gantry_log(tmp_path_factory.mktemp("gantry") / "gantry.parquet", gantry_block(repetitions=3))


@pytest.fixture
def run(log: Path, tmp_path: Path) -> Path:
    return gantry_run(gantry_axis(log), tmp_path / "run").directory


def flip(path: Path, at: int) -> None:
    data = bytearray(path.read_bytes())
    data[at] ^= 1
    path.write_bytes(bytes(data))


def test_a_damaged_covariance_leaves_the_responses(run: Path) -> None:
    before = RunRecord.open(run, matrix=True).matrix()
    flip(run / "covariance.parquet", 100)
    with pytest.warns(DamageWarning, match=r"covariance.parquet is damaged"):
        after = RunRecord.open(run, matrix=True).matrix()
    assert np.array_equal(after.value, before.value, equal_nan=True)
    assert np.array_equal(after.reason, before.reason)
    assert np.isnan(after.noise).all()
    assert np.isnan(after.bound()).all()
    entry = RunRecord.open(run, entry="velocity1/u2").responses()  # its sigma is in the other table
    assert entry.equals(before.entry("velocity1", "u2"))


def test_a_missing_covariance_is_reported(run: Path) -> None:
    (run / "covariance.parquet").unlink()
    with pytest.warns(DamageWarning, match="the file is missing"):
        assert len(RunRecord.open(run, matrix=True).matrix()) > 0


def test_damaged_responses_are_left_out(run: Path) -> None:
    flip(run / "responses.parquet", 100)
    record = RunRecord.open(run, matrix=True)
    with pytest.warns(DamageWarning, match=r"responses.parquet is damaged"):
        assert sum(map(len, record.matrix_batches())) == 0
    with pytest.raises(RecordError, match=r"responses.parquet of .* no rows of responses are left; track .* again"):
        record.matrix()


def test_a_damaged_segment_costs_its_own_rows(log: Path, tmp_path: Path) -> None:
    run = gantry_run(gantry_axis(log, record={"segment_s": 2.0}), tmp_path / "run").directory
    whole = RunRecord.open(run, matrix=True).matrix()
    segments = sorted((run / "covariance").iterdir())
    assert len(segments) > 2
    flip(segments[1], 100)
    with pytest.warns(DamageWarning):
        after = RunRecord.open(run, matrix=True).matrix()
    assert np.array_equal(after.value, whole.value, equal_nan=True)
    lost = np.isnan(after.spread).all(axis=(1, 2, 3)) & ~np.isnan(whole.spread).all(axis=(1, 2, 3))
    kept = ~lost
    assert 0 < np.count_nonzero(lost) < len(whole)
    assert np.array_equal(after.spread[kept], whole.spread[kept], equal_nan=True)
    assert np.array_equal(after.noise[kept], whole.noise[kept], equal_nan=True)


@pytest.mark.parametrize(
    "found",
    [
        {"outputs": ["a"], "inputs": ["u", "v"], "units": [["m"]], "kinds_of_entries": [[NO_KIND] * 2]},
        {"outputs": ["a", "a"], "inputs": ["u"], "units": [["m"]] * 2, "kinds_of_entries": [[NO_KIND]] * 2},
        {"outputs": [], "inputs": ["u"], "units": [], "kinds_of_entries": []},
        {"outputs": "ab", "inputs": ["u"], "units": [["m"]] * 2, "kinds_of_entries": [[NO_KIND]] * 2},
    ],
)
def test_a_hostile_description_of_the_entries_is_refused(run: Path, found: dict[str, object]) -> None:
    summary = RunRecord.open(run, matrix=True).summary
    (run / "run.json").write_bytes(to_document(summary | {"found": summary["found"] | found}))
    with refused(RecordError, "unexpected-content"):
        RunRecord.open(run, matrix=True)


def test_matrices_are_equal_after_any_number_of_writes(run: Path, tmp_path: Path) -> None:
    record = RunRecord.open(run, matrix=True)
    whole = record.matrix()
    rng = np.random.default_rng(0)
    for number in range(5):
        cuts = [0, *sorted(rng.integers(0, len(whole), 3).tolist()), len(whole)]
        with RunDirectory(tmp_path / str(number), MATRIX_TABLES) as directory:
            for a, b in pairwise(cuts):
                directory.write(whole[a:b])
            directory.finish(record.summary, lambda _: None)
        assert RunRecord.open(tmp_path / str(number), matrix=True).matrix().equals(whole)


def test_the_version_of_a_matrix_run_is_that_of_every_run(run: Path) -> None:
    assert f'"version": {VERSIONS["run"]}'.encode() in (run / "run.json").read_bytes()[:60]
