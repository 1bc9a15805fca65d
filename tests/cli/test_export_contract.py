"""`livebode export`: a run's directory to a file that stands whole or not at all."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import pyuff
import scipy.io
import xarray as xr

from livebode.export import nearest_response, writers
from livebode.fitting import mean_response
from livebode.records import RunRecord
from tests.support.command import livebode, signals, write_parquet
from tests.support.exact_csv import read_exactly
from tests.support.runs import describe

PARAMETERS = {
    "time_s": [0.1, 0.1, 0.2, 0.2],
    "schedule": [np.nan, np.nan, 0.5, 0.5],
    "name": ["stiffness", "damping", "stiffness", "damping"],
    "value": [5e5, 130.0, np.nan, np.nan],
    "sigma": [1e3, 2.0, np.nan, np.nan],
    "unit": ["N/m", "N s/m", "N/m", "N s/m"],
    "model": ["two masses"] * 4,
    "status": ["ok", "ok", "not valid", "not valid"],
}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("export")
    log, out = write_parquet(folder / "log.parquet", signals()), folder / "monday"
    given = ("--excitation", "w", "--input", "u", "--output", "y", "--lines", "50,100,200", "--window", 100)
    assert livebode("run", log, *given, "--hop", 10, "--out", out).code == 0
    return out


def test_every_format_of_a_whole_run(run: Path) -> None:
    responses = RunRecord.open(run).responses()
    for to, ending in {"csv": ".csv", "mat": ".mat", "netcdf": ".nc", "uff": ".uff"}.items():
        done = livebode("export", run, "--to", to)
        path = run.with_suffix(ending)
        assert (done.code, done.err) == (0, "")
        assert done.out.startswith(f"{path}: ")
        assert path.is_file()
    assert len(pd.read_csv(run.with_suffix(".csv"))) == responses.value.size
    assert scipy.io.loadmat(run.with_suffix(".mat"))["livebode"][0, 0]["H"].shape == (1, 1, 3, len(responses))
    with xr.open_dataset(run.with_suffix(".nc")) as dataset:
        assert dataset.sizes == {"time_s": len(responses), "frequency_hz": 3}
        assert json.loads(dataset.attrs["run"]) == RunRecord.open(run).summary
    valid = int(np.count_nonzero(responses.valid.sum(axis=1) >= 2))
    assert pyuff.UFF(str(run.with_suffix(".uff"))).get_n_sets() == valid
    assert f"; {len(responses) - valid} with fewer than two valid lines left out" in done.out
    assert set(writers("responses")) == {"csv", "mat", "netcdf", "uff"}


def test_one_response_or_the_mean_of_a_run_is_exported(run: Path, tmp_path: Path) -> None:
    batches = RunRecord.open(run).batches
    for options, expected in (
        (("--at", "1.0"), nearest_response(batches(), 1.0)),
        (("--mean",), mean_response(batches())[0]),
    ):
        path = tmp_path / "below" / f"{len(options)}{options[0]}.csv"
        assert livebode("export", run, "--to", "csv", *options, "--out", path).code == 0
        frame = read_exactly(path)
        np.testing.assert_array_equal(frame["frequency [Hz]"], [50, 100, 200])
        np.testing.assert_array_equal(frame["re"] + 1j * frame["im"], expected.value)
        np.testing.assert_array_equal(frame["sigma"], expected.sigma)
        # The plant is a gain of 2 behind a sample of delay.
        truth = 2 * np.exp(-2j * np.pi * frame["frequency [Hz]"] / 1000)
        assert (np.abs(expected.value - truth) <= expected.bound(3)).all()
    assert abs(nearest_response(batches(), 1.0).time_s - 1.0) <= 0.005


def test_parameters_of_a_run_are_exported_and_a_run_without_fits_is_refused(run: Path, tmp_path: Path) -> None:
    assert "no model was fitted" in livebode("export", run, "--to", "csv", "--parameters").err
    fitted = tmp_path / "fitted"
    fitted.mkdir()
    # As one that writes it may: text as a dictionary, one more column.
    table = pa.table(PARAMETERS | {"more": range(4)})
    table = table.set_column(2, "name", table["name"].dictionary_encode())
    pq.write_table(table, fitted / "parameters.parquet")
    describe(fitted, run)
    for to in ("csv", "mat"):
        done = livebode("export", fitted, "--to", to, "--parameters")
        assert (done.code, done.err) == (0, "")
        assert (
            done.out == f"{tmp_path / 'fitted-parameters'}.{to}: 4 parameter values\nNext: livebode report {fitted}\n"
        )
    frame = read_exactly(tmp_path / "fitted-parameters.csv")
    pd.testing.assert_frame_equal(frame, pd.DataFrame(PARAMETERS), check_dtype=False)
    struct = scipy.io.loadmat(tmp_path / "fitted-parameters.mat", simplify_cells=True)["livebode"]
    assert list(struct) == list(PARAMETERS)
    for name, values in PARAMETERS.items():
        np.testing.assert_array_equal(np.array(struct[name]), np.array(values))


def test_a_file_is_replaced_only_with_force(run: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("mine")
    refused = livebode("export", run, "--to", "csv", "--out", path)
    assert refused.code == 2
    assert "exists already" in refused.err
    assert path.read_text() == "mine"
    assert livebode("export", run, "--to", "csv", "--out", path, "--force").code == 0
    assert path.read_text().startswith("time [s],")
    assert list(tmp_path.iterdir()) == [path]
