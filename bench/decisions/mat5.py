"""Damaged MATLAB v5 files: checked before SciPy reads them, or read by SciPy in a process with limited memory.

`python -m bench.decisions.mat5 [FILES]` damages a file in so many ways (Linux: it forks a process for each).
"""

from __future__ import annotations

import multiprocessing
import os
import resource
import struct
import sys
import tempfile
import time
import warnings
import zlib
from collections import Counter
from collections.abc import Callable
from itertools import pairwise
from multiprocessing.connection import Connection
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io

from livebode.core import RecordingError
from livebode.sources import open_log
from livebode.sources.mat5check import list_variables

LIMIT = 1 << 30
"""Memory of a reading process beyond that of the parent, bytes."""
MEGABYTES = 80


def contents() -> dict[str, Any]:
    rng = np.random.default_rng(0)
    return {
        "t": np.arange(500) / 1000, "u": rng.standard_normal(500), "k": np.arange(500, dtype=np.int16),
        "name": "axis 1", "s": {"y": rng.standard_normal(500), "unit": "rad/s", "gain": 2.0},
        "c": np.array(["a", 1.0], dtype=object),
    }  # fmt: skip


def damaged(whole: bytes, rng: np.random.Generator) -> bytes:
    """The file with a bit flipped, a size enlarged, or its end missing; never in the text of its header."""
    raw, at = bytearray(whole), int(rng.integers(128, len(whole) - 8))
    what = rng.integers(4)
    if what == 0:
        raw[at] ^= 1 << int(rng.integers(8))
    elif what == 1:
        at -= at % 8
        raw[at + 4 : at + 8] = rng.choice([b"\xff\xff\xff\x7f", b"\0\0\0\x40", b"\xff\xff\xff\xff"])
    elif what == 2:
        raw[at - at % 8] = int(rng.integers(256))
    else:
        del raw[at:]
    return bytes(raw)


def packed(plain: bytes, ends: list[int]) -> bytes:
    """The file with its elements, which end there, compressed: what a sender that means harm writes."""
    elements = [zlib.compress(plain[begin:end]) for begin, end in pairwise([128, *ends])]
    return plain[:128] + b"".join(struct.pack("<II", 15, len(element)) + element for element in elements)


def element_ends(whole: bytes) -> list[int]:
    ends, at = [], 128
    while at < len(whole):
        at += 8 + struct.unpack_from("<I", whole, at + 4)[0]
        ends.append(at)
    return ends


def checked(path: Path) -> None:
    for _ in open_log(path, rate_hz=1000.0).blocks():
        pass


def by_scipy(path: Path) -> None:
    free = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (free + LIMIT, free + LIMIT))
    for name, value in scipy.io.loadmat(path).items():
        np.array(value, copy=True) if not name.startswith("__") else None


def outcome(read: Callable[[Path], None], path: Path) -> tuple[str, float]:
    """How it ended in a process of its own, and the memory of that process in MB."""
    if (child := os.fork()) == 0:
        warnings.simplefilter("ignore")
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        try:
            read(path)
        except RecordingError:
            os._exit(1)
        except MemoryError:
            os._exit(2)
        except Exception:
            os._exit(3)
        os._exit(0)
    _, status, used = os.wait4(child, 0)
    names = {0: "read", 1: "refused", 2: "memory limit", 3: "another exception"}
    return ("killed by a signal" if os.WIFSIGNALED(status) else names[os.WEXITSTATUS(status)]), used.ru_maxrss / 1024


def campaign(folder: Path, files: int) -> None:
    scipy.io.savemat(folder / "whole.mat", contents())
    whole = (folder / "whole.mat").read_bytes()
    for name, compressed in (("plain", False), ("damaged, then compressed", True)):
        found: dict[Callable[[Path], None], Counter[str]] = {checked: Counter(), by_scipy: Counter()}
        base = outcome(lambda _: None, folder)[1]
        most = dict.fromkeys(found, 0.0)
        rng = np.random.default_rng(1)
        for _ in range(files):
            bad = damaged(whole, rng)
            (folder / "a.mat").write_bytes(packed(bad, element_ends(whole)) if compressed else bad)
            for read, counts in found.items():
                how, used = outcome(read, folder / "a.mat")
                counts[how] += 1
                most[read] = max(most[read], used - base)
        for read, counts in found.items():
            label = "checked, then SciPy" if read is checked else "SciPy, limited to 1 GiB"
            print(f"  {name}, {label}: {dict(counts.most_common())}, at most {most[read]:.0f} MB")


def _send(connection: Connection, path: str) -> None:
    connection.send(scipy.io.loadmat(path)["x"])


def _share(connection: Connection, path: str) -> None:
    values = scipy.io.loadmat(path)["x"]
    memory = SharedMemory(create=True, size=values.nbytes)
    np.ndarray(values.shape, values.dtype, buffer=memory.buf)[:] = values
    connection.send((memory.name, values.shape, values.dtype.str))
    connection.recv()
    memory.close()


def through(target: Callable[[Connection, str], None], path: Path) -> float:
    """Processor seconds until an array of the file is here, read by a process that is started for it."""
    began = processor_s()
    ours, theirs = multiprocessing.get_context("spawn").Pipe()
    process = multiprocessing.get_context("spawn").Process(target=target, args=(theirs, str(path)))
    process.start()
    got = ours.recv()
    if target is _share:
        memory = SharedMemory(got[0])
        np.ndarray(got[1], got[2], buffer=memory.buf).copy()
        memory.close()
        memory.unlink()
        ours.send(None)
    process.join()
    return processor_s() - began


def processor_s() -> float:
    """Of this process and of those that it has waited for."""
    return sum(os.times()[:4])


def costs(folder: Path) -> None:
    values = np.random.default_rng(2).standard_normal((MEGABYTES * 125_000, 1))
    for label, data in (("one sample", values[:1]), (f"{MEGABYTES} MB", values)):
        path = folder / "b.mat"
        scipy.io.savemat(path, {"x": data})
        began = time.process_time()
        list_variables(path)
        check = time.process_time() - began
        began = time.process_time()
        scipy.io.loadmat(path)
        load = time.process_time() - began
        print(f"  {label}: check {check:.3f} s, SciPy in this process {load:.3f} s, in a process of its own "
              f"{through(_send, path):.2f} s by pipe, {through(_share, path):.2f} s by shared memory")  # fmt: skip


def main() -> None:
    files = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    with tempfile.TemporaryDirectory() as folder:
        print(f"{files} damaged files of each kind")
        campaign(Path(folder), files)
        print("processor time")
        costs(Path(folder))


if __name__ == "__main__":
    main()
