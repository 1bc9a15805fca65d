"""Bad files of each format and unsuitable options: one clear sentence with its remedy."""

from __future__ import annotations

import errno
import os
import struct
import sys
import zipfile
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import scipy.io

from livebode.core import ExtraError, RecordingError, UsageError, install_command
from livebode_drives.recordings.sinumerik import sinumerik_spectra
from tests.support.bad_recordings import drain, refusal, text
from tests.support.errors import refused
from tests.support.recordings import open_log, signals, write


def test_paths_that_are_not_recordings_are_refused(tmp_path):
    assert refusal(tmp_path / "none.csv").code == "recording.not-found"
    os.mkfifo(tmp_path / "pipe.csv")
    assert refusal(tmp_path / "pipe.csv").code == "recording.not-a-file"
    assert refusal(tmp_path).code == "recording.not-a-file"
    assert refusal(Path("a\0b")).code == "recording.not-readable"
    assert refusal(text(tmp_path, b"\x00\x01", "a.xyz")).code == "recording.format-unknown"
    other = refusal(text(tmp_path, b"\x00\x01", "a.parquet"))
    assert (other.code, other.suffix) == ("recording.format-unknown", ".parquet")
    assert "is not Parquet" in other.message


@pytest.mark.parametrize(("number", "reason"), [(errno.EACCES, "Permission denied"), (errno.EIO, "Input/output error")])
def test_a_file_that_cannot_be_opened_is_refused(tmp_path, monkeypatch, number, reason):
    def fail(*_: object, **__: object) -> None:
        raise OSError(number, os.strerror(number))

    path = write("npz", tmp_path, signals())
    monkeypatch.setattr(Path, "open", fail)  # permissions alone do not stop root, who runs many a container
    error = refusal(path, rate_hz=1)
    assert (error.code, error.path) == ("recording.not-readable", str(path))
    assert reason in error.message


@pytest.mark.parametrize("module", ["parquet", "arrow", "npz", "hdf5", "matlab"])
def test_a_table_without_rows_is_refused(module, tmp_path):
    error = refusal(write(module, tmp_path, {"u": np.empty(0), "v": np.empty(0)}), rate_hz=1)
    assert error.code in ("recording.channel-missing", "recording.empty")


def test_duplicate_names_in_parquet_are_refused(tmp_path):
    pq.write_table(pa.table([[1.0, 2.0], [3.0, 4.0]], names=["u", "u"]), tmp_path / "a.parquet")
    with refused(RecordingError, "channel-duplicated", channel="u", columns=[1, 2]):
        drain(tmp_path / "a.parquet", rate_hz=1)


def test_archives_with_a_password_or_pickles_are_refused(tmp_path):
    path = write("npz", tmp_path, signals())
    raw = bytearray(path.read_bytes())
    at = raw.find(b"PK\x01\x02")
    while at >= 0:  # set the flag "encrypted" of each member, here and in front of the member
        raw[at + 8] |= 1
        local = int.from_bytes(raw[at + 42 : at + 46], "little")
        raw[local + 6] |= 1
        at = raw.find(b"PK\x01\x02", at + 1)
    locked = refusal(text(tmp_path, bytes(raw), "b.npz"), rate_hz=1)
    assert (locked.code, locked.format) == ("recording.damaged", "NPZ")
    assert "password" in locked.message
    np.savez(tmp_path / "c.npz", a=np.array([{}], dtype=object), allow_pickle=True)
    pickled = refusal(tmp_path / "c.npz", rate_hz=1)
    assert pickled.code == "recording.channel-missing"
    assert "not real numbers" in pickled.message


