"""Effect of renewal: the named variants after a long run and after a spike (float32 and float64)."""

import numpy as np

from livebode.kernel import SlidingDFT

WINDOW, BINS, SAMPLES = 200, [1, 7, 21, 60, 99], 10_000_000


def accuracy() -> dict[str, dict[str, float]]:
    """Error relative to √N·‖x‖₂ of the window at the end of the run, with or without an early spike of 1e6."""
    result: dict[str, dict[str, float]] = {}
    for dtype in ("float64", "float32"):
        for spike in (0.0, 1e6):
            x = np.random.default_rng(3).standard_normal(SAMPLES).astype(dtype)
            x[1000] += spike
            last = x[-WINDOW:].astype(float)
            for variant in ("modulated", "plain", "damped"):
                dft = SlidingDFT(WINDOW, BINS, dtype=dtype, variant=variant)
                dft.advance(x)
                error = np.abs(dft.spectrum() - np.fft.fft(last)[BINS]).max()
                name = f"{dtype}, {'a spike of 1e6' if spike else 'only noise'}"
                result.setdefault(name, {})[variant] = float(error / (np.sqrt(WINDOW) * np.linalg.norm(last)))
    for name, errors in result.items():
        print(f"  {name}: " + "  ".join(f"{variant} {error:.1e}" for variant, error in errors.items()))
    return result
