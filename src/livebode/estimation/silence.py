"""Mains hum in periods without excitation: a tone that does not decay."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats
from livebode.core import Stage, StatefulBase

PERIODS = 9
"""Periods of silence after an excitation before a tone counts as hum.

A mode with a damping ratio of 0.1 % at 50 Hz loses 31 % of its power from the first to the last third of nine periods
of 0.1 s; in two periods a damping ratio of 0.5 % cannot be separated from noise.
"""
PERIODS_FIRST = 3  # of silence before the first excitation: thirds that a tone can decay over
STEADY = 0.9  # of the power in the first third of the periods: in the last third a tone that does not decay has more
GONE = 0.25  # of the previous power of the hum: below this, and without a tone, it has disappeared
GONE_PERIODS = 2  # in a row


class SilentHum(StatefulBase):
    """Which lines show a steady tone in periods without excitation.

    After the excitation a weakly damped mode rings near its own frequency, and looks like a tone. So a tone counts
    if it is detected in nine consecutive periods of silence and does not decay over them; where the data begins
    without excitation, three to eight are enough. A verdict is withdrawn when a later silence shows no tone there.

    Parameters
    ----------
    lines
        Number of lines.
    """

    _stage = Stage("silent-hum", 1)
    _STATE = ("_power", "_found", "_low", "_counts")

    def __init__(self, lines: int) -> None:
        self._power = np.full((PERIODS, lines), np.nan)  # of the newest periods of this silence, newest last
        self._found = np.zeros(lines)  # the hum's power, 0 where there is none
        self._low = np.zeros(lines)  # consecutive periods without it
        self._counts = np.zeros(2)  # periods of this silence, and of excitation before it

    @property
    def arrays(self) -> tuple[Floats, Floats, Floats, Floats]:
        """The state, which `Judge.take` changes in place: as the last ones of `PeriodState`."""
        return self._power, self._found, self._low, self._counts

    def interrupt(self) -> None:
        """The next period does not follow the previous one."""
        self._counts[0] = 0
        self._power[:] = np.nan