def test_declared_sizes_without_data_are_refused(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("huge", (2**50,), dtype="f8", chunks=(1024,))
    huge = refusal(tmp_path / "a.h5", rate_hz=1)
    assert huge.code == "recording.channel-missing"
    assert "declares" in huge.message
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive, archive.open("x.npy", "w") as file:
        np.lib.format.write_array_header_1_0(file, {"descr": "<f8", "fortran_order": False, "shape": (2**40,)})
        file.write(b"\0" * 64)
    with refused(RecordingError, "truncated", path=str(tmp_path / "a.npz"), part="x.npy", shape=[2**40]):
        drain(tmp_path / "a.npz", rate_hz=1)
    scipy.io.savemat(tmp_path / "a.mat", {"x": np.arange(100.0)})
    raw = (tmp_path / "a.mat").read_bytes().replace(b"\x64\0\0\0", b"\xff\xff\xff\x7f")
    with refused(RecordingError, "truncated", path=str(tmp_path / "b.mat"), declared=2147483647):
        drain(text(tmp_path, raw, "b.mat"), rate_hz=1)


@pytest.mark.parametrize("kind", [0, 10, 14, 40, 0x7F00])
def test_an_unknown_element_type_in_a_mat_file_is_refused(tmp_path, kind):
    """SciPy looks such a type up behind the end of its table, which ends the process."""
    scipy.io.savemat(tmp_path / "a.mat", {"x": np.arange(100.0) + 0.5})
    tag = struct.pack("<II", 9, 800)
    raw = (tmp_path / "a.mat").read_bytes()
    assert raw.count(tag) == 1
    path = text(tmp_path, raw.replace(tag, struct.pack("<II", kind, 800)), "b.mat")
    with refused(RecordingError, "damaged", path=str(path), element=kind):
        drain(path, rate_hz=1)


def test_links_out_of_an_hdf5_file_are_not_followed(tmp_path):
    write("hdf5", tmp_path, signals(), "other")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["u"] = np.arange(10.0)
        file["out"] = h5py.ExternalLink("other.h5", "/input")
        file.create_dataset("raw", (10,), "f8", external=[(str(tmp_path / "other.h5"), 0, 80)])
    log = open_log(tmp_path / "a.h5", rate_hz=1)
    assert [channel.name for channel in log.channels] == ["u"]
    assert [skipped.name for skipped in log.skipped] == ["raw"]


def test_xml_with_entities_or_other_content_is_refused(tmp_path):
    bomb = '<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b "c">]><ResponseTestCustom>&b;</ResponseTestCustom>'
    assert refusal(text(tmp_path, bomb, "a.xml")).code == "recording.declaration-refused"
    other = refusal(text(tmp_path, "<html><body/></html>", "b.xml"))
    assert (other.code, other.part, other.signals) == ("recording.incomplete", "TimeSeries", 0)
    deep = refusal(text(tmp_path, "<a>" * 1000 + "</a>" * 1000, "c.xml"))
    assert (deep.code, deep.limit) == ("recording.too-large", 64)
    long = refusal(text(tmp_path, f"<a>{'<b/>' * (1 << 20)}</a>", "d.xml"))
    assert (long.code, long.limit) == ("recording.too-large", 1 << 20)
    with refused(RecordingError, "incomplete", part="SigNodeCrossSpectrumInfo"):
        sinumerik_spectra(write("sinumerik", tmp_path, signals()))


@pytest.mark.parametrize(
    ("options", "kind", "code", "facts"),
    [
        ({"rate_hz": 0}, UsageError, "out-of-range", {"argument": "rate_hz", "value": 0}),
        ({"rate_hz": float("inf")}, UsageError, "out-of-range", {"argument": "rate_hz", "value": float("inf")}),
        ({"rate_hz": float("nan")}, UsageError, "out-of-range", {"argument": "rate_hz"}),
        ({"block_samples": 0}, UsageError, "out-of-range", {"argument": "block_samples", "value": 0, "minimum": 1}),
        ({"time": "clock"}, RecordingError, "channel-unknown", {"argument": "time", "channel": "clock"}),
        ({"time": "input [rad]"}, RecordingError, "time-unit", {"channel": "input", "unit": "rad"}),
        ({"channels": ["nothing"]}, RecordingError, "channel-unknown", {"channel": "nothing"}),
    ],
)
def test_unsuitable_options_of_a_reader_are_refused(tmp_path, options, kind, code, facts):
    path = write("npz", tmp_path, signals())
    with refused(kind, code, **facts):
        drain(path, **options)


def test_a_channel_requested_twice_or_as_a_bare_string_is_refused(tmp_path):
    log = open_log(write("npz", tmp_path, signals()), rate_hz=1)
    with refused(UsageError, "duplicate", argument="channels", value="input"):
        log.blocks(["input", "input"])
    with refused(UsageError, "missing", argument="channels"):
        log.blocks([])
    with pytest.raises(TypeError, match="is not a list"):
        log.blocks("input")


def test_hdf5_without_its_library_names_the_extra(tmp_path, monkeypatch):
    path = write("hdf5", tmp_path, signals())
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(ExtraError) as caught:
        drain(path, rate_hz=1)
    assert (caught.value.code, caught.value.package) == ("extra.not-installed", "h5py")
    assert caught.value.remedy == f"run {install_command('hdf5')}"
