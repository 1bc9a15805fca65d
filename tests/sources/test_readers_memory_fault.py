"""Long recordings and declared sizes: memory stays bounded, and what is too large is refused before it is read."""

from __future__ import annotations

import struct
import subprocess
import sys
import tracemalloc
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from livebode.core import RecordingError
from livebode_drives.recordings.safexml import parse
from tests.support.bad_recordings import drain, survives, text
from tests.support.errors import refused
from tests.support.recordings import WRITERS, open_log, signals, write

MEASURE = """
import sys
import pyarrow, pyarrow.csv, pyarrow.parquet, numpy, h5py, zipfile
import pandas  # which Arrow loads at the first conversion, where it is installed
from livebode.sources import open_log

def peak_kib():  # ru_maxrss would count what the parent held before it started this
    with open("/proc/self/status") as status:
        return next(int(line.split()[1]) for line in status if line.startswith("VmHWM"))

def blocks():
    return open_log(sys.argv[1]).blocks(["input", "output"])

before = peak_kib()
read = sum(len(block) for block in blocks())
let_go = peak_kib() - before
kept = list(blocks())
print(read, let_go // 1024, (peak_kib() - before) // 1024)
"""


def measured(path: Path) -> tuple[int, int, int]:
    """Samples read, and growth of the peak memory in MiB with the blocks let go, and then with all of them kept."""
    done = subprocess.run([sys.executable, "-c", MEASURE, str(path)], capture_output=True, text=True, check=True)
    read, let_go, kept = map(int, done.stdout.split())
    return read, let_go, kept


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
    read, grown_mib, kept_mib = measured(path)  # kept: what the measure shows where nothing is let go
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
