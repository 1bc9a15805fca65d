"""`python -m bench.dense_bound`: how near dense rows are to the memory's limit, and to Numba.

"memory" only reads the table of twiddle factors and writes the rows (bench/native/traffic.c): a yardstick of what
the memory takes, though a kernel that orders its accesses better can be faster.
"""

import argparse
from collections.abc import Callable

import numpy as np

from bench import native_build, numba_versions
from bench.work import ROWS, Array, side_by_side, signal
from livebode.kernel import SlidingDFT

CELLS = [(window, count) for window in (100, 200, 1000) for count in (7, 21)]


def traffic(window: int, count: int, out: Array) -> Callable[[], object]:
    """The memory's part of rows written to `out`."""
    rows, blocks = (window + 1) // 2 + 1, (count + 7) // 8
    table, written = np.ones((rows, blocks, 16)), np.empty(2 * out.size + 16)
    call = native_build.peers().dense_traffic
    return lambda: call(table.ctypes.data, rows, blocks, written.ctypes.data, len(out), count)


def measure(window: int, count: int, seconds: float) -> dict[str, float]:
    """Nanoseconds of a row."""
    bins, x, out = list(range(1, count + 1)), signal(window + ROWS - 1), np.empty((ROWS, count), complex)
    tasks: dict[str, Callable[[], object]] = {
        "numba complex": numba_versions.by_numba_complex(x, window, bins, 1),
        "numba planar": numba_versions.by_numba_planar(x, window, bins, 1),
        "memory": traffic(window, count, out),
    }
    for phase in ("window", "fixed"):
        dft = SlidingDFT(window, bins)
        tasks[phase] = lambda dft=dft, phase=phase: dft.process(x[:ROWS], 1, out, phase)  # type: ignore[misc]
    best = {name: 1e9 * time / ROWS for name, time in side_by_side(tasks, seconds).items()}
    return {"numba": min(best.pop("numba complex"), best.pop("numba planar")), **best}


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.dense_bound", description=__doc__)
    parser.add_argument("--seconds", type=float, default=1.0, help="duration per contender and cell")
    seconds = parser.parse_args().seconds
    native_build.build()
    print("| N, K | Numba, ns per row | window | fixed | memory | Numba / window | Numba / fixed | Numba / memory |")
    print("|---|---|---|---|---|---|---|---|")
    for window, count in CELLS:
        ns = measure(window, count, seconds)
        times = " | ".join(f"{ns[name]:.2f}" for name in ("numba", "window", "fixed", "memory"))
        ratios = " | ".join(f"{ns['numba'] / ns[name]:.2f}" for name in ("window", "fixed", "memory"))
        print(f"| {window}, {count} | {times} | {ratios} |", flush=True)


if __name__ == "__main__":
    main()
