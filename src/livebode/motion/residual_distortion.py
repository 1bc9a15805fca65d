"""Distortion in what a moving model leaves of the output."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Flags, Floats
from livebode.core import Event, Responses, Stage, StatefulBase
from livebode.estimation import MovingPeriods, PeriodClock, Periods, Settings
from livebode.motion.chunk import Chunk


class ResidualDistortion(StatefulBase):
    """Distortion of the responses of each chunk, from the residual r = y − y_model at the detection lines.

    The residual contains neither the motion nor the change of the machine, as far as the model explains them, so that
    less than in the output itself is taken for skirts (`MovingDistortion`). Of the verdict at a response and the one at
    the end of its chunk, which is from more periods, the larger distortion counts.

    Parameters
    ----------
    settings
        Lines, signals and estimator.
    events
        Receives an Event for each line that becomes invalid.
    """

    _stage = Stage("residual-distortion", 1)
    _STATE = ("_periods", "_stop")

    def __init__(self, settings: Settings, events: list[Event]) -> None:
        self._settings, self._window = settings, settings.lines.window
        self._periods = MovingPeriods(settings, events, of_residual=True)
        self._stop = -1  # number of the sample after the newest period

    @property
    def is_possible(self) -> bool:
        """Whether the lines have detection lines that show distortion."""
        return self._periods.is_possible

    def process(self, residual: Floats, chunk: Chunk, tracked: Responses) -> tuple[Floats, Flags]:
        """Distortion and whether it makes a line invalid, (rows, lines); `residual` is NaN where it does not count."""
        window, lines = self._window, self._settings.lines
        begin = -(-max(chunk.first - window + 1, chunk.start) // window) * window
        count = max((chunk.stop - begin) // window, 0)
        if begin != self._stop:
            self._periods.end_stretch()
        self._periods.begin()
        if count:
            self._stop = begin + count * window
            origin_s = float(tracked.time_s[0]) - (int(tracked.sample[0]) - (window - 1) / 2) / lines.rate_hz
            self._add(residual, chunk, begin, count, PeriodClock(begin + window - 1, origin_s, "m"))
        verdicts = self._periods.verdicts()
        ended = ((tracked.sample + 1 - begin) // window).clip(0, count)
        distortion, invalid = verdicts.distortion[ended], verdicts.invalid[ended]
        return np.fmax(distortion, verdicts.distortion[-1]), invalid | verdicts.invalid[-1]

    def _add(self, residual: Floats, chunk: Chunk, begin: int, count: int, clock: PeriodClock) -> None:
        channels = {"output": chunk.y, "input": chunk.u, "excitation": chunk.w}
        rows: list[Floats] = [channels[role] for role in self._settings.roles]
        part = slice(begin - chunk.start, begin - chunk.start + count * self._window)
        signals = np.array([row[part] for row in (*rows, residual)])
        complete = np.isfinite(signals).all(axis=0).reshape(count, self._window).all(axis=1)
        periods = Periods.of(signals, chunk.x[part], complete, self._window)
        self._periods.process(periods, np.ones(count, dtype=np.bool_), clock)
