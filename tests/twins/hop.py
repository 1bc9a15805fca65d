"""The NumPy twin of spectra at a hop: the readable definition of what kernel/src/hop.h describes, one hop at a time.

P_k is the spectrum of a hop, referred to its centre, of sums and differences of pairs of samples in the order of their
distance. Q_k is P_k turned to the fixed grid. S_k gains Q_k less that of a window before; F_k gains Q_k, and replaces
S_k at the end of a period.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from tests.twins.sliding import twiddles

Real = npt.NDArray[np.floating[Any]]


class TwinHopDFT:
    """What SlidingDFT with a hop computes, in NumPy; the same bits."""

    def __init__(self, window: int, bins: list[int], channels: int, dtype: str, hop: int) -> None:
        self.dtype, self.hop, self.places = np.dtype(dtype), hop, window // hop
        k, pairs = np.array(bins), (hop + 1) // 2
        cosine, sine = twiddles(2 * window)

        def turn(number: npt.NDArray[np.int64]) -> tuple[Real, Real]:
            angle = np.outer(number, k) % (2 * window)
            return cosine[angle].astype(dtype), sine[angle].astype(dtype)

        self.cosine, self.sine = turn(2 * np.arange(pairs) + (hop + 1) % 2)
        if hop % 2:
            self.cosine[0] = 0.5
        self.centre = turn(2 * hop * np.arange(self.places) + hop - 1)
        self.ahead = turn(np.array([hop + 1]))
        self.s, self.f = (np.zeros((2, channels, len(bins)), dtype) for _ in range(2))
        self.ring = np.zeros((self.places, 2, channels, len(bins)), dtype)

    def _add(self, x: Real, place: int) -> None:
        """A hop, x (channels, hop)."""
        pairs = len(self.cosine)
        before, after = x[:, pairs - 1 :: -1], x[:, self.hop - pairs :]
        re, im = (np.zeros_like(self.s[0]) for _ in range(2))
        for i in range(pairs):
            re = re + self.cosine[i] * (before[:, i] + after[:, i])[:, np.newaxis]
            im = im + self.sine[i] * (before[:, i] - after[:, i])[:, np.newaxis]
        c, s = self.centre[0][place], self.centre[1][place]
        q = np.stack([re * c + im * s, im * c - re * s])
        self.s = self.s + (q - self.ring[place])
        self.f = self.f + q
        self.ring[place] = q
        if place == self.places - 1:
            self.s, self.f = self.f, np.zeros_like(self.f)

    def _row(self, place: int, phase: str) -> npt.NDArray[np.complexfloating[Any, Any]]:
        out = np.empty(self.s.shape[1:], np.result_type(self.dtype, np.complex64))
        out.real, out.imag = self.s
        if phase == "window":
            c, s, a, b = self.centre[0][place], self.centre[1][place], *self.ahead
            cosine, sine = c * a - s * b, c * b + s * a
            out.real = self.s[0] * cosine - self.s[1] * sine
            out.imag = self.s[0] * sine + self.s[1] * cosine
        return out

    def process(self, x: Real, phase: str) -> npt.NDArray[np.complexfloating[Any, Any]]:
        """Samples (channels, samples), from the first on, to spectra (channels, rows, bins)."""
        rows = []
        for number in range(x.shape[1] // self.hop):
            self._add(x[:, number * self.hop : (number + 1) * self.hop], number % self.places)
            rows.append(self._row(number % self.places, phase))
        return np.stack(rows, axis=1)
