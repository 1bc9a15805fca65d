"""Differences between healthy runs: the direction in which they differ, and the offset of this run along it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Stage, StatefulBase, f_exceeded, normal_quantile, t_quantile
from livebode.dataclass import dataclass
from livebode.monitoring.accuracy import STRETCH, ChangeAccuracy
from livebode.monitoring.charts import Charts
from livebode.monitoring.evidence import Evidence
from livebode.monitoring.naming import ScoredWindows

KNOWN = 0.1  # of the smallest change: standard deviation from which on a run's own offset is known
_FALSE = 1e-4  # probability of a false direction
_MATTERS = 0.25  # of the smallest change: runs that differ by less need no allowance
_DOMINANT = 0.5  # of the largest component, in smallest changes: such a direction cannot be separated from the offset
_CERTAIN = 0.95
_RUNS_MIN, _WITHIN_MIN = 3, 10  # runs, and degrees of freedom of their stretches, from which on they are compared


@dataclass(frozen=True, eq=False)
class BetweenRuns:
    """Difference from run to run without a covariate that explains it, such as a belt's stiffness by temperature.

    Attributes
    ----------
    direction
        Of the logarithms of stiffness, load, damping, inertia, (4,); its largest component is one smallest change.
    spread
        Standard deviation of the runs' offsets along it, with the uncertainty of an estimate from so few runs.
    """

    direction: Floats
    spread: float

    def dominant(self, smallest: Floats) -> NDArray[np.bool_]:
        """Directions with a large share of the offset, (4,): a change of one is detected only within a run."""
        share = np.abs(self.direction / smallest)
        return np.asarray(share >= _DOMINANT * share.max())

    def projected(self, score: Floats, information: Floats, smallest: Floats) -> tuple[Floats, Floats]:
        """Score and information of windows with an offset of any size allowed for in each, (rows, 4), (rows, 4, 4).

        The dominant directions have no information afterwards.
        """
        along = information @ self.direction
        own = (along @ self.direction)[:, np.newaxis]
        gain = np.divide(along, own, out=np.zeros_like(along), where=own > np.finfo(float).tiny)
        score = score - gain * (score @ self.direction)[:, np.newaxis]
        information = information - gain[:, :, np.newaxis] * along[:, np.newaxis, :]
        seen = ~self.dominant(smallest)
        return score * seen, information * np.outer(seen, seen)


def between_runs(parts: Sequence[Evidence], smallest: Floats) -> BetweenRuns | None:
    """The direction in which these runs differ, if it is significant and large enough to matter.

    A run's offset is estimated from all of its windows. The pooled scatter of stretches of 24 windows within runs is
    the noise; the scatter of the offsets beyond it has a largest principal component, in units of the smallest changes.
    It is used if its probability by chance is below 1e-4, and if its standard deviation exceeds a quarter of the
    smallest change: otherwise it would count as scatter of healthy stretches, and hide changes in every direction.
    With fewer than three runs, or fewer than ten degrees of freedom of the stretches, there is no direction.
    """
    parts = [part for part in parts if len(part) >= STRETCH]
    if len(parts) < _RUNS_MIN:
        return None
    offsets, stretches = zip(*(_offset(part, smallest) for part in parts))
    degrees, within = len(parts) - 1, sum(len(stretch) - 1 for stretch in stretches)
    if within < _WITHIN_MIN:
        return None
    windows = np.array([len(part) for part in parts])
    offset, scattered = np.array(offsets), np.concatenate(stretches)
    deviation, noise = offset - offset.mean(axis=0), scattered.T @ scattered / within
    size, vectors = np.linalg.eigh(deviation.T @ deviation / degrees - noise * np.mean(1 / windows))
    along = vectors[:, -1] / np.abs(vectors[:, -1]).max()
    weighted = (offset - np.average(offset, axis=0, weights=windows)) @ along
    ratio = float(windows @ weighted**2 / np.sum((scattered @ along) ** 2))
    variance = np.sum((deviation @ along) ** 2) / degrees - along @ noise @ along * np.mean(1 / windows)
    spread = np.sqrt(max(variance, 0.0)) / (along @ along)
    if chance(ratio, degrees, within) > _FALSE or spread < _MATTERS or size[-1] <= 0:
        return None
    few = t_quantile(_CERTAIN, degrees) / normal_quantile(_CERTAIN)
    return BetweenRuns(along * smallest, float(spread * few))


def chance(ratio: float, between: int, within: int) -> float:
    """Upper bound of the chance that some direction of four scatters so much more between runs than within.

    `ratio` is of the sums of squares, with these degrees of freedom. The direction was chosen by the data, so its ratio
    is at most the largest root of the two Wishart matrices; and Wilks' Λ is at most 1/(1 + that root). Λ's distribution
    by Rao, Bull. Int. Stat. Inst. 33, 1951.
    """
    p = 4
    root = np.sqrt(((p * between) ** 2 - 4) / (p**2 + between**2 - 5))
    first = p * between
    second = (within - (p - between + 1) / 2) * root - first / 2 + 1
    return f_exceeded(((1 + ratio) ** (1 / root) - 1) * second / first, first, second)


def _offset(part: Evidence, smallest: Floats) -> tuple[Floats, Floats]:
    """Offset of a run in all four directions, (4,), and scatter of its stretches, (stretches, 4), in smallest changes.

    The latter as of a single window: a mean over n windows has 1/n of that covariance.
    """
    information = part.information.sum(axis=0)
    inverse = np.linalg.inv(information)
    offset = inverse @ part.score.sum(axis=0)
    left = part.score - part.information @ offset
    cut = np.arange(STRETCH, len(left) - STRETCH // 2, STRETCH)
    scale = [len(left) / np.sqrt(len(piece)) for piece in np.split(left, cut)]
    sums = np.array([piece.sum(axis=0) for piece in np.split(left, cut)])
    return offset / smallest, sums @ inverse * np.array(scale)[:, np.newaxis] / smallest


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
