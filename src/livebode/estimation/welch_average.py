"""Welch's method for a stretch of samples: the same average as `welch`, for signals that arrive."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.core import Lines, Stage, StatefulBase
from livebode.estimation.quotient import Quotient, triangular
from livebode.estimation.tracker_settings import WINDOWS


class WelchAverage(StatefulBase):
    """H1 or the joint estimate from Hann windows that overlap by half; see `livebode.estimation._welch` for its bias.

    Parameters
    ----------
    lines
        The lines; window and bins.
    signals
        Number of signals besides the reference.
    places
        Stretches that begin within one stretch, each with its own sums; 0 to forget every stretch.
    forgetting
        Weight of a stretch relative to the next one at its place.
    """

    _stage = Stage("welch-average", 1)
    _STATE = ("_triangle", "_weights")

    def __init__(self, lines: Lines, signals: int, places: int, forgetting: float) -> None:
        self._window, self._bins, self._forgetting = lines.window, np.asarray(lines.bins), forgetting
        self._taper = np.hanning(lines.window + 1)[:-1]
        self._step = (lines.window + 1) // 2
        self._starts = np.arange(0, (WINDOWS - 1) * lines.window + 1, self._step)
        self._independent = independent_windows(self._starts.size, self._step, self._taper)
        self._triangle = np.zeros((places, self._bins.size, 1 + signals, 1 + signals), dtype=np.complex128)
        self._weights = np.zeros((places, 2))

    def process(self, samples: Floats, place: int) -> Quotient:
        """Quotients of a stretch, or of it and those before it at its place.

        `samples` is the stretch of the reference and of the signals, shape (1 + signals, WINDOWS·window).
        """
        windows = np.stack([samples[:, start : start + self._window] for start in self._starts])
        tapered = (windows - windows.mean(axis=-1, keepdims=True)) * self._taper
        equations = np.moveaxis(np.fft.rfft(tapered)[..., self._bins], -1, 0)  # (lines, windows, 1 + signals)
        weights = np.ones(2)
        if not len(self._triangle):
            return self._solved(triangular(equations), weights)
        kept = np.array([self._forgetting, self._forgetting**2])
        equations = np.concatenate([np.sqrt(kept[0]) * self._triangle[place], equations], axis=-2)
        triangle, weights = triangular(equations), weights + kept * self._weights[place]
        self._triangle[place], self._weights[place] = triangle, weights
        return self._solved(triangle, weights)

    def _solved(self, triangle: Complex, weights: Floats) -> Quotient:
        count = weights[0] * self._starts.size
        independent = self._independent * weights[0] ** 2 / weights[1]
        power = np.abs(triangle[:, 0, 0]) ** 2 / count
        with np.errstate(divide="ignore", invalid="ignore"):
            return Quotient(
                gains=(triangle[:, 0, 1:] / triangle[:, 0, :1]).T,
                residual=triangle[:, 1:, 1:] * np.sqrt(independent / (count * (independent - 1))),
                variance=1 / (independent * power),
                dof=float(independent - 1),
                power=power,
            )


def independent_windows(count: int, step: int, taper: Floats) -> float:
    """Equivalent number of windows without overlap (Welch 1967), for noise that is smooth over a bin."""
    window = taper.size
    shifts = np.arange(1, min(count, -(-window // step)))
    overlaps = np.array([np.dot(taper[k * step :], taper[: window - k * step]) for k in shifts])
    correlation = (overlaps / np.dot(taper, taper)) ** 2
    return float(count / (1 + 2 * np.sum((1 - shifts / count) * correlation)))
