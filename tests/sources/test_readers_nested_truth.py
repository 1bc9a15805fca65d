"""Names, paths, units and shapes in the formats that nest: MATLAB structs, HDF5 groups, matrices, NPZ."""

from __future__ import annotations

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import scipy.io
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from livebode.core import RecordingError
from livebode.sources import open_log
from tests.support.errors import refused
from tests.support.recordings import dspace, write_dspace73

QUICK = settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def values(log, name):
    return np.concatenate([block[name] for block in log.blocks([name], block_samples=7)])


@pytest.fixture(params=["v5", "v7.3"])
def dspace_path(request, tmp_path):
    path = tmp_path / "rec.mat"
    if request.param == "v5":
        scipy.io.savemat(path, dspace(100))
    else:
        write_dspace73(path, 100)
    return path


def test_paths_into_structs(dspace_path):
    log = open_log(dspace_path)
    assert log.rate_hz == 4000
    assert "rec.X.Data" in log.rate_origin
    assert [(c.name, c.unit) for c in log.channels] == [("rec.X.Data", ""), ("omega", "rad/s"), ("iq", "A")]
    truth = np.arange(100) / 4000 * 3
    for name in ("rec.Y(2).Data", "Model Root/Current/iq", "iq", "rec(1).Y(2).Data"):
        np.testing.assert_array_equal(values(log, name), truth)
    assert values(log, "rec(1).X(1).Data")[1] == 1 / 4000
    assert log.aliases["rec.Y(1).Data"] == "omega"


@pytest.mark.parametrize(
    ("names", "channels"),
    [
        (["enc1 (mm)", "Model/Axis/enc2 (mm/s)"], [("enc1", "mm"), ("enc2", "mm/s")]),
        (["Axis 1/enc (mm)", "Axis 2/enc (mm)"], [("rec.Y(1).Data", "mm"), ("rec.Y(2).Data", "mm")]),
        (["", "enc"], [("rec.Y(1).Data", ""), ("enc", "")]),
    ],
)
def test_names_that_a_person_gave_are_shown_with_their_units(tmp_path, names, channels):
    given = dspace(100)
    for element, name in zip(given["rec"]["Y"][0, 0][0], names):
        element["Name"], element["Unit"] = name, ""
    scipy.io.savemat(tmp_path / "rec.mat", given)
    log = open_log(tmp_path / "rec.mat").as_written()
    assert [(c.name, c.source_unit) for c in log.channels][1:] == channels
    for at, name in enumerate(names, start=1):
        for other in filter(None, [name, f"rec.Y({at}).Data", channels[at - 1][0]]):
            np.testing.assert_array_equal(values(log, other), np.arange(100) / 4000 * (at + 1))


@QUICK
@given(st.tuples(st.integers(1, 4), st.integers(1, 4)), st.integers(5, 60), st.sampled_from(["C", "F"]))
def test_arrays_of_three_axes_are_named_by_their_indices(tmp_path, widths, samples, order):
    a, b = widths
    data = np.array(np.arange(float(a * b * samples)).reshape(a, b, samples), order=order)
    scipy.io.savemat(tmp_path / "a.mat", {"Y": data})
    with h5py.File(tmp_path / "b.mat", "w", userblock_size=512) as file:
        file.create_dataset("Y", data=data.transpose()).attrs["MATLAB_class"] = np.bytes_("double")
    with (tmp_path / "b.mat").open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    np.savez(tmp_path / "a.npz", Y=data)
    for name in ("a.mat", "b.mat", "a.npz"):
        log = open_log(tmp_path / name, rate_hz=1)
        expected = {f"Y({i + 1},{j + 1})": data[i, j] for i in range(a) for j in range(b)}
        expected = {"Y": data[0, 0]} if len(expected) == 1 else expected
        assert {channel.name for channel in log.channels} == expected.keys()
        for channel, truth in expected.items():
            np.testing.assert_array_equal(values(log, channel), truth)


def test_an_array_of_three_axes_with_time_between_the_others(tmp_path):
    data = np.arange(2.0 * 50 * 3).reshape(2, 50, 3)
    for order in ("C", "F"):
        np.savez(tmp_path / "a.npz", Y=np.array(data, order=order))
        np.testing.assert_array_equal(values(open_log(tmp_path / "a.npz", rate_hz=1), "Y(2,3)"), data[1, :, 2])


