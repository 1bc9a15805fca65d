"""Noise at the lines from the bins between them that the excitation leaves quiet."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.estimation.bounds import power
from livebode.nouns import InputError, Lines

NEIGHBOURS = 4
"""Quiet bins behind each line's noise, and so the complex degrees of freedom of one window."""


class QuietNoise:
    """|A_q − Ĝ_q·B_q|² at the quiet bins nearest to each line, with Ĝ interpolated linearly between the lines.

    What is left at a quiet bin is noise and what the axis's own motion leaks there. The interpolation of Ĝ makes the
    variance too high, by 18 % near a resonance with lines 2 bins apart.
    """

    def __init__(self, lines: Lines) -> None:
        if len(lines.quiet) < NEIGHBOURS:
            raise InputError(
                f"the lines leave {len(lines.quiet)} bins quiet, but the noise needs {NEIGHBOURS}; "
                "take the scatter between periods instead, or fewer lines"
            )
        at, quiet = np.asarray(lines.bins), np.asarray(lines.quiet)
        distance = np.abs(quiet - at[:, np.newaxis])
        self._nearest: NDArray[np.intp] = np.argsort(distance, axis=1, kind="stable")[:, :NEIGHBOURS]
        right = np.searchsorted(at, quiet).clip(1, max(1, len(at) - 1)) if len(at) > 1 else np.zeros(len(quiet), int)
        self._left = np.maximum(right - 1, 0)
        self._right = right
        width = np.maximum(at[self._right] - at[self._left], 1)
        self._share = np.where(self._right > self._left, (quiet - at[self._left]) / width, 0.0)

    def power(
        self, ratio: NDArray[np.complex128], numerator: NDArray[np.complex128], denominator: NDArray[np.complex128]
    ) -> NDArray[np.float64]:
        """Noise power of the numerator at each line, shape (rows, lines).

        `ratio` (rows, lines) is the estimate at the lines; `numerator`, `denominator` (rows, quiet) are the spectra at
        the quiet bins.
        """
        left, right = ratio[:, self._left], ratio[:, self._right]
        rest = numerator - (left + (right - left) * self._share) * denominator
        return np.asarray(power(rest)[:, self._nearest].mean(axis=2))
