"""Bad files: one clear sentence with its remedy, never another exception, and bounded memory."""

from __future__ import annotations

import errno
import json
import os
import random
import re
import struct
import subprocess
import sys
import tracemalloc
import zipfile
from functools import partial
from pathlib import Path

import can
import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import scipy.io
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from livebode.core import ExtraError, LivebodeError, RecordingError, UsageError
from livebode.core.installing import install_command
from livebode.sources import sinumerik_spectra
from livebode.sources.safexml import parse
from tests.support.errors import refused
from tests.support.recordings import (
    DBC,
    OWN_RATE,
    WRITERS,
    Mf4Writer,
    dspace,
    open_log,
    signals,
    with_time,
    write,
    write_dspace73,
    write_frames,
)

MODULES = sorted(WRITERS)
MAY_END_ANYWHERE = "asc", "codesys", "delimited", "lvm", "twincat", "ulog"
"""A table may end after any row, and a flight recorder when its battery is removed."""
ROUNDS = int(os.environ.get("LIVEBODE_FUZZ_ROUNDS", "150"))
"""Damaged files of each kind; raise it for a campaign."""
SLOW = "asc", "blf", "blf_plain", "mcap", "mdf", "mdf_frames", "rosbag", "ulog"
"""Kinds whose libraries take some milliseconds for a file: a third of the rounds."""


def drain(path: Path, **options: object) -> None:
    log = open_log(path, **options)
    assert log.skipped is not None
    assert log.aliases is not None
    for _ in log.blocks():
        pass


def refusal(path: Path, **options: object) -> LivebodeError:
    """The error of a file that cannot be read, in one line that names it."""
    with pytest.raises(RecordingError) as caught:
        drain(path, **options)
    assert "\n" not in str(caught.value)
    assert caught.value.path == str(path)
    assert str(path) in str(caught.value)
    return caught.value


def survives(path: Path, **options: object) -> bool:
    """True where the file could be read, False where it was refused in one line; anything else fails the test."""
    message = ""
    try:
        drain(path, **options)
    except RecordingError as error:
        message = str(error)
        json.dumps(error.as_dict())  # its facts are plain data
    assert "\n" not in message
    return not message


def text(folder: Path, content: str | bytes, name: str = "log.csv") -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


@pytest.mark.parametrize(
    ("content", "code", "facts"),
    [
        ("t,u\n0,1\n0.1,abc\n0.2,3\n", "cell-not-a-number", {"line": 3, "channel": "u", "value": "abc"}),
        ("# x\n\nt,u\n0,1\n0.1,1\n0.2,3,4\n", "line-ragged", {"line": 6, "cells": 3, "columns": 2}),
        ("t,u\n0,1\n0.1,1\n0.2,3\n0.3", "line-ragged", {"line": 5, "cells": 1, "columns": 2}),
        ("t,u,u\n0,1,2\n0.1,1,2\n", "channel-duplicated", {"channel": "u", "columns": [2, 3]}),
        ("t,u\n", "table-missing", {"beginning": "t,u"}),
        ("\n\n", "table-missing", {}),
        ("just some prose\nand more of it\n", "table-missing", {}),
        (b"t,u\n\x00\x01\x02", "format-unknown", {"suffix": ".csv"}),
        (b"t,u\n" + b"0,1\n" * 1000 + b"\x00\x00", "format-unknown", {}),
        (bytes(range(256)) * 8, "format-unknown", {"suffix": ".csv", "beginning": "0001020304050607"}),
        ("1" * 300_000, "line-too-long", {"line": 1, "limit_bytes": 1 << 18}),
        ("", "empty", {}),
        ("t;u\n0;1.234,5\n1;2.345,6\n", "channel-missing", {}),
    ],
)
def test_unreadable_tables_are_refused_with_their_reason(tmp_path, content, code, facts):
    path = text(tmp_path, content)
    with refused(RecordingError, code, path=str(path), **facts):
        drain(path)


def test_a_table_without_channels_names_what_was_left_out(tmp_path):
    assert "('u': it contains text)" in str(refusal(text(tmp_path, "t;u\n0;1.234,5\n1;2.345,6\n")))


def test_text_far_down_is_found_with_its_line(tmp_path):
    lines = [f"{k / 1000},{k}" for k in range(200_000)]
    lines[150_000] = "150.0,1.2.3"
    with refused(RecordingError, "cell-not-a-number", line=150_002, value="1.2.3"):
        drain(text(tmp_path, "t,u\n" + "\n".join(lines)))


