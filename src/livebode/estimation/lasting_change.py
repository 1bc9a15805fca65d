"""Whether the machine changes during a run: a sequential test of the windows at one place in the period."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Complex, Floats, Integers
from livebode.core import (
    INTERVAL_FACTOR,
    Event,
    Lines,
    Stage,
    StatefulBase,
    added,
    has_moved,
    log_sum_exceeded,
    with_extremes,
)
from livebode.estimation.products import divided, magnitude, power, scaled, times
from livebode.language import Message

FALSE_ALARM = 0.005
"""Probability that a run of ten minutes of a machine that does not change is reported."""
_GROUPS_MAX = 32  # when all are full, neighbours are added: memory does not grow with the run
_GROUPS_MIN = _GROUPS_MAX // 2
_REFERENCE = 8  # windows before the first group
_TESTS = 150  # of a run of ten minutes and windows of 0.1 s: sixteen each time that it becomes twice as long
_SMALLEST = 1e-4  # of the response: what no noise explains and nobody needs


class LastingChange(StatefulBase):
    """Tests windows of one series, in order, for a change of the response that lasts.

    With the response Ĝ of the first eight windows, the error of a later one, (numerator − Ĝ·denominator)/denominator of
    the first, is the change of the response to first order. Errors are averaged in up to 32 groups of equal length.
    Whenever a group is complete, the means before and after each boundary are compared. Their difference over the
    scatter of the groups is F(2, 2d) with d the number of groups less two, at one line; several lines together are
    compared by Fisher's method. The scatter is at least that of successive windows, by their differences (J. von
    Neumann, Ann. Math. Stat. 12, 1941). `FALSE_ALARM` is divided by the numbers of tests, boundaries and lines
    (Bonferroni).

    After a change the test begins again, and takes twice as many windows as before until it reports the next one.

    Parameters
    ----------
    lines
        Lines of the responses.
    events
        Where an event is added.

    Notes
    -----
    Where the schedule varies by more than a thousandth of its largest value, nothing is tested, because the response
    may depend on it. A change that returns within a group is noise.
    """

    _stage = Stage("lasting-change", 1)
    _STATE = (
        "_windows",
        "_level",
        "_least",
        "_reference",
        "_sums",
        "_ends",
        "_newest",
        "_steps",
        "_schedule",
    )

    def __init__(self, lines: Lines, events: list[Event]) -> None:
        self._lines, self._events = lines, events
        self._least = _GROUPS_MIN  # windows before the next event
        self._schedule = np.full(2, np.nan)  # smallest and largest
        self._begin()

    def _begin(self) -> None:
        n = len(self._lines)
        self._windows, self._level = -_REFERENCE, 0
        self._reference = np.zeros((2, n), dtype=np.complex128)  # sums of numerator and denominator
        self._sums = np.zeros((_GROUPS_MAX, n), dtype=np.complex128)
        self._ends = np.zeros(_GROUPS_MAX)  # time of the newest window in each group
        self._newest = np.zeros(n, dtype=np.complex128)
        self._steps = np.zeros(n)

    def process(self, pair: Complex, time_s: Floats, schedule: Floats, sample: Integers) -> None:
        """Process the next windows: numerator and denominator, (2, windows, lines), with their moments."""
        done = 0
        while done < len(sample):
            stop = min(len(sample), done + self._until_complete())
            now = slice(done, stop)
            self._schedule = with_extremes(self._schedule, schedule[now])
            done = stop
            if self._windows < 0:
                self._reference = added(self._reference, pair[:, now])
                self._windows += now.stop - now.start
                continue
            self._add(pair[:, now], float(time_s[stop - 1]))
            if self._is_complete() and (change := self._change()) is not None:
                self._report(int(sample[stop - 1]), float(time_s[stop - 1]), *change)
                self._least *= 2
                self._begin()

    def _until_complete(self) -> int:
        """Windows until the reference, or the present group, is complete."""
        size = 1 << self._level
        return -self._windows if self._windows < 0 else size - self._windows % size

    def _add(self, pair: Complex, time_s: float) -> None:
        """Add windows of one group."""
        error = window_errors(scaled(self._reference, 1 / _REFERENCE), pair)
        before = self._newest if self._windows else error[0]
        self._steps = added(self._steps, power(np.diff(error, axis=0, prepend=before[np.newaxis])))
        self._newest = error[-1]
        group = self._windows >> self._level
        if group == _GROUPS_MAX:
            self._merge()
            group = _GROUPS_MAX // 2
        self._sums[group] = added(self._sums[group], error)
        self._ends[group] = time_s
        self._windows += len(error)

    def _merge(self) -> None:
        half = _GROUPS_MAX // 2
        self._sums[:half], self._sums[half:] = self._sums[::2] + self._sums[1::2], 0.0
        self._ends[:half], self._ends[half:] = self._ends[1::2].copy(), 0.0
        self._level += 1

    def _is_complete(self) -> bool:
        """Whether a group is, and there are enough of them."""
        enough = self._windows >= self._least and self._windows >> self._level >= _GROUPS_MIN
        return enough and self._windows % (1 << self._level) == 0

    def _change(self) -> tuple[int, int, complex, float] | None:
        """Groups before the change, the line with the clearest one, its share of the response, and sigma of that."""
        if has_moved(self._schedule):
            return None
        groups, size = self._windows >> self._level, 1 << self._level
        means = scaled(self._sums[:groups], 1 / size)
        before = np.arange(2, groups - 1)[:, np.newaxis]
        total = np.cumsum(means, axis=0)
        first = scaled(total[1:-2], 1 / before)
        second = scaled(total[-1] - total[1:-2], 1 / (groups - before))
        apart, squares = second - first, np.cumsum(power(means), axis=0)[-1]
        dof = groups - 2
        with np.errstate(all="ignore"):
            value = magnitude(divided(self._reference[0], self._reference[1]))
            rest = (squares - before * power(first) - (groups - before) * power(second)) / dof
            steps = self._steps / (2 * (self._windows - 1) * size) + (_SMALLEST * value) ** 2
            variance = np.maximum(rest, steps) * (1 / before + 1 / (groups - before))
            log_chance = -dof * np.log1p(power(apart) / variance / dof)
        log_chance = np.where(np.isfinite(log_chance), log_chance, 0.0)
        limit = np.log(FALSE_ALARM / 2 / _TESTS / len(before))
        together = log_sum_exceeded(log_chance.shape[1], -log_chance.sum(axis=1))
        most = np.minimum(log_chance.min(axis=1) + np.log(log_chance.shape[1]), together)
        boundary = int(np.argmin(most))
        if most[boundary] > limit:
            return None
        line = int(np.argmin(log_chance[boundary]))
        sigma = float(np.sqrt(variance[boundary, line]) / value[line])
        return int(before[boundary, 0]), line, complex(apart[boundary, line] / value[line]), sigma

    def _report(self, sample: int, time_s: float, boundary: int, line: int, share: complex, sigma: float) -> None:
        message = Message(
            "the machine changes: at {line_hz:g} Hz the response since {since_s:.1f} s differs by {percent:.2g} % ± "
            "{bound_percent:.2g} % from the one before; sigma of an average contains the change",
            line_hz=float(self._lines.frequency_hz[line]),
            percent=100 * abs(share),
            bound_percent=100 * INTERVAL_FACTOR * sigma,
            since_s=float(self._ends[boundary - 1]),
        )
        self._events.append(Event("response-changes", sample, time_s, message))


def window_errors(reference: Complex, pair: Complex) -> Complex:
    """Changes of the response in windows, to first order: (numerator − Ĝ·denominator)/denominator of the reference."""
    with np.errstate(all="ignore"):
        error = divided(pair[0] - times(divided(reference[0], reference[1]), pair[1]), reference[1])
    return np.where(np.isfinite(error), error, 0.0)
