"""Sequential detection of changes relative to a Table: which lines, which parameters, or only the noise."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import INTERVAL_FACTOR, Event, Stage, StatefulBase
from livebode.language import Message
from livebode.monitoring import evidence as word
from livebode.monitoring.change_date import date_of, rows_of
from livebode.monitoring.charts import Charts, threshold
from livebode.monitoring.evidence import PLACE
from livebode.monitoring.monitored_time import INVALID, THE_MACHINE, WEAK, MonitoredTime
from livebode.monitoring.sentences import differs, table_cleared, table_unknown
from livebode.monitoring.table import FRICTION, ORDERS, SECTIONS, ScheduleTable, WindowRows

_ROWS = 31  # fewer scatter so much that rows get too little variance where the noise has risen
_MEDIAN = 0.4549364  # of chi square with one degree of freedom
_BELIEVED = 3.0  # times the excess of the differences over the learned noise


class NoiseLevel(StatefulBase):
    """Limits the rows' own noise estimates by the differences of neighbouring rows.

    A response's sigma is from the scatter of periods. For some periods after a step of the machine it contains the
    step, so that rows after the step would weigh a hundredth of those before it. A step affects one difference of
    neighbouring rows; noise affects all. The median over the newest 31 rows and all components of a line shows only
    the noise. A row's noise beyond the learned one is limited to three times that median.

    Parameters
    ----------
    components
        Columns of a deviation.
    together
        Components of one line: 2, or 1 for a parameter.
    """

    _stage = Stage("noise-level", 1)
    _STATE = ("_before", "_squares")

    def __init__(self, components: int, together: int) -> None:
        self._together = together
        self._before = np.full((2, 1, components), np.nan)
        self._squares = np.full((_ROWS - 1, components), np.nan)

    def process(self, deviation: Floats, own: Floats, more: Floats) -> Floats:
        """Variance of rows from their deviation, the learned variance and their own excess, (rows, components)."""
        if not len(own):
            return own
        known = np.where(np.isfinite(own), own, np.nan)
        both = np.concatenate([self._before, np.stack([np.where(np.isfinite(own), deviation, np.nan), known])], axis=1)
        square = np.diff(both[0], axis=0) ** 2 / (both[1, 1:] + both[1, :-1])
        squares = np.concatenate([self._squares, square])
        self._before, self._squares = both[:, -1:], squares[len(square) :]
        newest = np.lib.stride_tricks.sliding_window_view(squares, _ROWS, axis=0)
        level = _median(newest.reshape(len(own), -1, self._together * _ROWS)) / _MEDIAN
        shown = np.repeat(np.maximum(level - 1.0, 0.0), self._together, axis=1)
        return np.asarray(own + np.minimum(more, np.nan_to_num(_BELIEVED * shown * known)))


def _median(values: Floats) -> Floats:
    """Median over the last axis of the known values; 0 where none is known."""
    count = np.isfinite(values).sum(axis=-1, keepdims=True)
    order = np.sort(values, axis=-1)  # NaN is sorted last
    middle = [np.take_along_axis(order, np.maximum(count - 1 + i, 0) // 2, axis=-1) for i in (0, 1)]
    return np.where(count > 0, (middle[0] + middle[1]) / 2, 0.0)[..., 0]


_FIRST = 16  # rows at first; then the memory grows by a quarter, so that each row is copied few times


class NewestRows:
    """Rows of equal length, of which at most `most` are retained.

    Examples
    --------
    >>> rows = NewestRows(columns=1, most=2)
    >>> for number in range(3):
    ...     rows.append(np.array([float(number)]))
    >>> rows.array
    array([[1.],
           [2.]])
    """

    def __init__(self, columns: int, most: int) -> None:
        self._most = most
        self._memory, self._begin, self._end = np.empty((_FIRST, columns)), 0, 0

    @property
    def array(self) -> Floats:
        """The rows, (rows, columns); valid until the next change."""
        return self._memory[self._begin : self._end]

    def append(self, row: Floats | tuple[float, ...]) -> None:
        """Add a row; the oldest one may be dropped."""
        if self._end == len(self._memory):
            self.fill(self.array)
        self._memory[self._end] = row
        self._end += 1
        self._begin = max(self._begin, self._end - self._most)

    def fill(self, rows: Floats) -> None:
        """Replace all rows by these, (rows, columns), with room for some more."""
        memory = np.empty((len(rows) + max(_FIRST, len(rows) // 4), self._memory.shape[1]))
        memory[: len(rows)] = rows
        self._memory, self._begin, self._end = memory, 0, len(rows)

    def clear(self) -> None:
        """Drop all rows."""
        self._begin = self._end = 0


_LOOK_WINDOWS = 10  # rows between detection and report, so that all changes are visible
_LOOK_SECTIONS = 2  # the same of friction and orders: the second one is the first that is whole
_KEPT = 600  # rows, over which the amount of a change is taken at most
_CHANGED_FROM = 3.0  # standard deviations, from which on a component counts among what changed


_WHOLE = {FRICTION: Message("the friction"), ORDERS: Message("the orders")}


class TableMonitor(StatefulBase):
    """Every component of a Table has a CUSUM up and one down; one that reaches the threshold raises an alarm for all.

    The alarm names each component that differs by three standard deviations and half of the smallest change, with
    its amount since the first of them began, and the part of the schedule where it was seen. It clears when every
    sum of the named components is back at zero, from rows in the cells where it was seen. A row in a cell that was
    not learned is not judged.

    Parameters
    ----------
    table
        The learned table.
    mean_s, step_s
        Mean time between false alarms, and between rows, s.
    """

    _stage = Stage("table-monitor", 2)
    _STATE = (
        "_charts", "_noise", "_standing", "_seen_in", "_rows_judged", "_found", "_told_unknown", "_cleared", "time",
    )  # fmt: skip

    def __init__(self, table: ScheduleTable, mean_s: float, step_s: float) -> None:
        self._table = table
        size = table.accuracy.smallest.size
        height = threshold(mean_s, step_s, 2 * size)
        self._charts = Charts(table.accuracy.smallest, table.accuracy.allowed, height)
        sections = table.what in SECTIONS
        self.time = MonitoredTime(
            table.components, table.information, table.accuracy, height, _WHOLE.get(table.what, THE_MACHINE)
        )
        self._look, self._invalid = (_LOOK_SECTIONS, word.SLOW) if sections else (_LOOK_WINDOWS, INVALID)
        self._noise = NoiseLevel(size, 2 if table.what == "lines" else 1)
        self._rows_judged = 0
        self._told_unknown = self._cleared = False
        self._standing = np.zeros(size, dtype=bool)
        self._seen_in = np.zeros(table.count.size, dtype=bool)
        self._found = -1
        self._newest = np.full(size, np.nan)
        # Of the newest rows, since a change was reported: score, information, and schedule, sample, time and cell.
        self._score, self._information = NewestRows(size, _KEPT), NewestRows(size, _KEPT)
        self._moment = NewestRows(4, _KEPT)

    def newest(self, component: int) -> float:
        """Relative deviation of a component in the newest judged row; NaN before the first one."""
        return float(self._newest[component])

    def _forget(self) -> None:
        for rows in self._rows().values():
            rows.clear()

    @property
    def judged(self) -> int:
        """Rows judged so far, in time that is monitored."""
        return self.time.judged

    @property
    def standing(self) -> bool:
        """Whether an alarm is active."""
        return bool(self._standing.any())

    def process(self, rows: WindowRows) -> list[Event]:
        """Events of these rows."""
        cell, known = self._table.place(rows)
        deviation, own, more = self._table.deviation_parts(rows, cell)
        judged = np.flatnonzero(rows.ok & known)
        if judged.size:
            self._newest = deviation[judged[-1]]
        variance = np.full(own.shape, np.inf)
        variance[judged] = self._noise.process(deviation[judged], own[judged], more[judged])
        share = 1 / variance / self.time.needed
        information = 1 / variance / self._table.accuracy.inflation
        score = np.where(information > 0, deviation, 0.0) * information
        events: list[Event] = []
        for i, ok in enumerate(rows.ok):
            moment = (float(rows.schedule[i]), int(rows.sample[i]), float(rows.time_s[i]))
            reason = WEAK if ok and known[i] else PLACE if ok else self._invalid
            events += self.time.step(share[i] if reason == WEAK else None, reason, *moment[1:])
            if reason == WEAK:
                events += self._row(score[i], information[i], (*moment, float(cell[i])))
            elif ok and not self._told_unknown:
                self._told_unknown = True
                events.append(table_unknown(*moment))
        return events

    def finish(self) -> list[Event]:
        """An alarm that is not reported yet, and the last time that was not monitored."""
        events = self._changes() if self._found >= 0 and len(self._moment.array) else []
        return events + self.time.finish()

    def _row(self, score: Floats, information: Floats, moment: tuple[float, int, float, float]) -> list[Event]:
        self._rows_judged += 1
        if self.standing and not self._seen_in[int(moment[3])]:
            return []
        self._charts.step(score, information, self._rows_judged)
        if self.standing:
            if np.any(self._charts.sums[:, self._standing] > 0):
                return []
            self._standing[:] = False
            self._charts.reset()
            self._cleared = True
            return [table_cleared(self._table, moment[1], moment[2])]
        self._score.append(score)
        self._information.append(information)
        self._moment.append(moment)
        if self._found < 0 and self._charts.alarmed:
            self._found = self._rows_judged
        return self._changes() if 0 <= self._found <= self._rows_judged - self._look else []

    def _changes(self) -> list[Event]:
        raised = self._charts.sums >= self._charts.threshold
        scores, informations, moments = self._score.array, self._information.array, self._moment.array
        shown = np.asarray(raised.any(axis=0)) if raised.any() else np.ones(raised.shape[1], dtype=bool)
        first = _began(scores, informations, shown)
        # The window in which the change occurs contains a part of it; the amount is from the windows after it.
        whole = min(first + 1, len(moments) - 1)
        known = informations[whole:].any(axis=0)  # else the first row alone shows the component
        score, information = (
            np.where(known, rows[whole:].sum(axis=0), rows[first:].sum(axis=0)) for rows in (scores, informations)
        )
        accuracy = self._table.accuracy
        seen = information > 0
        amount = np.where(seen, score / np.where(seen, information, 1.0), 0.0)
        sigma = np.where(seen, np.hypot(1 / np.sqrt(np.where(seen, information, 1.0)), accuracy.scatter), np.inf)
        changed = (np.abs(amount) >= np.maximum(_CHANGED_FROM * sigma, accuracy.smallest / 2)) | raised.any(axis=0)
        changed &= seen
        self._standing, self._found = changed, -1
        if not changed.any():  # the sum that raised it decreased again before the report
            self._forget()
            return []
        moment = moments[first:]
        self._seen_in[:] = False
        self._seen_in[moment[:, 3].astype(int)] = True
        rows = rows_of(scores[:, shown], informations[:, shown], moments[:, 2], accuracy.scatter[shown])
        date = date_of(rows, moments[:, 2], moments[:, 1].astype(int).tolist(), healthy_before=self._cleared)
        event = differs(self._table, changed, amount, INTERVAL_FACTOR * sigma, moment, date)
        # A named component without a sum of its own gets one that keeps the alarm active.
        up = np.stack([amount > 0, amount <= 0]) & changed
        self._charts.sums = np.where(up, self._charts.threshold, 0.0)
        self._forget()
        return [event]

    def _state(self) -> dict[str, Any]:
        return super()._state() | {name: rows.array for name, rows in self._rows().items()}

    def _load(self, state: dict[str, Any]) -> None:
        super()._load(state)
        for name, rows in self._rows().items():
            rows.fill(state[name])

    def _rows(self) -> dict[str, NewestRows]:
        return {"score": self._score, "information": self._information, "moment": self._moment}


def _began(score: Floats, information: Floats, raised: NDArray[np.bool_]) -> int:
    """Row with which the change most likely began: since then the raised components' evidence is the largest.

    Over the rows since a moment a component's evidence is S²/(2I), with its amount at its likeliest, S/I.
    """
    total, known = (np.cumsum(x[::-1, raised], axis=0)[::-1] for x in (score, information))
    evidence = np.where(known > 0, total**2 / (2 * np.where(known > 0, known, 1.0)), 0.0)
    return int(np.argmax(evidence.sum(axis=1)))
