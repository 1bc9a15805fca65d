"""`python -m bench.hop_rows`: nanoseconds of a row at a hop, by the kernel with that hop and others, side by side.

"any sample" is the same kernel without a hop of its own; Numba is the faster of two plain recursions
(bench/numba_versions.py); FFT is scipy.fft.rfft of every window. Errors of the kernel are relative to √N·‖x‖₂ of the
window, against sums in extended precision whose angles are reduced as integers.
"""

import argparse
from collections.abc import Callable

import numpy as np

from bench import contenders, numba_versions
from bench.work import side_by_side, signal
from livebode.kernel import SlidingDFT, own_hop

WINDOWS, COUNTS = (1000, 4000, 8000), (7, 21, 101)
SAMPLES = 40_000
BOUND = 5e-15


def error(window: int, bins: list[int], hop: int) -> float:
    """The largest of three rows, the last of them after some renewals."""
    x, worst = signal(4 * window), 0.0
    rows = SlidingDFT(window, bins, hop=own_hop(window, hop)).process(x, hop, phase="fixed")
    turn = 2 * np.arctan2(np.longdouble(0), np.longdouble(-1)) / window
    for row in {window // hop, len(rows) // 2, len(rows) - 1}:
        samples = np.arange((row + 1) * hop - window, (row + 1) * hop)
        angle = turn * (np.outer(bins, samples) % window).astype(np.longdouble)
        part = x[samples].astype(np.longdouble)
        difference = np.hypot(np.cos(angle) @ part - rows[row].real, -(np.sin(angle) @ part) - rows[row].imag)
        worst = max(worst, float(difference.max()) / np.sqrt(window) / float(np.linalg.norm(x[samples])))
    return worst


def measure(window: int, count: int, hop: int, seconds: float) -> dict[str, float]:
    """Nanoseconds of a row."""
    bins, rows = list(range(1, count + 1)), SAMPLES // hop
    x, long = signal(rows * hop), signal(window + hop * (rows - 1))
    tasks: dict[str, Callable[[], object]] = {
        "numba complex": numba_versions.by_numba_complex(long, window, bins, hop),
        "numba planar": numba_versions.by_numba_planar(long, window, bins, hop),
        "FFT": contenders.by_rfft(long, window, bins, hop),
    }
    for name, own in (("hop", own_hop(window, hop)), ("any sample", None)):
        dft, out = SlidingDFT(window, bins, hop=own), np.empty((rows, count), complex)
        tasks[name] = lambda dft=dft, out=out: dft.process(x, hop, out, "fixed")  # type: ignore[misc]
    best = {name: 1e9 * time / rows for name, time in side_by_side(tasks, seconds).items()}
    return {"Numba": min(best.pop("numba complex"), best.pop("numba planar")), **best}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m bench.hop_rows", description=__doc__)
    parser.add_argument("--seconds", type=float, default=0.3, help="duration per contender and cell")
    seconds = parser.parse_args().seconds
    print(
        "| N, K, hop | kernel, ns per row | any sample | Numba | FFT | any sample / kernel | Numba / kernel | error |"
    )
    print("|---" * 8 + "|")
    worst = 0.0
    for window in WINDOWS:
        for count in COUNTS:
            for hop in (20, 100, window // 4):
                ns, found = measure(window, count, hop, seconds), error(window, list(range(1, count + 1)), hop)
                times = " | ".join(f"{ns[name]:.0f}" for name in ("hop", "any sample", "Numba", "FFT"))
                ratios = " | ".join(f"{ns[name] / ns['hop']:.2f}" for name in ("any sample", "Numba"))
                print(f"| {window}, {count}, {hop} | {times} | {ratios} | {found:.1e} |", flush=True)
                worst = max(worst, found)
    print(f"largest error {worst:.1e}, bound {BOUND:.0e}: {'met' if worst <= BOUND else 'missed'}")


if __name__ == "__main__":
    main()
