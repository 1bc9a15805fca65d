"""Matrices of responses are read back by the programs that they are for, with covariance, names and directions."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import pyuff
import scipy.io
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import REASONS, Lines, MatrixResponses, OutputError, RecordError, SignalError, UsageError
from livebode.export import write_matrix_csv, write_matrix_mat, write_matrix_netcdf, write_matrix_uff
from livebode.export.degrees_of_freedom import DegreeOfFreedom
from tests.support.errors import refused
from tests.support.exact_csv import read_exactly
from tests.support.matrices import any_matrices, matrices

ABOUT = {"configuration": {"signals": {"output": ["ω"]}}}
SOME = settings(max_examples=25, deadline=None)
LINES = Lines.parse("20:140:20", 4000, 400)


def same(found: object, expected: np.ndarray) -> None:
    np.testing.assert_array_equal(np.asarray(found, dtype=expected.dtype), expected)


def halves(responses: MatrixResponses) -> list[MatrixResponses]:
    return [responses[:1], responses[1:]]


@SOME
@given(any_matrices())
def test_csv_is_read_exactly_by_pandas(tmp_path_factory: pytest.TempPathFactory, responses: MatrixResponses) -> None:
    path = tmp_path_factory.mktemp("csv") / "a.csv"
    assert write_matrix_csv(path, halves(responses), ABOUT).rows == len(responses)
    frame = read_exactly(path).set_index(["output", "input"])
    lines = len(responses.lines)
    for o, output in enumerate(responses.outputs):
        for i, input in enumerate(responses.inputs):
            part, entry = frame.loc[[(output, input)]], responses.entry(o, i)
            same(part["time [s]"], np.repeat(entry.time_s, lines))
            same(part["frequency [Hz]"], np.tile(entry.frequency_hz, len(entry)))
            same(part["re"] + 1j * part["im"], entry.value.ravel())
            same(part["sigma"], entry.sigma.ravel())
            same(part["coherence"], entry.coherence.ravel())
            same(part["condition"], responses.condition.ravel())
            same(part["valid"], entry.valid.ravel())
            assert (part["unit"].fillna("") == entry.unit).all() if entry.unit else part["unit"].isna().all()
            words = [word if isinstance(word, str) else "" for word in part["reason"]]
            assert words == [REASONS[n] for n in responses.reason[:, :, i].ravel()]


@SOME
@given(any_matrices())
def test_netcdf_is_read_back_by_xarray_with_the_covariance(
    tmp_path_factory: pytest.TempPathFactory, responses: MatrixResponses
) -> None:
    path = tmp_path_factory.mktemp("netcdf") / "a.nc"
    assert write_matrix_netcdf(path, halves(responses), ABOUT).rows == len(responses)
    with xr.open_dataset(path) as file:
        file.load()
    assert file.response_re.dims == ("time_s", "frequency_hz", "output", "input")
    assert file.output.values.tolist() == list(responses.outputs)
    if responses.units:
        assert file.unit.values.tolist() == [list(row) for row in responses.units]
    same(file.response_re + 1j * file.response_im, responses.value)
    covariance = (file.noise_re + 1j * file.noise_im) * (file.spread_re + 1j * file.spread_im)
    order = ("time_s", "frequency_hz", "output", "input", "other_output", "other_input")
    np.testing.assert_allclose(covariance.transpose(*order), responses.covariance, rtol=1e-13)
    for name in ("sigma", "coherence", "condition", "valid", "reason", "dof", "time_s", "first", "sample"):
        same(file[name], getattr(responses, name))
    assert file.reason.attrs["flag_meanings"] == "valid incomplete not_excited not_separated"
    assert json.loads(file.attrs["run"]) == ABOUT


@SOME
@given(any_matrices())
def test_mat_has_the_shapes_that_frd_and_idfrd_take(
    tmp_path_factory: pytest.TempPathFactory, responses: MatrixResponses
) -> None:
    path = tmp_path_factory.mktemp("mat") / "a.mat"
    assert write_matrix_mat(path, halves(responses), ABOUT).rows == len(responses)
    struct = scipy.io.loadmat(path)["livebode"][0, 0]
    rows = len(responses)
    kept = responses.valid[0].any(axis=1) if rows == 1 else np.ones(len(responses.lines), dtype=bool)
    ny, nu, lines = len(responses.outputs), len(responses.inputs), int(kept.sum())
    # MATLAB does not store dimensions of 1 at the end.
    value = struct["H"].reshape(ny, nu, lines, rows)
    same(value, responses.value[:, kept].transpose(2, 3, 1, 0))
    same(struct["w"], 2 * np.pi * responses.frequency_hz[kept][:, np.newaxis])
    parts = struct["CovarianceData"].reshape(ny, nu, lines, 2, 2, rows)
    variance = responses.sigma[:, kept].transpose(2, 3, 1, 0) ** 2
    np.testing.assert_allclose(parts[:, :, :, 0, 0] + parts[:, :, :, 1, 1], variance, rtol=1e-13)
    assert not np.nan_to_num(parts[:, :, :, 0, 1]).any()
    noise = struct["noise"].reshape(ny, ny, lines, rows)
    spread = struct["spread"].reshape(nu, nu, lines, rows)
    covariance = np.einsum("opkr,ijkr->rkoipj", noise, spread)
    np.testing.assert_allclose(covariance, responses.covariance[:, kept], rtol=1e-13)
    same(struct["valid"].reshape(nu, lines, rows), responses.valid[:, kept].transpose(2, 1, 0))
    same(struct["reason"].reshape(nu, lines, rows), responses.reason[:, kept].transpose(2, 1, 0))
    assert ["".join(cell[0]) for cell in struct["reasons"]] == ["", "incomplete", "not excited", "not separated"]
    assert [cell[0].item() for cell in struct["InputName"]] == list(responses.inputs)
    assert [cell[0].item() for cell in struct["OutputName"]] == list(responses.outputs)
    if responses.units:
        assert [[cell.item() for cell in row] for row in struct["units"]] == [list(row) for row in responses.units]
    assert struct["Ts"].item() == 1 / responses.lines.rate_hz


@SOME
@given(any_matrices(), st.booleans())
def test_uff_has_every_entry_with_its_degrees_of_freedom(
    tmp_path_factory: pytest.TempPathFactory, responses: MatrixResponses, named: bool
) -> None:
    path = tmp_path_factory.mktemp("uff") / "a.uff"
    dofs = {"velocity1": "12-RZ", "u1": "7+y"} if named else {}
    entries = [
        (o, i, responses.entry(o, i)[row])
        for row in range(len(responses))
        for i in range(len(responses.inputs))
        for o in range(len(responses.outputs))
    ]
    kept = [(o, i, one) for o, i, one in entries if one.valid.sum() >= 2]
    if not kept:
        with refused(SignalError, "too-few-lines"):
            write_matrix_uff(path, [responses], ABOUT, dofs)
        return
    assert write_matrix_uff(path, halves(responses), ABOUT, dofs) == (len(kept), len(entries) - len(kept))
    read = pyuff.UFF(str(path)).read_sets()
    functions = read if isinstance(read, list) else [read]
    for function, (o, i, one) in zip(functions, kept, strict=True):
        response = (12, -6) if named and o == 0 else (o + 1, 0)
        reference = (7, 2) if named and i == 0 else (i + 1, 0)
        assert (function["rsp_node"], function["rsp_dir"]) == response
        assert (function["ref_node"], function["ref_dir"]) == reference
        assert function["rsp_ent_name"].strip() == responses.outputs[o]
        assert function["id1"] == f"plant from {responses.inputs[i]} to {responses.outputs[o]}"
        np.testing.assert_allclose(function["data"], one.value[one.valid], rtol=1e-11)


@given(st.integers(0, 9_999_999_999), st.integers(-6, 6))
def test_a_degree_of_freedom_is_read_as_it_is_written(node: int, direction: int) -> None:
    one = DegreeOfFreedom(node, direction)
    assert DegreeOfFreedom.parse(str(one)) == one


def test_wrong_degrees_of_freedom_and_runs_without_responses_are_refused(tmp_path: Path) -> None:
    responses = matrices(1, LINES)
    with refused(UsageError, "out-of-range", value="12X"):
        write_matrix_uff(tmp_path / "a", [responses], None, {"u1": "12X"})
    with refused(UsageError, "unknown-name", value="u9"):
        write_matrix_uff(tmp_path / "a", [responses], None, {"u9": "12+X"})
    for write in (write_matrix_csv, write_matrix_mat, write_matrix_netcdf):
        with refused(RecordError, "no-responses"):
            write(tmp_path / "a", iter([]))


def test_formats_held_in_memory_count_the_entries_of_a_matrix(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("livebode.export.result.VALUES_MAX", 100)
    for write in (write_matrix_mat, write_matrix_netcdf):
        with refused(OutputError, "too-large", limit=100):
            write(tmp_path / "a", [matrices(4, LINES)])
