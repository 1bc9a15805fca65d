"""Programme: the samples that are played, from the ramp up to the ramp down."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


class Programme:
    """A period that is repeated until `stop`, with linear ramps at both ends; its last sample is zero.

    Parameters
    ----------
    period
        One period, shape (samples,).
    up, down
        Samples of the ramps.

    Examples
    --------
    >>> programme = Programme(np.array([1.0, -1.0]), up=2, down=2)
    >>> programme.stop(4)
    6
    >>> programme.samples(0, 100)
    array([ 0.5, -1. ,  1. , -1. ,  0.5, -0. ])
    """

    def __init__(self, period: NDArray[np.float64], up: int, down: int) -> None:
        self._period, self._up, self._down = period, up, down
        self._stop: int | None = None

    @property
    def length(self) -> int | None:
        """Number of samples; None before `stop`."""
        return None if self._stop is None else self._stop + self._down

    def stop(self, at: int) -> int:
        """Begin the ramp down with sample `at`; only the first request counts. Returns the length."""
        self._stop = at if self._stop is None else self._stop
        return self._stop + self._down

    def samples(self, first: int, last: int) -> NDArray[np.float64]:
        """Samples `first` to `last` - 1, fewer at the end."""
        number = np.arange(first, last if self.length is None else min(last, self.length))
        # A ramp up that is stopped does not rise further.
        risen = np.minimum((number if self._stop is None else np.minimum(number, self._stop)) + 1, self._up) / self._up
        played = self._period[number % self._period.size] * risen
        if self.length is not None:
            played *= np.clip((self.length - 1 - number) / self._down, 0.0, 1.0)
        return np.asarray(played)
