"""What is exported is read back by the programs it is for, whatever the responses hold."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import control
import numpy as np
import pyarrow.csv
import pytest
import pyuff
import scipy.io
import xarray as xr
from hypothesis import given, settings

from livebode.core import Lines, Responses, SignalError
from livebode.export import nearest_response, write_csv, write_mat, write_netcdf, write_uff
from livebode.sources import open_log
from tests.support.errors import refused
from tests.support.exact_csv import read_exactly
from tests.support.responses import any_responses, cut, made

ABOUT = {"configuration": {"signals": {"output": "ω", "input": "iq"}}, "found": {"unit": "µm"}}
SOME = settings(max_examples=40, deadline=None)
LINES = Lines.parse("20:140:20", 4000, 400)


def same(found: object, expected: np.ndarray) -> None:
    np.testing.assert_array_equal(np.asarray(found, dtype=expected.dtype), expected)


@SOME
@given(any_responses())
def test_csv_is_read_exactly_by_pandas_and_arrow(
    tmp_path_factory: pytest.TempPathFactory, responses: Responses
) -> None:
    path = tmp_path_factory.mktemp("csv") / "a.csv"
    assert write_csv(path, cut(responses, 1, 1), ABOUT).rows == len(responses)
    rows, lines = responses.value.shape
    unit = f" [{responses.unit}]" if responses.unit else ""
    frame = read_exactly(path)
    table = pyarrow.csv.read_csv(path)
    assert table.column_names == list(frame.columns)
    for column in (frame.__getitem__, lambda name: table[name].to_numpy()):
        same(column("time [s]"), np.repeat(responses.time_s, lines))
        same(column("schedule"), np.repeat(responses.schedule, lines))
        same(column("frequency [Hz]"), np.tile(responses.lines.frequency_hz, rows))
        same(column(f"re{unit}"), responses.value.real.ravel())
        same(column(f"im{unit}"), responses.value.imag.ravel())
        same(column(f"sigma{unit}"), responses.sigma.ravel())
        same(column("magnitude [dB]"), responses.magnitude_db.ravel())
        same(column("coherence"), responses.coherence.ravel())
        same(column("dof"), np.repeat(responses.dof, lines))
        same(column("valid"), responses.valid.ravel())
        same(column("first"), np.repeat(responses.first, lines))
        same(column("sample"), np.repeat(responses.sample, lines))


def test_csv_is_read_by_livebode_itself(tmp_path: Path) -> None:
    responses = made(200, LINES, unit="rad/s/(N m)")
    write_csv(tmp_path / "a.csv", [responses])
    log = open_log(tmp_path / "a.csv", rate_hz=1, time="none")
    assert {(c.name, c.unit) for c in log.channels} >= {("time", "s"), ("frequency", "Hz"), ("re", "rad/s/(N m)")}
    read = np.concatenate([block.data for block in log.blocks(["re", "im", "sigma"])], axis=1)
    same(read, np.stack([responses.value.real.ravel(), responses.value.imag.ravel(), responses.sigma.ravel()]))


@SOME
@given(any_responses())
def test_netcdf_is_read_back_by_xarray_as_the_responses(
    tmp_path_factory: pytest.TempPathFactory, responses: Responses
) -> None:
    path = tmp_path_factory.mktemp("netcdf") / "a.nc"
    assert write_netcdf(path, cut(responses, 1), ABOUT).rows == len(responses)
    memory = responses.to_xarray()
    with xr.open_dataset(path) as file:
        file.load()
    assert memory["response"].dims == ("time_s", "frequency_hz")
    same(memory["response"], responses.value)
    same(file["response_re"] + 1j * file["response_im"], responses.value)
    for dataset in (memory, file):
        for name in ("sigma", "coherence", "valid", "dof", "time_s", "schedule", "first", "sample"):
            same(dataset[name], getattr(responses, name))
        assert dataset["valid"].dtype == bool
        same(dataset["frequency_hz"], responses.lines.frequency_hz)
        assert dataset["sigma"].attrs["units"] == (responses.unit or "1")
        assert dataset.attrs["rate_hz"] == responses.lines.rate_hz
    assert json.loads(file.attrs["run"]) == ABOUT


def test_xarray_selects_by_moment_and_line() -> None:
    responses = made(50, LINES, hole=0.0)
    dataset = responses.to_xarray()
    found = dataset["response"].sel(time_s=responses.time_s[7] + 1e-4, frequency_hz=60, method="nearest")
    assert complex(found) == responses.value[7, 2]


@SOME
@given(any_responses())
def test_mat_has_the_shapes_that_frd_takes(tmp_path_factory: pytest.TempPathFactory, responses: Responses) -> None:
    path = tmp_path_factory.mktemp("mat") / "a.mat"
    assert write_mat(path, cut(responses, 1), ABOUT).rows == len(responses)
    struct = scipy.io.loadmat(path)["livebode"][0, 0]
    rows, kept = (
        len(responses),
        responses.valid[0] if len(responses) == 1 else np.ones(len(responses.lines), dtype=bool),
    )
    lines = int(kept.sum())
    # A response of one line or one moment ends in a dimension of 1, which MATLAB does not store.
    same(struct["H"].reshape(1, 1, lines, rows), responses.value.T[kept][np.newaxis, np.newaxis])
    assert struct["H"].shape[:3] == (1, 1, lines) or lines * rows <= lines
    same(struct["w"], 2 * np.pi * responses.lines.frequency_hz[kept][:, np.newaxis])
    for name in ("sigma", "coherence", "valid"):
        same(struct[name], getattr(responses, name).T[kept])
    for name in ("time_s", "schedule", "dof", "first", "sample"):
        same(struct[name], getattr(responses, name)[np.newaxis])
    assert struct["Ts"].item() == 1 / responses.lines.rate_hz
    assert "".join(struct["unit"].ravel()) == responses.unit
    assert json.loads(struct["run"].item()) == ABOUT


@SOME
@given(any_responses())
def test_uff_has_every_function_with_two_valid_lines(
    tmp_path_factory: pytest.TempPathFactory, responses: Responses
) -> None:
    path = tmp_path_factory.mktemp("uff") / "a.uff"
    kept = [response for response in responses if response.valid.sum() >= 2]
    if not kept:
        with refused(SignalError, "too-few-lines", lines_min=2):
            write_uff(path, [responses], ABOUT)
        return
    assert write_uff(path, cut(responses, 1), ABOUT) == (len(kept), len(responses) - len(kept))
    read = pyuff.UFF(str(path)).read_sets()
    functions = read if isinstance(read, list) else [read]
    assert len(functions) == len(kept)
    for number, (function, response) in enumerate(zip(functions, kept), start=1):
        assert (function["type"], function["func_type"], function["func_id"]) == (58, 4, number)
        assert function["ord_data_type"] == 6
        value, frequency_hz = response.value[response.valid], response.lines.frequency_hz[response.valid]
        np.testing.assert_allclose(function["data"].real, value.real, rtol=1e-11)
        np.testing.assert_allclose(function["data"].imag, value.imag, rtol=1e-11)
        # Uneven spacing has six digits of each frequency; even spacing is used where it is exact.
        np.testing.assert_allclose(function["x"], frequency_hz, rtol=1e-11 if function["abscissa_spacing"] else 5.1e-6)
        assert function["z_axis_value"] == pytest.approx(response.time_s, rel=1e-5)
        assert (function["abscissa_axis_units_lab"], function["abscissa_spec_data_type"]) == ("Hz", 18)
        assert function["id1"] == "plant from iq to ?"
        assert f"samples {response.first} to {response.sample}" in function["id4"]


def test_uff_is_evenly_spaced_where_that_is_exact(tmp_path: Path) -> None:
    def spacing(lines: Lines) -> int:
        write_uff(tmp_path / "a.uff", [made(1, lines, hole=0.0)])
        return int(pyuff.UFF(str(tmp_path / "a.uff")).read_sets()["abscissa_spacing"])

    assert spacing(LINES) == 1
    assert spacing(Lines.parse("20,40,80", 4000, 400)) == 0
    assert spacing(Lines.parse("k=1:20", 4000, 2047)) == 0  # 1.95408 Hz apart to six digits


def test_one_response_of_many_converts_to_python_control() -> None:
    responses = made(30, LINES, hole=0.2)
    response = nearest_response([responses], responses.time_s[11])
    frd = response.to_frd()
    assert isinstance(frd, control.FrequencyResponseData)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        same(np.squeeze(frd.frdata), response.value[response.valid])
    np.testing.assert_allclose(frd.omega, 2 * np.pi * LINES.frequency_hz[response.valid])


@SOME
@given(any_responses())
def test_a_single_response_equals_its_row(responses: Responses) -> None:
    for i, response in enumerate(responses):
        alone = Responses.of(response)
        for name in ("value", "sigma", "dof", "coherence", "valid", "first", "sample", "time_s", "schedule"):
            same(getattr(alone, name), getattr(responses[i : i + 1], name))
        assert (alone.lines, alone.unit, alone.quantity) == (responses.lines, responses.unit, responses.quantity)
