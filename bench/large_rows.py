"""`python -m bench.large_rows`: a row after every sample, into buffers up to several times the last-level cache.

Numba's version is the plain recursion, the faster of its two layouts (bench/numba_versions.py).
"""

import argparse

import numpy as np

from bench import dense_rows
from bench.work import signal

WINDOW = 1000
COUNTS = (7, 21, 51, 101, 201, 401)
MEGABYTES = (1, 8, 16, 53, 106)


def measure(count: int, megabytes: float, seconds: float) -> dict[str, float]:
    """Nanoseconds of a row, for both phases and for Numba."""
    bins, rows = list(range(1, count + 1)), int(megabytes * 1e6 / 16 / count)
    x = signal(WINDOW + rows - 1)
    out = np.empty((rows, count), complex)
    return dense_rows.nanoseconds(x, WINDOW, bins, out, seconds)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.large_rows", description=__doc__)
    parser.add_argument("--seconds", type=float, default=0.3, help="duration per contender and cell")
    seconds = parser.parse_args().seconds
    print("| lines | MB | Numba, ns per row | window, ns | Numba / window | fixed, ns | Numba / fixed |")
    print("|---|---|---|---|---|---|---|")
    for count in COUNTS:
        for megabytes in MEGABYTES:
            ns = measure(count, megabytes, seconds)
            window, fixed = (f"{ns[phase]:.1f} | {ns['numba'] / ns[phase]:.2f}" for phase in ("window", "fixed"))
            print(f"| {count} | {megabytes} | {ns['numba']:.1f} | {window} | {fixed} |", flush=True)


if __name__ == "__main__":
    main()
