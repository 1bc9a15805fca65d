"""`python -m bench.dense_bound`: how near dense rows are to the memory's limit, and to Numba.

"memory" only reads the table of twiddle factors and writes the rows (bench/native/traffic.c): a yardstick of what
the memory takes, though a kernel that orders its accesses better can be faster.
"""

import argparse
from collections.abc import Callable

import numpy as np

from bench import dense_rows, native_build
from bench.work import ROWS, Array, signal

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
    return dense_rows.nanoseconds(x, window, bins, out, seconds, memory=traffic(window, count, out))


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
