"""Sequential detection of changes relative to a Table: which lines, or which parameters."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import Event, Stage, StatefulBase
from livebode.monitoring.charts import Charts
from livebode.monitoring.false_alarms import threshold
from livebode.monitoring.newest_rows import NewestRows
from livebode.monitoring.noise_level import NoiseLevel
from livebode.monitoring.rows import WindowRows
from livebode.monitoring.table import ScheduleTable
from livebode.monitoring.table_sentences import cleared, differs, unknown

Floats = NDArray[np.float64]

_LOOK_WINDOWS = 10  # rows between detection and report, so that all changes are visible
_KEPT = 600  # rows, over which the amount of a change is taken at most
_CONFIDENCE = 1.96
_CHANGED_FROM = 3.0  # standard deviations, from which on a component counts among what changed


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

    _stage = Stage("table-monitor", 1)
    _STATE = ("_charts", "_noise", "_standing", "_seen_in", "judged", "_found", "_told_unknown")

    def __init__(self, table: ScheduleTable, mean_s: float, step_s: float) -> None:
        self._table = table
        size = table.accuracy.smallest.size
        self._charts = Charts(table.accuracy.smallest, table.accuracy.allowed, threshold(mean_s, step_s, 2 * size))
        self._noise = NoiseLevel(size, 2 if table.what == "lines" else 1)
        self.judged = 0
        """Rows judged so far."""
        self._told_unknown = False
        self._standing = np.zeros(size, dtype=bool)
        self._seen_in = np.zeros(table.count.size, dtype=bool)
        self._found = -1
        self._newest = np.full(size, np.nan)
        # Since a sum left zero, of every row: score, information, and schedule, sample, time and cell.
        self._score, self._information = NewestRows(size, _KEPT), NewestRows(size, _KEPT)
        self._moment = NewestRows(4, _KEPT)

    def newest(self, component: int) -> float:
        """Relative deviation of a component in the newest judged row; NaN before the first one."""
        return float(self._newest[component])

    def _forget(self) -> None:
        for rows in self._rows().values():
            rows.clear()

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
        information = 1 / variance / self._table.accuracy.inflation
        score = np.where(information > 0, deviation, 0.0) * information
        events: list[Event] = []
        for i in np.flatnonzero(rows.ok):
            moment = (float(rows.schedule[i]), int(rows.sample[i]), float(rows.time_s[i]))
            if known[i]:
                events += self._row(score[i], information[i], (*moment, float(cell[i])))
            elif not self._told_unknown:
                self._told_unknown = True
                events.append(unknown(*moment))
        return events

    def finish(self) -> list[Event]:
        """An alarm that is not reported yet."""
        if self._found < 0 or not len(self._moment.array):
            return []
        return self._changes()

    def _row(self, score: Floats, information: Floats, moment: tuple[float, int, float, float]) -> list[Event]:
        self.judged += 1
        if self.standing and not self._seen_in[int(moment[3])]:
            return []
        self._charts.step(score, information, self.judged)
        if self.standing:
            if np.any(self._charts.sums[:, self._standing] > 0):
                return []
            self._standing[:] = False
            self._charts.reset()
            return [cleared(self._table, moment[1], moment[2])]
        if self._found < 0 and not self._charts.sums.any():
            self._forget()
            return []
        self._score.append(score)
        self._information.append(information)
        self._moment.append(moment)
        if self._found < 0 and self._charts.alarmed:
            self._found = self.judged
        return self._changes() if 0 <= self._found <= self.judged - _LOOK_WINDOWS else []

    def _changes(self) -> list[Event]:
        raised = self._charts.sums >= self._charts.threshold
        scores, informations, moments = self._score.array, self._information.array, self._moment.array
        first = _began(scores, informations, np.asarray(raised.any(axis=0)))
        # The window in which the change occurs contains a part of it; the amount is from the windows after it.
        whole = min(first + 1, len(moments) - 1)
        score, information = scores[whole:].sum(axis=0), informations[whole:].sum(axis=0)
        accuracy = self._table.accuracy
        seen = information > 0
        amount = np.where(seen, score / np.where(seen, information, 1.0), 0.0)
        sigma = np.where(seen, np.hypot(1 / np.sqrt(np.where(seen, information, 1.0)), accuracy.scatter), np.inf)
        changed = (np.abs(amount) >= np.maximum(_CHANGED_FROM * sigma, accuracy.smallest / 2)) | raised.any(axis=0)
        self._standing, self._found = changed, -1
        if not changed.any():  # the sum that raised it decreased again before the report
            self._forget()
            return []
        moment = moments[first:]
        self._seen_in[:] = False
        self._seen_in[moment[:, 3].astype(int)] = True
        event = differs(self._table, changed, amount, _CONFIDENCE * sigma, moment)
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
    raised = raised if raised.any() else np.ones_like(raised)
    total, known = (np.cumsum(x[::-1, raised], axis=0)[::-1] for x in (score, information))
    evidence = np.where(known > 0, total**2 / (2 * np.where(known > 0, known, 1.0)), 0.0)
    return int(np.argmax(evidence.sum(axis=1)))
