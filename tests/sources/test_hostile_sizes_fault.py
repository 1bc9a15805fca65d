"""Files that declare what they do not have: refused or read within a gigabyte and a minute of the processor for all."""

from __future__ import annotations

import os
import random
import struct
import sys
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from tests.support.limited_reader import outcomes
from tests.support.recordings import OWN_RATE, signals, with_time, write

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the limits are those of Linux")
PLACES = int(os.environ.get("LIVEBODE_FUZZ_ROUNDS", "24"))
HUGE = (struct.pack("<I", 0x7FFFFFFF), struct.pack("<Q", 1 << 40), struct.pack("<d", 1e15))


def nested(path: Path, depth: int) -> Path:
    with h5py.File(path, "w") as file:
        group = file
        for _ in range(depth):
            group = group.create_group("g")
        group["x"] = np.arange(50.0)
    return path


def constant(path: Path, rows: int, own: bool) -> Path:
    """A column of one value, as Parquet encodes it in 215 bytes; with `own` it says that livebode wrote it."""
    options = {"compression": "none", "store_schema": False, "write_statistics": False}
    pq.write_table(pa.table({"u": np.zeros(rows)}), path, row_group_size=rows, max_rows_per_page=rows, **options)
    data = path.read_bytes()
    if own:
        size = struct.unpack("<I", data[-8:-4])[0]
        at = data.rindex(b"parquet-cpp-arrow")
        writer = data[at : at + data[at - 1]]
        footer = data[-8 - size : -8].replace(bytes([len(writer)]) + writer, b"\x08livebode")
        data = data[: -8 - size] + footer + struct.pack("<I", len(footer)) + b"PAR1"
    path.write_bytes(data)
    return path


def empty(path: Path, matlab: bool) -> Path:
    """A dataset of a terabyte of which nothing is in the file; with `matlab` as in a file of version 7.3."""
    with h5py.File(path, "w", userblock_size=512) as file:
        data = file.create_dataset("u", (1 << 37, 1), "f8", chunks=(1 << 16, 1), compression="gzip")
        data.attrs["MATLAB_class"] = np.bytes_("double")
    if matlab:
        head = b"MATLAB 7.3 MAT-file".ljust(116) + bytes(8) + b"\x00\x02IM"
        path.write_bytes(head + path.read_bytes()[128:])
    return path


def test_what_is_packed_or_nested_beyond_reason_is_refused(tmp_path: Path) -> None:
    packed = tmp_path / "bomb.npz"
    np.savez_compressed(packed, u=np.zeros(1 << 24))
    warm = [nested(tmp_path / "small.h5", 2), constant(tmp_path / "small.parquet", 1000, own=False)]
    warm += [nested(tmp_path / "small.mat", 2)]
    hostile = {
        nested(tmp_path / "deep.h5", 3000): "recording.too-large",
        constant(tmp_path / "own.parquet", 1 << 22, own=True): "recording.damaged",
        constant(tmp_path / "foreign.parquet", 1 << 22, own=False): "recording.damaged",
        empty(tmp_path / "empty.h5", matlab=False): "recording.channel-missing",
        empty(tmp_path / "empty.mat", matlab=True): "recording.channel-missing",
        packed: "read",
    }
    found = outcomes(list(hostile), warm, rate_hz=4000.0)
    assert found == {str(path): code for path, code in hostile.items()}


def test_a_huge_number_anywhere_in_a_file_takes_no_memory(tmp_path: Path) -> None:
    rng, paths, warm = random.Random(34), list[Path](), list[Path]()
    for module in ("arrow", "matlab", "matlab73", "mdf", "npz", "parquet", "svdx", "tdms", "wav"):
        folder = tmp_path / module
        folder.mkdir()
        whole = write(module, folder, signals(200) if module in OWN_RATE else with_time(signals(200)))
        data = whole.read_bytes()
        warm.append(whole)
        for number in range(PLACES):
            huge = HUGE[number % len(HUGE)]
            at = rng.randrange(0, len(data) - len(huge)) & ~3
            paths.append(folder / f"{number}{whole.suffix}")
            paths[-1].write_bytes(data[:at] + huge + data[at + len(huge) :])
    assert len(outcomes(paths, warm)) == len(paths)
