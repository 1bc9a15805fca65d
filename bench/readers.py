"""Reading long recordings: throughput and memory by format, and CSV beside PyArrow's own streaming reader.

    python -m bench.readers [--megabytes 1000] [--only csv]

A recording of a time column and three channels at 4 kHz is written in each format, and then read block by block, as
`livebode run` reads it, in a process of its own. PyArrow reads the same CSV with the same columns as float64. Printed
are megabytes per second of processor time and of wall time, and the largest resident memory.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import csv, parquet

from livebode import open_log

RATE_HZ, ROWS, ROW_BYTES = 4000.0, 1 << 18, 32
TIME, CHANNELS = "t [s]", ("w", "u", "y")
MEMORY_MIB, CSV_SHARE = 300, 0.7


def pieces(rows: int) -> Iterator[dict[str, np.ndarray]]:
    """The recording, some rows at a time."""
    rng = np.random.default_rng(1)
    for first in range(0, rows, ROWS):
        count = min(ROWS, rows - first)
        noise = rng.standard_normal((3, count)).round(6)
        yield {TIME: np.arange(first, first + count) / RATE_HZ, **dict(zip(CHANNELS, noise, strict=True))}


def write_csv(path: Path, rows: int) -> None:
    table = [pa.table(piece) for piece in pieces(rows)]
    with csv.CSVWriter(path, table[0].schema) as writer:
        for piece in table:
            writer.write_table(piece)


def write_parquet(path: Path, rows: int) -> None:
    table = [pa.table(piece) for piece in pieces(rows)]
    with parquet.ParquetWriter(path, table[0].schema) as writer:
        for piece in table:
            writer.write_table(piece)


def write_mat(path: Path, rows: int) -> None:
    """MATLAB 5, which holds up to 2 GB; 7.3 is HDF5."""
    import scipy.io

    parts = list(pieces(rows))
    names = {TIME: "t"} | dict(zip(CHANNELS, CHANNELS, strict=True))
    whole = {to: np.concatenate([piece[name] for piece in parts])[:, np.newaxis] for name, to in names.items()}
    scipy.io.savemat(path, whole)


def write_hdf5(path: Path, rows: int) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        series = {name: file.create_dataset(name, rows, "f8", chunks=(ROWS,)) for name in ("t", *CHANNELS)}
        for number, piece in enumerate(pieces(rows)):
            for name, values in zip(series, piece.values(), strict=True):
                series[name][number * ROWS : number * ROWS + len(values)] = values


def write_tdms(path: Path, rows: int) -> None:
    import nptdms

    timing = {"wf_increment": 1 / RATE_HZ, "wf_start_offset": 0.0}
    with nptdms.TdmsWriter(path) as file:
        for piece in pieces(rows):
            file.write_segment([nptdms.ChannelObject("axis", name, piece[name], timing) for name in CHANNELS])


def write_mf4(path: Path, rows: int) -> None:
    import asammdf

    with asammdf.MDF(version="4.10") as file:
        for number, piece in enumerate(pieces(rows)):
            samples = [piece[name] for name in CHANNELS]
            if number:
                file.extend(0, [(piece[TIME], None), *((one, None) for one in samples)])
            else:
                signals = [asammdf.Signal(one, piece[TIME], name=name) for one, name in zip(samples, CHANNELS)]
                file.append(signals, common_timebase=True)
        file.save(path)


WRITERS: dict[str, Callable[[Path, int], None]] = {
    "csv": write_csv,
    "parquet": write_parquet,
    "mat": write_mat,
    "h5": write_hdf5,
    "tdms": write_tdms,
    "mf4": write_mf4,
}


def read(path: str) -> int:
    """Rows that livebode reads."""
    log = open_log(path)
    return sum(len(block) for block in log.blocks(CHANNELS))


def read_by_arrow(path: str, columns: Sequence[str] = (TIME, *CHANNELS)) -> int:
    """The same by PyArrow's streaming reader, as its documentation shows it."""
    options = csv.ConvertOptions(column_types=dict.fromkeys(columns, pa.float64()), include_columns=columns)
    with csv.open_csv(path, convert_options=options) as reader:
        return sum(len(batch) for batch in reader)


READERS: dict[str, Callable[[str], int]] = {
    "livebode": read,
    "PyArrow's own reader": read_by_arrow,
    "PyArrow's own reader, the time alone": lambda path: read_by_arrow(path, [TIME]),
}


def measured(reader: str, path: Path) -> tuple[float, float, float]:
    """Processor time and wall time of reading, seconds, and the largest memory, MiB, of a process of its own."""
    command = [sys.executable, "-m", "bench.readers", "--read", reader, str(path)]
    found = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    return float(found[0]), float(found[1]), float(found[2])


def one(reader: str, path: str) -> None:
    """In the process of its own."""
    began_s, began = time.perf_counter(), time.process_time()
    READERS[reader](path)
    # Of this program alone: getrusage has the peak of the process that started it too.
    (peak,) = (line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM"))
    peak_mib = int(peak.split()[1]) / 1024
    print(time.process_time() - began, time.perf_counter() - began_s, peak_mib)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m bench.readers", description=__doc__)
    parser.add_argument("--megabytes", type=float, default=1000.0, help="of the values as float64")
    parser.add_argument("--only", default="", help="format")
    parser.add_argument("--read", nargs=2, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.read:
        one(*asked.read)
        return
    rows = round(asked.megabytes * 1e6 / ROW_BYTES)
    print(f"{rows:,} rows of a time and {len(CHANNELS)} channels")
    print("| file | MB | MB/s of processor time | MB/s | memory, MiB |\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for kind, write in WRITERS.items():
            if asked.only and kind != asked.only:
                continue
            path = Path(folder) / f"long.{kind}"
            write(path, rows)
            size = path.stat().st_size / 1e6
            walls_s = {}
            for reader in READERS if kind == "csv" else ["livebode"]:
                spent_s, wall_s, peak = measured(reader, path)
                walls_s[reader] = wall_s
                name = kind if reader == "livebode" else f"{kind}, {reader}"
                verdict = "met" if peak <= MEMORY_MIB else "missed"
                about = f", target ≤ {MEMORY_MIB}: {verdict}" if reader == "livebode" else ""
                print(f"| {name} | {size:,.0f} | {size / spent_s:,.0f} | {size / wall_s:,.0f} | {peak:.0f}{about} |")
            if kind == "csv":
                share = walls_s["PyArrow's own reader"] / walls_s["livebode"]
                met = "met" if share >= CSV_SHARE else "missed"
                print(f"| csv, speed relative to PyArrow's | {share:.2f}, target ≥ {CSV_SHARE}: {met} | | | |")
            path.unlink()


if __name__ == "__main__":
    main()
