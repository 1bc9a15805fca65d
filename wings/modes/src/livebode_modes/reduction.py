"""Reduction: the outputs in their band, at a lower rate, sample by sample."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import needing

with needing("SciPy", "analysis", "a run from the outputs alone"):
    import scipy  # its parts are loaded when they are first used


_HALF_TAPS = 10  # of the low-pass on either side, in samples at the reduced rate
PASSED = 0.8
"""Share of half the reduced rate that the low-pass passes."""


def lost_samples(factor: int) -> int:
    """Samples that the low-pass needs beyond those of a window.

    >>> lost_samples(1), lost_samples(5)
    (0, 100)
    """
    return 2 * _HALF_TAPS * factor if factor > 1 else 0


class Reduction:
    """Reduces the rate by a whole factor, and removes offset and drift.

    The low-pass is symmetric, so its delay is known, and has no poles that could be taken for modes; the poles of the
    high-pass are real.

    Parameters
    ----------
    factor
        Samples for each one at the reduced rate.
    highpass
        Corner of the high-pass, as a share of the reduced rate.
    """

    def __init__(self, factor: int, highpass: float) -> None:
        self._factor = factor
        self._taps = scipy.signal.firwin(lost_samples(factor) + 1, PASSED / factor) if factor > 1 else np.ones(1)
        self._sections = np.repeat(scipy.signal.butter(1, 2 * highpass, "highpass", output="sos"), 2, axis=0)
        self._waiting: Floats | None = None
        self._state: Floats | None = None
        self._last: Floats | None = None

    @property
    def lead(self) -> int:
        """Samples before the first reduced one, whose centre it is."""
        return (len(self._taps) - 1) // 2

    def squared_gain(self, frequency: NDArray[np.floating]) -> Floats:
        """Squared gain of both filters at frequencies that are shares of the reduced rate."""
        omega = 2 * np.pi * frequency
        high = scipy.signal.sosfreqz(self._sections, omega)[1]
        low = scipy.signal.freqz(self._taps, 1, omega / self._factor)[1]
        return np.asarray(np.abs(high * low) ** 2)

    def process(self, x: Floats) -> tuple[Floats, NDArray[np.bool_]]:
        """The reduced samples, (channels, n), and which of them are from finite samples only, (n,)."""
        waiting = x if self._waiting is None else np.concatenate([self._waiting, x], axis=1)
        count = max((waiting.shape[1] - len(self._taps)) // self._factor + 1, 0)
        skipped = (len(self._taps) - 1) // self._factor
        if self._factor > 1:
            used = waiting[:, : (count - 1) * self._factor + len(self._taps)] if count else waiting[:, :0]
            y = (
                scipy.signal.upfirdn(self._taps, used, 1, self._factor, axis=1)[:, skipped : skipped + count]
                if count
                else used
            )
        else:
            y = waiting[:, :count]
        self._waiting = waiting[:, count * self._factor :].copy()
        finite = np.asarray(np.isfinite(y).all(axis=0))
        return self._highpass(self._held(y, finite), finite)

    def _held(self, y: Floats, finite: NDArray[np.bool_]) -> Floats:
        """The last finite values instead of those that are not."""
        if finite.all() and y.shape[1]:
            self._last = y[:, -1]
            return y
        before = np.zeros((len(y), 1)) if self._last is None else self._last[:, np.newaxis]
        last = np.maximum.accumulate(np.where(finite, np.arange(1, len(finite) + 1), 0))
        held = np.asarray(np.concatenate([before, y], axis=1)[:, last])
        if finite.any():
            self._last = held[:, -1]
        return held

    def _highpass(self, y: Floats, finite: NDArray[np.bool_]) -> tuple[Floats, NDArray[np.bool_]]:
        if not y.shape[1] or (self._state is None and not finite.any()):
            return y, finite
        if self._state is None:  # as if the first value had always been there
            first = y[:, int(np.argmax(finite))]
            self._state = scipy.signal.sosfilt_zi(self._sections)[:, np.newaxis] * first[np.newaxis, :, np.newaxis]
        filtered, self._state = scipy.signal.sosfilt(self._sections, y, axis=1, zi=self._state)
        return filtered, finite
