"""The error relative to numpy.fft of the last N samples over a very long run; it must not grow."""

import time

import numpy as np

from bench.work import Array
from livebode.kernel import SlidingDFT

WINDOW, BINS, BLOCK = 200, [1, 7, 21, 60, 99], 1_000_000
BOUND = {"float64": 5e-15, "float32": 1e-6}


def relative_error(dft: SlidingDFT, last: Array) -> float:
    last = last.astype(np.float64)
    scale = np.sqrt(WINDOW) * np.linalg.norm(last)
    return float(np.abs(dft.spectrum() - np.fft.fft(last)[BINS]).max() / scale)


def long_run(samples: int) -> dict[str, dict[str, float]]:
    """The largest error in each decade, float32 and float64, on noise with an offset of 100."""
    result: dict[str, dict[str, float]] = {}
    for dtype in BOUND:
        # A block that is not a multiple of the window ends at a different phase of the period each time.
        x = (100 + np.random.default_rng(7).standard_normal(BLOCK - 1)).astype(dtype)
        dft, worst, decade, started = SlidingDFT(WINDOW, BINS, dtype=dtype), 0.0, 10**5, time.perf_counter()
        found: dict[str, float] = {}
        dft.advance(x[: 10**5])
        worst = relative_error(dft, x[10**5 - WINDOW : 10**5])
        dft.advance(x[10**5 :])
        while True:
            if dft.count >= decade:
                found[f"{decade:.0e}"] = worst
                print(f"  {dtype} {decade:.0e} samples: {worst:.2e} (bound {BOUND[dtype]:.0e})", flush=True)
                worst, decade = 0.0, 10 * decade
            if decade > samples:
                break
            for _ in range(max(1, min(100, (decade - dft.count) // BLOCK))):
                dft.advance(x)
            worst = max(worst, relative_error(dft, x[-WINDOW:]))
        result[dtype] = found
        print(f"  {dtype}: {dft.count} samples in {time.perf_counter() - started:.0f} s", flush=True)
    return result
