"""`python -m bench.dense_bound`: how near dense rows are to the memory's limit, and to Numba.

"memory" only reads the table of twiddle factors and writes the rows (bench/native/traffic.c): a yardstick of what
the memory takes, though a kernel that orders its accesses better can be faster. The
share of the bound is the time of "memory" over that of the kernel: 1 where arithmetic is hidden behind the accesses.
"""

import argparse
from collections.abc import Callable

import numpy as np

from bench import dense_rows, native_build
from bench.work import ROWS, Array, signal

TARGET = 3.0
AT_BOUND = 0.9  # share of the bound from which on arithmetic counts as hidden
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


def verdict(ns: dict[str, float]) -> str:
    """Of both phases: at least 3 × Numba, or as fast as the memory's part alone, or missed."""
    found = []
    for phase in ("window", "fixed"):
        reached = ns["numba"] / ns[phase] >= TARGET
        at_bound = ns["memory"] / ns[phase] >= AT_BOUND
        found.append("met" if reached else "bound reached" if at_bound else "missed")
    return ", ".join(found)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m bench.dense_bound", description=__doc__)
    parser.add_argument("--seconds", type=float, default=1.0, help="duration per contender and cell")
    seconds = parser.parse_args().seconds
    native_build.build()
    print(
        "| N, K | Numba, ns per row | window | fixed | memory | Numba / window | Numba / fixed | Numba / memory "
        "| share of the bound, window | fixed | target ≥ 3, or the bound |"
    )
    print("|---" * 11 + "|")
    for window, count in CELLS:
        ns = measure(window, count, seconds)
        times = " | ".join(f"{ns[name]:.2f}" for name in ("numba", "window", "fixed", "memory"))
        ratios = " | ".join(f"{ns['numba'] / ns[name]:.2f}" for name in ("window", "fixed", "memory"))
        shares = " | ".join(f"{ns['memory'] / ns[name]:.0%}" for name in ("window", "fixed"))
        print(f"| {window}, {count} | {times} | {ratios} | {shares} | {verdict(ns)} |", flush=True)


if __name__ == "__main__":
    main()