def test_a_ragged_row_with_invalid_utf8_is_refused(tmp_path):
    rows = "".join(f"{k},1\n" for k in range(100_000)).encode()
    with refused(RecordingError, "line-ragged", line=100_002):
        drain(text(tmp_path, b"t,u\n" + rows + b"\xff\xfe,1,2\n"), rate_hz=1)


def test_an_overlong_line_is_refused_with_its_number(tmp_path):
    rows = "".join(f"{k},1\n" for k in range(100_000))
    with refused(RecordingError, "line-too-long", line=100_002, limit_bytes=1 << 20):
        drain(text(tmp_path, f"t,u\n{rows}1,{'2' * 9_000_000}\n"), rate_hz=1)


SLOW_READ = """
#define _GNU_SOURCE
#include <dlfcn.h>
#include <time.h>
#include <unistd.h>
ssize_t read(int file, void *into, size_t size) {
    ssize_t (*real)(int, void *, size_t) = (ssize_t (*)(int, void *, size_t))dlsym(RTLD_NEXT, "read");
    struct timespec delay = {0, size < 1000000 ? 0 : 50000000};
    nanosleep(&delay, 0);
    return real(file, into, size);
}
"""

READ_ANOTHER_FILE_AFTER_THE_FIRST_ROWS = """
import sys
from pathlib import Path
from livebode.sources.delimited import DelimitedRecording
recording = DelimitedRecording(Path(sys.argv[1]))
chunks = recording.chunks(recording.columns, 1000)
next(chunks)
chunks.close()
with Path(sys.argv[1]).open("rb") as another:
    read = another.read()
sys.exit(len(read) != Path(sys.argv[1]).stat().st_size)
"""


def test_a_recording_left_early_takes_no_bytes_from_the_file_opened_next(tmp_path):
    """On a disk of 50 ms a read, threads that read ahead would still do so when the recording is closed."""
    recording = text(tmp_path, "t,u\n" + "".join(f"{k},1\n" for k in range(400_000)))
    (tmp_path / "slow.c").write_text(SLOW_READ)
    subprocess.run(["gcc", "-shared", "-fPIC", "slow.c", "-o", "slow.so", "-ldl"], cwd=tmp_path, check=True)
    finished = subprocess.run(
        [sys.executable, "-c", READ_ANOTHER_FILE_AFTER_THE_FIRST_ROWS, str(recording)],
        env={**os.environ, "LD_PRELOAD": str(tmp_path / "slow.so")},
        capture_output=True,
        text=True,
    )
    assert (finished.returncode, finished.stderr) == (0, "")


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