def test_an_array_of_too_many_series_is_skipped(tmp_path):
    scipy.io.savemat(tmp_path / "a.mat", {"Y": np.zeros((9, 9, 100)), "u": np.arange(100.0)})
    log = open_log(tmp_path / "a.mat", rate_hz=1)
    assert [channel.name for channel in log.channels] == ["u"]
    assert "at most 64 series" in log.skipped[0].reason


@QUICK
@given(st.integers(2, 200), st.integers(1, 8), st.booleans(), st.sampled_from(["C", "F"]))
def test_matrices_are_numbered_along_the_shorter_axis(tmp_path, samples, width, transposed, order):
    data = np.arange(float(samples * width)).reshape(samples, width)
    if transposed and samples > width:
        array = np.array(data.T, order=order)
    elif samples >= width:
        array = np.array(data, order=order)
    else:
        return
    for path, write in (
        (tmp_path / "a.npz", lambda path: np.savez(path, y=array)),
        (tmp_path / "b.npz", lambda path: np.savez_compressed(path, y=array)),
        (tmp_path / "a.mat", lambda path: scipy.io.savemat(path, {"y": array})),
        (tmp_path / "a.h5", lambda path: h5_write(path, array)),
    ):
        write(path)
        log = open_log(path, rate_hz=1)
        names = [channel.name for channel in log.channels]
        assert names == (["y"] if width == 1 else [f"y({k + 1})" for k in range(width)])
        for k, name in enumerate(names):
            np.testing.assert_array_equal(values(log, name), data[:, k])


def h5_write(path, array):
    with h5py.File(path, "w") as file:
        file["y"] = array


def test_groups_attributes_and_lengths_in_hdf5(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.attrs["fs"] = 2500
        drive = file.create_group("axis/drive")
        drive["speed"] = np.arange(1000.0)
        drive["speed"].attrs["unit"] = "rad/s"
        drive["torque [Nm]"] = np.arange(1000, dtype=np.int16)
        drive["gain"] = 3.5
        drive["period"] = np.arange(100.0)
        drive["name"] = "X1"
        drive["z"] = np.arange(1000) * 1j
    log = open_log(tmp_path / "a.h5")
    assert (log.rate_hz, log.samples) == (2500, 1000)
    assert [(c.name, c.unit) for c in log.channels] == [("axis/drive/speed", "rad/s"), ("axis/drive/torque", "N m")]
    assert log.scalars["axis/drive/gain"] == 3.5
    reasons = {skipped.name.rpartition("/")[2]: skipped.reason for skipped in log.skipped}
    assert reasons["period"] == "it has 100 samples, not 1000"
    assert "not real numbers" in reasons["z"]
    with refused(RecordingError, "lengths-differ", channel="axis/drive/period", samples=[100, 1000]):
        log.blocks(["axis/drive/period"])
    alone = open_log(tmp_path / "a.h5", channels=["axis/drive/period"])
    assert values(alone, "axis/drive/period")[-1] == 99
    with refused(RecordingError, "lengths-differ", argument="channels", samples=[100, 1000]):
        open_log(tmp_path / "a.h5", channels=["axis/drive/period", "axis/drive/speed"])


def test_units_of_arrow_fields(tmp_path):
    schema = pa.schema([pa.field("u", pa.float32(), metadata={"unit": "V"}), pa.field("i [A]", pa.int8())])
    pq.write_table(pa.table([[1.0, None, 3.0], [1, 2, None]], schema=schema), tmp_path / "a.parquet")
    log = open_log(tmp_path / "a.parquet", rate_hz=1)
    assert [(c.name, c.unit) for c in log.channels] == [("u", "V"), ("i", "A")]
    np.testing.assert_array_equal(values(log, "u"), [1, np.nan, 3])
    np.testing.assert_array_equal(values(log, "i [A]"), [1, 2, np.nan])


@pytest.mark.parametrize("dtype", ["f4", "f8", "i1", "u2", "i4", "u8", ">f8", ">i2", "?"])
def test_every_type_of_number(tmp_path, dtype):
    array = np.array([0, 1, 1, 0, 1]).astype(dtype)
    np.savez(tmp_path / "a.npz", y=array)
    h5_write(tmp_path / "a.h5", array)
    for path in (tmp_path / "a.npz", tmp_path / "a.h5"):
        np.testing.assert_array_equal(values(open_log(path, rate_hz=1), "y"), [0, 1, 1, 0, 1])
