"""The Hann window from three bins, after the DFT."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex
from livebode.core import GridError, Lines


class Hann:
    """X_k/2 − (X_{k−1} + X_{k+1})/4, the periodic Hann window in the frequency domain (Jacobsen & Lyons 2003).

    It reduces the weight of the window's ends, where a moving axis was at other positions, for 1.5 times the noise.
    Lines must be two bins apart, otherwise the excitation of neighbouring lines leaks in.
    """

    def __init__(self, lines: Lines) -> None:
        apart = np.diff(lines.bins)
        if apart.size and apart.min() < 2:
            raise GridError(
                "lines-too-close",
                f"with a Hann window lines must be 2 bins ({2 * lines.resolution_hz:g} Hz) apart, but two are closer",
                "take a longer window or fewer lines",
                argument="lines",
                resolution_hz=lines.resolution_hz,
            )
        if lines.bins[0] < 2 or 2 * (lines.bins[-1] + 1) >= lines.window:
            raise GridError(
                "line-at-edge",
                f"with a Hann window lines must be 2 bins ({2 * lines.resolution_hz:g} Hz) "
                "from 0 and 1 from the Nyquist frequency",
                "leave out the outermost line",
                argument="lines",
                resolution_hz=lines.resolution_hz,
            )
        self._window = lines.window
        at = np.asarray(lines.bins)
        self.bins = np.unique(np.concatenate([at - 1, at, at + 1]))
        self._at = np.searchsorted(self.bins, at)

    def combine(self, spectrum: Complex, place: NDArray[np.int64]) -> Complex:
        """Windowed lines (channels, rows, lines) from spectra (channels, rows, bins) on the fixed phase grid.

        `place` (rows,) is the number of each window's newest sample, plus one, modulo N.
        """
        # On the fixed grid bin k lags the window's own phase by k(n + 1)/N turns; neighbours differ by one such step.
        turn = np.exp(2j * np.pi * place / self._window)[:, np.newaxis]
        below, above = spectrum[..., self._at - 1], spectrum[..., self._at + 1]
        return np.asarray(0.5 * spectrum[..., self._at] - 0.25 * (below * turn.conj() + above * turn))