@pytest.mark.parametrize("module", MODULES)
def test_a_file_truncated_anywhere_is_read_or_refused(module, tmp_path):
    given = signals(200) if module in OWN_RATE else with_time(signals(200))
    whole = write(module, tmp_path, given).read_bytes()
    for keep in range(1, len(whole) - 3, max(1, len(whole) // 40)):
        path = text(tmp_path, whole[:keep], f"cut{Path(WRITERS[module][0]).suffix}")
        assert not survives(path) or module in MAY_END_ANYWHERE


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


@settings(max_examples=ROUNDS, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.binary(max_size=600),
    st.sampled_from(
        [
            "",
            "PAR1",
            "ARROW1\0\0",
            "PK\x03\x04",
            "<",
            "t,u\n0,1\n",
            "#t,u\n0,1\n",
            "\ufeff",
            "Name\tscope\nFile\tx\nName\tu\n0\t1\n",
            "LabVIEW Measurement\nX_Value\tu\n0\t1\n",
            "\x14" + 19 * "\0",
            "[key]; [value]\n0.Variable; u\n0.Data; \n; 0; 1\n; 1; 2\n",
        ]
    ),
)
def test_any_bytes_are_read_or_refused(tmp_path, content, head):
    path = text(tmp_path, head.encode() + content, "log.csv")
    survives(path, rate_hz=1000)


def damaged(whole: bytes, rng: random.Random) -> bytes:
    """The file with bytes changed, sizes blown up, pieces lost or put in, the end cut off."""
    raw = bytearray(whole)
    for _ in range(rng.choice([1, 1, 2, 3, 8, 30])):
        at = rng.randrange(len(raw)) if raw else 0
        what = rng.randrange(5)
        if what == 0:
            raw[at : at + 1] = rng.randbytes(1)
        elif what == 1 and raw:
            raw[at] ^= 1 << rng.randrange(8)
        elif what == 2:
            raw[at : at + 4] = rng.choice([b"\xff\xff\xff\xff", b"\xff\xff\xff\x7f", b"\0\0\0\0"])
        elif what == 3:
            del raw[at : at + rng.randrange(1, 16)]
        else:
            raw[at:at] = rng.randbytes(rng.randrange(1, 8))
    return bytes(raw[: rng.randrange(len(raw))]) if raw and rng.random() < 0.15 else bytes(raw)


def seeds(module: str, folder: Path) -> bytes:
    if module == "struct":
        scipy.io.savemat(folder / "a.mat", dspace(50))
        return (folder / "a.mat").read_bytes()
    if module == "struct73":
        write_dspace73(folder / "a.mat", 50)
        return (folder / "a.mat").read_bytes()
    if module == "mdf_frames":
        write_frames(Mf4Writer, folder / "log.mf4", with_time(signals(50)))
        return (folder / "log.mf4").read_bytes()
    if module == "blf_plain":  # damage reaches the frames
        write_frames(partial(can.BLFWriter, compression_level=0), folder / "log.blf", with_time(signals(50)))
        return (folder / "log.blf").read_bytes()
    return write(module, folder, signals(50) if module in OWN_RATE else with_time(signals(50))).read_bytes()


@pytest.mark.parametrize("module", [*MODULES, "struct", "struct73", "blf_plain", "mdf_frames"])
def test_damaged_files_are_read_or_refused(module, tmp_path):
    whole = seeds(module, tmp_path)
    for round_ in range(ROUNDS // 3 if module in SLOW else ROUNDS):
        rng = random.Random(f"{module} {round_}")
        path = text(tmp_path, damaged(whole, rng) or b"x", "damaged.bin")
        survives(path, rate_hz=rng.choice([None, 4000.0]), time=rng.choice([None, "none"]))


@pytest.mark.parametrize(("module", "rounds"), [("mdf", (625, 805, 980, 1494)), ("ulog", (3, 13, 104, 157))])
def test_libraries_print_nothing_about_damaged_files(module, rounds, tmp_path, capsys):
    """asammdf and pyulog printed what they had found in these; standard output is still that of the process."""
    whole, output = seeds(module, tmp_path), sys.stdout
    for round_ in rounds:
        path = text(tmp_path, damaged(whole, random.Random(f"{module} {round_}")), "damaged.bin")
        survives(path, rate_hz=4000)
        assert sys.stdout is output
    assert capsys.readouterr() == ("", "")


def test_damaged_dbc_files_are_read_or_refused(tmp_path):
    path = write("blf", tmp_path, with_time(signals(20)))
    whole = (tmp_path / DBC).read_bytes()
    for round_ in range(ROUNDS // 3):
        rng = random.Random(f"dbc {round_}")
        raw = damaged(whole, rng) or b"x"
        at = rng.choice([match.start() for match in re.finditer(rb"\d", raw)] or [0])
        (tmp_path / DBC).write_bytes(raw[:at] + rng.choice([b"", b"", b"99", b"4000000000"]) + raw[at:])
        survives(path)


MEASURE = """
import sys
import pyarrow, pyarrow.csv, pyarrow.parquet, numpy, h5py, zipfile
import pandas  # which Arrow loads at the first conversion, where it is installed
from livebode.sources import open_log

def peak_kib():  # ru_maxrss would count what the parent held before it started this
    with open("/proc/self/status") as status:
        return next(int(line.split()[1]) for line in status if line.startswith("VmHWM"))

before = peak_kib()
blocks = open_log(sys.argv[1]).blocks(["input", "output"])
blocks = list(blocks) if sys.argv[2] == "kept" else blocks
print(sum(len(block) for block in blocks), (peak_kib() - before) // 1024)
"""


def measured(path: Path, how: str) -> tuple[int, int]:
    """Samples read and growth of the peak memory in MiB, with the blocks let go or kept."""
    command = [sys.executable, "-c", MEASURE, str(path), how]
    read, grown = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    return int(read), int(grown)


def write_large(module: str, path: Path, samples: int) -> None:
    """Some 200 MB, constant signals so that writing is quick."""
    time = np.arange(samples) / 4000
    if module == "delimited":
        lines = "".join(f"{k / 4000:.5f},0.12345678901,-1.2345678901\n" for k in range(4000))
        with path.open("w") as file:
            file.write("t,input,output\n")
            for second in range(samples // 4000):
                file.write(
                    lines
                    if second == 0
                    else lines.replace("\n0.", f"\n{second}.").replace("0.00000", f"{second}.00000", 1)
                )
        return
    data = {"t": time, "input": np.full(samples, 0.5), "output": np.full(samples, 0.25)}
    if module == "parquet":
        pq.write_table(pa.table(data), path, row_group_size=1 << 20, use_dictionary=False)
    elif module == "arrow":
        table = pa.table(data)
        with pa.OSFile(str(path), "wb") as file, pa.ipc.new_file(file, table.schema) as writer:
            writer.write_table(table, max_chunksize=1 << 17)
    elif module == "npz":
        np.savez(path, **data)
    elif module == "hdf5":
        with h5py.File(path, "w") as file:
            for name, values in data.items():
                file[name] = values


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the peak memory is read from /proc")
@pytest.mark.parametrize("module", ["delimited", "parquet", "arrow", "npz", "hdf5"])
def test_memory_stays_bounded_whatever_the_length(module, tmp_path):
    path = tmp_path / f"large{WRITERS[module][0]}"
    samples = 6_000_000 if module != "delimited" else 4_000_000
    write_large(module, path, samples)
    read, grown_mib = measured(path, "let go")
    kept_mib = measured(path, "kept")[1]  # what the measure shows where nothing is let go
    assert read == samples
    assert kept_mib > samples * 16 / 2**20
    assert grown_mib < kept_mib - samples * 8 / 2**20
    assert grown_mib < 128


def test_memory_of_a_long_wav_file_is_that_of_a_block(tmp_path):
    path = write("wav", tmp_path, signals(2))
    frames = 3_000_000
    with path.open("r+b") as file:  # two channels of eight bytes, zeros that the disk does not store
        at = file.read().index(b"data") + 4
        file.seek(at)
        file.write(struct.pack("<I", frames * 16))
        file.truncate(at + 4 + frames * 16)
    tracemalloc.start()
    read = sum(len(block) for block in open_log(path).blocks())
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert read == frames
    assert peak < frames * 16 / 4


def test_a_scope_project_is_read_in_pieces_and_hostile_sizes_are_refused(tmp_path):
    peaks = []
    for samples in (150_000, 450_000):
        path = write("svdx", tmp_path, signals(samples))
        tracemalloc.start()
        read = sum(len(block) for block in open_log(path).blocks(["input"], 4096))
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert read == samples
    assert peaks[1] < 1.1 * peaks[0]
    whole = write("svdx", tmp_path, signals(40)).read_bytes()
    at = 20 + 2 * 20 + 67 + 2 * 56 + 8  # behind the table, the head and levels of the first acquisition, and a time
    assert whole[at : at + 8] == struct.pack("<Q", 16)
    for wrong in (0, 17, 1 << 40, (1 << 64) - 1):
        raw = whole[:at] + struct.pack("<Q", wrong) + whole[at + 8 :]
        with refused(RecordingError, "damaged"):
            drain(text(tmp_path, raw, "a.svdx"))
    for first, wrong in ((0, 1 << 40), (8, 1 << 63), (20, 1 << 50), (28, 1 << 50)):
        raw = whole[:first] + struct.pack("<Q", wrong) + whole[first + 8 :]
        assert not survives(text(tmp_path, raw, "b.svdx"))


@pytest.mark.parametrize("long", ['<a b="{}"/>', "<a><!-- {} --></a>", "<{}/>", "<a><?b {}?></a>"])
def test_xml_with_one_long_tag_is_refused_after_its_first_part(tmp_path, long):
    """The parser would read all of it again with every piece: quadratic in its length."""
    path = tmp_path / "a.xml"
    with path.open("w") as file:
        file.write(long.split("{}")[0])
        file.truncate(200 << 20)  # what follows is not even read
        file.write("x" * (2 << 20))
    with refused(RecordingError, "too-large", limit=1 << 20):
        drain(path)


def test_xml_with_much_text_is_read(tmp_path):
    """Long text is no token: a record of a control is one."""
    path = text(tmp_path, f"<a>{'x' * (4 << 20)}<b/></a>", "a.xml")
    assert len(parse(path).text) == 4 << 20


def test_a_program_that_ends_while_a_table_is_read_ahead_ends_as_it_would_without(tmp_path: Path) -> None:
    rows = "".join(f"{at:.6f},{at % 7},{at % 11}\n" for at in range(100_000))
    (tmp_path / "log.csv").write_text("t,w,y\n" + 15 * rows)
    program = (
        "from livebode.sources import open_log\nblocks = open_log('log.csv', rate_hz=4000, time='none').blocks(['w'])\n"
    )
    for _ in range(3):
        ended = subprocess.run([sys.executable, "-c", f"{program}next(blocks)"], cwd=tmp_path, stderr=subprocess.PIPE)
        assert (ended.returncode, ended.stderr) == (0, b"")
