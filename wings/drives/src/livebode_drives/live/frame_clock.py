"""Sample numbers of frames that a sender sends at a regular rate, from the time at which each was received."""

from __future__ import annotations

TOLERANCE = 0.4
"""A frame that is further from its due time than this, in periods, has no certain number."""
PAUSE_PERIODS = 200
"""Longest pause after which numbers are certain: 0.2 % between two clocks are 0.4 periods then."""
_GAIN = 0.05


class FrameClock:
    """Follows the sender's clock, so that two clocks of different speed cause neither losses nor repeats.

    Parameters
    ----------
    rate_hz
        Frames per second, within 0.5 % of the true rate: then the due time lags by at most 0.1 periods.
    """

    def __init__(self, rate_hz: float) -> None:
        self._period_s = 1 / rate_hz
        self._due_s: float | None = None
        self.number = 0
        """Of the newest frame."""

    @property
    def paused_s(self) -> float:
        """Time after the newest frame from which numbers are no longer certain."""
        return PAUSE_PERIODS * self._period_s

    @property
    def newest_s(self) -> float | None:
        """Time at which the newest frame was due, by all before it."""
        return self._due_s

    def take(self, time_s: float) -> bool:
        """Whether a frame at this time has a certain number, which is then `number`."""
        if self._due_s is None:
            self._due_s = time_s
            return True
        steps_exact = (time_s - self._due_s) / self._period_s
        steps = round(steps_exact)
        if steps < 1 or abs(steps_exact - steps) > TOLERANCE:
            return False
        self.number += steps
        self._due_s += steps * self._period_s
        self._due_s += _GAIN * (time_s - self._due_s)
        return True
