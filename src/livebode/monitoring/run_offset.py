"""RunOffset: offset of this run from the baseline along the direction in which healthy runs differ."""

from __future__ import annotations

from typing import Any

import numpy as np

from livebode.arrays import Floats
from livebode.core import Stage, StatefulBase
from livebode.monitoring.accuracy import ChangeAccuracy
from livebode.monitoring.between_runs import KNOWN, BetweenRuns
from livebode.monitoring.charts import Charts
from livebode.monitoring.naming import ScoredWindows

_MEMORY = 600  # windows that have an offset in common: a minute of motion, as a recording to learn from
_FULL = 0.8  # of the memory: a larger share takes minutes to fill
_PAUSE_S = 60.0  # without judged motion, after which the machine may be at another temperature


class RunOffset(StatefulBase):
    """Follows this run's offset, so that only changes within the run, or in another direction, remain.

    The model follows the offset, as with a covariate. Until it is known to a tenth of the smallest change, evidence is
    also projected: an offset of any size is allowed for in each window. The offset is the mean over the previous
    windows, with a memory of 600; a window is included once every chart was at zero after it, so that a change is not
    included, and at the latest 600 windows later.
    An offset beyond those of healthy runs has its own chart; where that raises an alarm, the baseline itself is
    the reference.

    Parameters
    ----------
    between
        Learned difference between runs; None: runs do not differ, and evidence is unchanged.
    held, threshold
        Of the charts.
    """

    _stage = Stage("run-offset", 1)
    _STATE = ("chart", "_sums", "_fixed", "_last_s", "replayed")

    def __init__(self, between: BetweenRuns | None, held: ChangeAccuracy, threshold: float) -> None:
        self._between, self._held = between, held
        along = slice(None) if between is None else between.dominant(held.smallest)
        self._inflation = float(held.inflation[along].max())
        spread = np.array([0.0 if between is None else between.spread])
        self.chart = Charts(4 * spread, 2 * spread, threshold)
        """Chart of the offset itself."""
        self._sums = np.zeros(3)  # score and information along the direction, and windows
        self._queue = np.zeros((0, 3))  # mark, score, information of windows that may belong to a change
        self._fixed = False
        self._last_s = -np.inf
        self.replayed = np.zeros(held.smallest.size)
        """Offset of the logarithms that the model was driven with in this stretch, (4,)."""

    @property
    def reference(self) -> Floats:
        """Offset of the logarithms that changes are judged from, (4,): the newest estimate at a stretch's end."""
        return np.zeros_like(self.replayed) if self._fixed else self.replayed

    @property
    def known(self) -> bool:
        """Whether the offset is known well enough for evidence along it to count."""
        return self._between is None or self._fixed or bool(self._sums[1] * KNOWN**2 > self._inflation)

    @property
    def error_reachable(self) -> float:
        """Standard deviation of the offset that windows like the previous ones can reach, in smallest changes.

        Zero before half of the memory is full: the information of windows depends on speed and position.
        """
        _, information, windows = self._sums
        if windows < _MEMORY / 2 or information <= 0:
            return 0.0
        return float(np.sqrt(self._inflation * windows / (information * _FULL * _MEMORY)))

    @property
    def unreachable(self) -> bool:
        """Whether the offset remains unknown with windows like the previous ones, or is known only after minutes."""
        return not self.known and self.error_reachable > KNOWN

    def within_run(self, direction: int) -> bool:
        """Whether changes of this direction are relative to the earlier part of the run, not to the baseline."""
        between = self._between
        return between is not None and not self._fixed and bool(between.dominant(self._held.smallest)[direction])

    def judged(self, score: Floats, information: Floats) -> tuple[Floats, Floats]:
        """Evidence of windows around the reference, with an unknown offset allowed for, (rows, 4 …)."""
        if self._between is None or self.known:
            return score, information
        return self._between.projected(score, information, self._held.smallest)

    def segment(self, segment: ScoredWindows) -> ScoredWindows:
        """Evidence of a segment as `judged` gives it."""
        return ScoredWindows(*self.judged(segment.score, segment.information), segment.position_m)

    def step(self, score: Floats, information: Floats, mark: int, time_s: float) -> None:
        """Process a window without an alarm: evidence around the baseline, (4,), (4, 4)."""
        if self._between is None:
            return
        if time_s - self._last_s > _PAUSE_S:
            self._sums, self._queue = np.zeros(3), np.zeros((0, 3))
        self._last_s = time_s
        direction = self._between.direction
        along, own = float(score @ direction), float(direction @ information @ direction)
        self._queue = np.vstack([self._queue, [mark, along, own]])
        self.chart.step(np.array([along]) / self._inflation, np.array([own]) / self._inflation, mark)

    def fix(self) -> None:
        """Make the baseline itself the reference, because the offset is beyond those of healthy runs."""
        self._fixed = True

    def settle(self, oldest: int, idle: bool) -> None:
        """At a stretch's end: windows before the mark `oldest` belong to the run; not `idle`, a change is in them.

        So do those that have waited for 600 others: no alarm looks back that far.
        """
        if not idle:
            self._queue = self._queue[:0]
            return
        self._fixed = False
        enter = self._queue[:, 0] < oldest
        enter[:-_MEMORY] = True
        for _, score, information in self._queue[enter]:
            self._sums = (1 - 1 / _MEMORY) * self._sums + (score, information, 1.0)
        self._queue = self._queue[~enter]
        if self._between is not None:
            self.replayed = self._between.direction * self._sums[0] / (self._sums[1] + self._between.spread**-2)

    def _state(self) -> dict[str, Any]:
        return super()._state() | {"queue": self._queue}

    def _load(self, state: dict[str, Any]) -> None:
        super()._load(state)
        self._queue = state["queue"]
