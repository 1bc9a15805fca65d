"""Dense blocks and blocks at a hop, compared with all contenders."""

from typing import Any

import numpy as np

from bench import contenders, numba_versions
from bench.work import CELLS, HOP, ROWS, Array, side_by_side, signal
from livebode.kernel import SlidingDFT, own_hop

FAST = {
    "fastgoertzel": contenders.by_fastgoertzel,
    "numba complex": numba_versions.by_numba_complex,
    "numba planar": numba_versions.by_numba_planar,
}
# Measured on fewer rows: some create arrays of every bin at every sample.
SLOW_ROWS = 512
SLOW = {
    "numpy cumsum": contenders.by_cumsum,
    "sdft": contenders.by_sdft,
    "ShortTimeFFT": contenders.by_stft,
    "sliding rfft": contenders.by_rfft,
}


class Ours:
    """A continuous stream: each call processes the next ROWS·hop samples into the same buffer."""

    def __init__(self, window: int, bins: list[int], hop: int, phase: str) -> None:
        self.dft, self.hop, self.phase = SlidingDFT(window, bins, hop=own_hop(window, hop)), hop, phase
        self.x = signal(ROWS * hop)
        self.out = np.empty((ROWS, len(bins)), complex)

    def __call__(self) -> Array:
        return self.dft.process(self.x, self.hop, self.out, self.phase)  # type: ignore[arg-type]


def check(window: int, bins: list[int], hop: int) -> None:
    """Check that all compute the same rows; otherwise the comparison is invalid."""
    x = signal(window + 40 * hop)
    truth = np.fft.fft(np.lib.stride_tricks.sliding_window_view(x, window)[::hop])[:, bins]
    rows = {name: make(x, window, bins, hop)() for name, make in (FAST | SLOW).items()}
    rows["numba planar"] = rows["numba planar"][0] + 1j * rows["numba planar"][1]
    rows["livebode"] = SlidingDFT(window, bins).process(x)[window - 1 :: hop]
    for name, found in rows.items():
        expected = truth[:, [i for i, k in enumerate(bins) if k < window // 2]] if name == "sdft" else truth
        difference = np.abs(found - expected).max() / np.abs(truth).max()
        if not difference < 1e-9:
            raise SystemExit(f"{name} computes different rows ({window=}, {len(bins)} bins, {hop=}): {difference:.1e}")


def measure(seconds: float) -> list[dict[str, Any]]:
    """One record per cell: seconds of each contender for the same rows."""
    records = []
    for hop, kind in ((1, "dense"), (HOP, "hop 20")):
        for window, bins in CELLS:
            check(window, bins, hop)
            x = signal(window + hop * (ROWS - 1))
            tasks: dict[str, Any] = {name: make(x, window, bins, hop) for name, make in FAST.items()}
            tasks["livebode"] = Ours(window, bins, hop, "window")
            tasks["livebode fixed"] = Ours(window, bins, hop, "fixed")
            best = side_by_side(tasks, seconds)
            few = signal(window + hop * (SLOW_ROWS - 1))
            slow = side_by_side({name: make(few, window, bins, hop) for name, make in SLOW.items()}, 0.0)
            best |= {name: t * ROWS / SLOW_ROWS for name, t in slow.items()}
            records.append({"kind": kind, "window": window, "bins": len(bins), "seconds": best})
    return records
