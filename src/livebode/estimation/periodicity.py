"""Whether the input of a direct estimate repeats from window to window, within what noise explains."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Flags, Floats
from livebode.core import ANY_EXCITATION, Event, Lines, Stage, StatefulBase
from livebode.estimation.products import power, times
from livebode.language import Message

_CHANGED = 0.1  # of the input's power: a smaller change leaks less than it
_CHANCE, _CHANCE_Z = 1e-6, 4.75  # the same probability, as a quantile of the normal distribution
_OF_DIFFERENCES = (
    2 / 3
)  # degrees of freedom that differences of neighbours have of those of a scatter (von Neumann 1941)
_FORGETTING = 0.95  # of a window relative to the next one: about forty windows
_KEPT = np.array([[_FORGETTING], [_FORGETTING**2]])  # of Σλ^i and Σλ^2i
# Mean share of a difference in the power of its two windows: 1 for noise, 1/(1 + SNR) for noise on what repeats.
_SHARE, _SHARE_SPREAD = 0.5, 1.5
# Radians by which the input turns from each window to the next, and standard deviations: the window is no whole period.
_TURNED, _TURNED_SIGMAS, _TURNED_WINDOWS_MIN = 0.05, 6.0, 8.0
_LISTED_MAX = 20


class Periodicity(StatefulBase):
    """Finds the windows whose input, at a line, does not repeat the window before or the periods before.

    The leakage of a window is the response to the difference of its samples from those one window before. A window does
    not repeat where the input differs from the one a window before by more than a tenth of its power, and by more than
    the differences before it explain (a chirp arrives); where the differences have more power than what repeats, over
    all windows or in most of them (noise, and between the passes of a chirp); and where the input turns by the same
    angle from each window to the next (a wrong period). A slow change, and a jump of amplitude or phase, only count
    where they happen.

    Of an input that repeats with a signal-to-noise ratio of 6 dB or more, at a line and in one window, less than one
    window in 1,000 is taken for one that does not repeat.

    Parameters
    ----------
    lines
        The lines.
    places
        Windows in one period.
    name, events
        Channel of the input, and where the first such window is reported.
    """

    _stage = Stage("periodicity", 1)
    _STATE = ("_before", "_means", "_weights", "_counts", "_told")

    def __init__(self, lines: Lines, places: int, name: str, events: list[Event]) -> None:
        self._lines, self._name, self._events = lines, name, events
        # All of the last period, the oldest first.
        self._before = np.full((places, len(lines)), complex(np.nan, np.nan))
        # Of half a difference's power, of the power, of the product with the window before, real and imaginary, and of
        # the difference's share.
        self._means = np.zeros((5, places, len(lines)))
        self._weights = np.zeros((2, places))  # Σλ^i, Σλ^2i
        self._counts = np.zeros((2, len(lines)), dtype=np.int64)  # windows, and those that do not repeat
        self._told = False

    def process(self, input_: Complex, usable: Flags, sample: NDArray[np.int64], centre_s: Floats) -> Flags:
        """Which windows do not repeat, shape (rows, lines).

        Parameters
        ----------
        input_
            Spectrum of the input, shape (rows, lines), at consecutive places.
        usable
            Windows that count, shape (rows,).
        sample, centre_s
            Newest sample and time of the centre of each window, shape (rows,).
        """
        irregular = self._found(input_, usable)
        self._counts[0] += np.count_nonzero(usable)
        self._counts[1] += np.count_nonzero(irregular, axis=0)
        self._report(irregular, sample, centre_s)
        return irregular

    def _found(self, input_: Complex, usable: Flags) -> Flags:
        rows, places = len(input_), len(self._before)
        now = np.where(usable[:, np.newaxis], input_, np.nan)
        every = np.concatenate([self._before, now])
        before, self._before = every[:rows], every[rows:].copy()
        difference, power_now, power_before = power(now - before) / 2, power(now), power(before)
        product = times(now, before.conj())
        both = power_now + power_before
        share = np.divide(2 * difference, both, out=np.zeros_like(both), where=both > 0)
        new = np.stack([difference, power_now, product.real, product.imag, share])
        known, means, weights = np.isfinite(difference[:, 0]), np.empty_like(new), np.empty((2, rows))
        for first in range(0, rows, places):
            part = slice(first, first + places)
            means[:, part], weights[:, part] = self._averaged(new[:, part], known[part])
        return _does_not_repeat(difference, power_now, means, weights) & usable[:, np.newaxis]

    def _averaged(self, new: Floats, known: Flags) -> tuple[Floats, Floats]:
        """Add at most one period to the means; return the means and weights without it."""
        rows = len(known)
        means, weights = self._means[:, :rows], self._weights[:, :rows]
        after = np.where(known, _KEPT * weights + 1, weights)
        next_means = np.where(known[:, np.newaxis], means + (new - means) / after[0, :, np.newaxis], means)
        self._means = np.concatenate([self._means[:, rows:], next_means], axis=1)
        self._weights = np.concatenate([self._weights[:, rows:], after], axis=1)
        return means, weights

    def not_repeating_hz(self) -> list[float]:
        """Lines at which the input does not repeat in most of the windows."""
        windows, irregular = self._counts
        return [float(f) for f in self._lines.frequency_hz[2 * irregular > windows]]

    def _report(self, irregular: Flags, sample: NDArray[np.int64], centre_s: Floats) -> None:
        rows = irregular.any(axis=1)
        if self._told or not rows.any():
            return
        self._told = True
        row = int(np.argmax(rows))
        f = self._lines.frequency_hz[irregular[row]]
        where = ", ".join(f"{x:g}" for x in f[:_LISTED_MAX]) + " …" * (f.size > _LISTED_MAX)
        message = Message(
            "the input {input} does not repeat every {window} samples at {places} Hz: a response is not valid "
            "where its window does not repeat; {advice}",
            input=repr(self._name),
            window=self._lines.window,
            places=where,
            advice=ANY_EXCITATION,
        )
        details: dict[str, Any] = {"lines_hz": f[:_LISTED_MAX].tolist(), "window": self._lines.window}
        self._events.append(Event("not-periodic", int(sample[row]), float(centre_s[row]), message, details))


def _does_not_repeat(difference: Floats, every: Floats, means: Floats, weights: Floats) -> Flags:
    """Windows by half the power of their difference and their power, and by the means before them, (rows, lines)."""
    scatter, repeating = means[0], means[1] - means[0]
    count = (weights[0] ** 2 / weights[1])[:, np.newaxis]  # NaN before the first difference
    dof = _OF_DIFFERENCES * count
    explained = scatter * dof * (_CHANCE ** (-1 / dof) - 1)  # F(2, 2·dof)
    most = (1 - 1 / (9 * dof) + _CHANCE_Z / (3 * np.sqrt(dof))) ** 3  # of chi², Wilson, Hilferty 1931
    irregular = (2 * difference > _CHANGED * every) & (difference > explained) | (scatter > most * repeating)
    return np.asarray(irregular | _turns(means, count) | (means[4] > _SHARE + _SHARE_SPREAD / np.sqrt(count)))


def _turns(means: Floats, count: Floats) -> Flags:
    """Where the input turns from window to window by more than noise explains, shape (rows, lines)."""
    every, real, imaginary = means[1:4]
    difference = np.maximum(every - np.hypot(real, imaginary), 0.0)
    significant = imaginary**2 > _TURNED_SIGMAS**2 * every * difference / count
    return np.asarray((np.abs(imaginary) > _TURNED * every) & significant & (count >= _TURNED_WINDOWS_MIN))
