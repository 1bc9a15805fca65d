"""`python -m bench.full_spectrum`: all N/2 + 1 bins at a hop, by the kernel and by an FFT of every window.

The FFT is scipy.fft.rfft (pocketfft) over a strided view, in parts that fit into the cache.
"""

import argparse

import numpy as np
import scipy.fft

from bench.work import Array, side_by_side, signal
from livebode.kernel import SlidingDFT, fft_is_cheaper, own_hop

WINDOWS = (128, 400, 1024, 4096)
HOPS = (1, 2, 5, 10, 20, 50, 100, 200)
ROWS = 256


def measure(window: int, hop: int, seconds: float) -> dict[str, float]:
    """Microseconds of a row, by the kernel and by FFT, and the largest difference relative to √N·‖x‖₂."""
    x, bins = signal(window + hop * (ROWS - 1)), list(range(window // 2 + 1))
    views = np.lib.stride_tricks.sliding_window_view(x, window)[::hop]
    dft, out = SlidingDFT(window, bins, hop=own_hop(window, hop)), np.empty((ROWS, len(bins)), complex)
    lead = x[: window - hop]

    def by_kernel() -> Array:
        return dft.process(x[window - hop :], hop, out)

    def by_fft() -> Array:
        spectra: Array = scipy.fft.rfft(views, axis=1)
        return spectra

    dft.advance(np.zeros((-len(lead)) % hop))  # rows are due where the windows of the views end
    dft.advance(lead)
    difference = np.abs(by_kernel() - by_fft()).max() / (np.sqrt(window) * np.linalg.norm(x[:window]))
    best = side_by_side({"kernel": by_kernel, "FFT": by_fft}, seconds)
    return {name: 1e6 * time / ROWS for name, time in best.items()} | {"difference": float(difference)}


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.full_spectrum", description=__doc__)
    parser.add_argument("--seconds", type=float, default=0.1, help="duration per contender and cell")
    seconds = parser.parse_args().seconds
    print("| N | hop | kernel, µs per row | FFT, µs | kernel / FFT | HoppingDFT takes | difference |")
    print("|---|---|---|---|---|---|---|")
    for window in WINDOWS:
        for hop in HOPS:
            if hop <= window // 4:
                us = measure(window, hop, seconds)
                ratio = us["kernel"] / us["FFT"]
                taken = "FFT" if fft_is_cheaper(window, window // 2 + 1, hop) else "kernel"
                times = f"{us['kernel']:.2f} | {us['FFT']:.2f} | {ratio:.2f} | {taken} | {us['difference']:.1e}"
                print(f"| {window} | {hop} | {times} |", flush=True)


if __name__ == "__main__":
    main()
