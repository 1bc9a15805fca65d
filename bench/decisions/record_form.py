"""`livebode run` of a recording with its rows in one segment each, compared with the journal of a live run.

`python -m bench.decisions.record_form [ROUNDS]`: 60 s at 4 kHz as CSV, three channels, 12 lines. Both ways take turns;
processor time and memory are those of the whole command, bytes written those that it gave to the file system.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median

import numpy as np

from livebode.core import Lines
from livebode.excitation import multisine

RATE_HZ, SECONDS, WINDOW = 4000, 60, 400
LINES = Lines.parse("10,20,30,50,70,100,140,200,280,400,560,800", rate_hz=RATE_HZ, window=WINDOW)
LIVEBODE = str(Path(sys.executable).with_name("livebode"))
_BLOCK_BYTES = 512
WAYS = {"segments alone": [], "with a journal": ["--continue"]}


def write_log(path: Path) -> None:
    rng = np.random.default_rng(1)
    w = np.resize(multisine(LINES), RATE_HZ * SECONDS)
    u = w + 0.01 * rng.standard_normal(w.size)
    y = np.roll(np.convolve(w, np.exp(-np.arange(50) / 10) / 10)[: w.size], 1) + 0.01 * rng.standard_normal(w.size)
    table = np.column_stack([np.arange(w.size) / RATE_HZ, w, u, y])
    np.savetxt(path, table, "%.9g", ",", header="time_s,w,u,y", comments="")


def measure(log: Path, out: Path, options: list[str]) -> list[float]:
    """Processor time in s, peak of memory in MB, MB written, MB and number of the files of the record."""
    roles = ["--excitation", "w", "--output", "y", "--input", "u"]
    process = subprocess.Popen(
        [LIVEBODE, "run", log, *roles, "--out", out, *options], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, process.args)
    files = [path for path in out.rglob("*") if path.is_file() and path.suffix != ".png"]
    sizes = sum(path.stat().st_size for path in files)
    cpu_s = used.ru_utime + used.ru_stime
    return [cpu_s, used.ru_maxrss / 1024, used.ru_oublock * _BLOCK_BYTES / 1e6, sizes / 1e6, len(files)]


def main(rounds: int) -> None:
    found: dict[str, list[list[float]]] = {way: [] for way in WAYS}
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log.csv"
        write_log(log)
        for number in range(rounds):
            for way, options in WAYS.items():
                found[way].append(measure(log, Path(folder) / f"{way} {number}", options))
    print(f"{'':16}{'CPU s':>8}{'peak MB':>10}{'written MB':>12}{'record MB':>11}{'files':>7}")
    for way, figures in found.items():
        cpu_s, peak, written, record, files = (median(column) for column in zip(*figures))
        print(f"{way:16}{cpu_s:8.2f}{peak:10.0f}{written:12.1f}{record:11.2f}{files:7.0f}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if sys.argv[1:] else 5)
