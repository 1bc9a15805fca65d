"""Sequential detection of changes against a learned Machine."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.monitoring import evidence as word
from livebode.monitoring.alarms import Recent
from livebode.monitoring.charts import Charts
from livebode.monitoring.evidence import Evidence
from livebode.monitoring.machine import Machine
from livebode.monitoring.naming import Change, Segment, begin_of, candidates, far, lead
from livebode.monitoring.offset import Offset
from livebode.monitoring.sensitivity import DIRECTIONS
from livebode.monitoring.sentences import changed, cleared, corrected, far_away, unknown
from livebode.monitoring.standing import Standing
from livebode.nouns import Event

CHARTS = 2 * len(DIRECTIONS) + 2
"""That take a step with a window: up and down for each direction, and for stiffness in the cell where the cart is."""

_DECISIVE = 7.0  # nats between the likeliest name and the next: wrong once in a thousand
_LOOK_WINDOWS = 600  # after so many a change is named by what is likeliest
_OFTEN, _SELDOM = 40, 10  # windows during which every one, and then every tenth, is an occasion to name it
_LOOK = 0.22  # of the way: a change is a place's only if the rest is not changed, so one looks around
_PASSED = 2.0  # standard deviations of a place, behind which its middle is known
_STIFFNESS = DIRECTIONS.index("stiffness")
_SMALL = 0.5  # of the smallest change that an alarm is for: less is none
_STAYS = {word.SLOW, word.UNEVEN, word.DISTURBED}

Moment = tuple[float, float, float]
"""Position, newest sample and time of a window."""


class MachineDetector:
    """Evidence in, Events out: what changed, by how much, since when, where.

    Every direction has a CUSUM up and one down, with all others held at the baseline, which sees a change soonest; so
    has the stiffness of each of 28 cells of the way, over all passes. When one reaches the threshold, the windows since
    it left zero are asked which single change they speak for: a direction, or a place of changed stiffness. It is named
    when the likeliest leads by 7 nats, is half as large as an alarm is for, and the cart has gone a fifth of its way;
    or after 600 windows, if it is as large as an alarm is for. It is told once the model has come along with it. While
    a change stands, others are judged with it allowed for, whatever its size, and as coarsely as is known of them then;
    it clears when its own sum is back at zero.

    Parameters
    ----------
    machine
        What was learned.
    threshold
        See `false_alarms.threshold`, for `CHARTS` charts.
    """

    def __init__(self, machine: Machine, threshold: float) -> None:
        held, free, size = machine.held, machine.free, len(machine.windows)
        self._machine = machine
        self._first = Charts(held.smallest, held.allowed, threshold)
        self._further = Charts(free.smallest, free.allowed, threshold)
        self._cells = Charts(np.repeat(held.smallest[:1], size), np.repeat(held.allowed[:1], size), threshold)
        self.standing = Standing(machine, threshold)
        self._recent = Recent(_LOOK_WINDOWS)
        self._pending, self._taken = -1, 0
        self._unknown: set[str] = set()
        self._far = False
        self.judged = 0
        """Windows judged so far."""

    def process(self, seen: Evidence) -> list[Event]:
        """Events of these windows, whose evidence was made with `standing.offset` as it is now."""
        events: list[Event] = []
        for i in range(len(seen)):
            status = str(seen.status[i])
            if status == word.JUDGED:
                events += self._window(seen, i)
            elif status not in _STAYS and status not in self._unknown:
                self._unknown.add(status)
                where, speed = float(seen.position_m[i]), float(seen.speed_m_per_s[i])
                events.append(unknown(status, self._machine, where, speed, int(seen.sample[i]), float(seen.time_s[i])))
        self.standing.settle()
        return events + self._said(int(seen.sample[-1]), float(seen.time_s[-1]))

    def finish(self) -> list[Event]:
        """A change that was found but not yet named, named by what is likeliest."""
        if self._pending >= 0:
            self._name(final=True)
        _, sample, time_s = self._recent.moment[-1] if self._recent.moment else (0.0, 0.0, 0.0)
        return self._said(int(sample), time_s, known=False)

    def _said(self, sample: int, time_s: float, known: bool = True) -> list[Event]:
        """What is new, and what it makes of the amounts that are out."""
        if self._far:
            self._far = False
            return [far_away(self.standing.alarms[-1], sample, time_s)]
        new = self.standing.announced(known)
        wrong = self.standing.corrected() if new and known else []
        return [changed(a, sample, time_s) for a in new] + [corrected(a, told, sample, time_s) for a, told in wrong]

    def _window(self, seen: Evidence, i: int) -> list[Event]:
        position_m, score, information = float(seen.position_m[i]), seen.score[i], seen.information[i]
        sample, time_s = int(seen.sample[i]), float(seen.time_s[i])
        self.judged += 1
        offset = self.standing.offset.logarithms
        gone = self.standing.step(score, information, position_m)
        if gone:
            self._reset()
        events = [cleared(alarm, sample, time_s) for alarm in gone]
        if self.standing.hides(position_m):
            return events
        mark, self._taken = self._taken, self._taken + 1
        self._recent.add(score + information @ offset, information, (position_m, float(sample), time_s))
        if self.standing.directions:
            rest = Segment(score[np.newaxis], information[np.newaxis], np.array([position_m]))
            rest = rest.without(self.standing.directions)
            inflation = self._machine.free.inflation
            self._further.step(rest.score[0] / inflation, np.diagonal(rest.information[0]) / inflation, mark)
        else:
            inflation = self._machine.held.inflation
            score, information = score / inflation, np.diagonal(information) / inflation
            self._first.step(score, information, mark)
            here = np.arange(len(self._machine.windows)) == self._machine.cell(position_m)
            self._cells.step(here * score[_STIFFNESS], here * information[_STIFFNESS], mark)
        self._look()
        return events

    def _look(self) -> None:
        """Name the change that the charts have found, if they have."""
        if self._pending < 0:
            found = [c.since[c.raised] for c in (self._first, self._further, self._cells) if c.raised.any()]
            if not found:
                return
            self._pending = int(np.concatenate(found).min())
        waited = self._taken - self._pending
        if waited <= _OFTEN or waited % _SELDOM == 0:
            self._name(final=waited >= _LOOK_WINDOWS)

    def _name(self, final: bool) -> None:
        first = max(self._pending - self._taken, -len(self._recent.moment))
        moments, standing = self._recent.moment[first:], self.standing.directions
        beyond = self._recent.segment(first, self.standing.offset)
        segment = beyond.without(standing)
        known = self._machine.free if standing else self._machine.held
        found = candidates(segment, known, self._machine.way_m, local=not standing)
        best = found[0]
        if (several := [] if standing else far(segment, best, known)) and self._gone_around(segment):
            self._reset()
            self._stand(several, None, segment, moments)
            self._far = True
            return
        rivals = [c for c in found[1:] if lead(segment, best, c, self._machine.free) < _DECISIVE]
        large = abs(best.amount) >= (1.0 if final else _SMALL) * known.smallest[best.direction]
        if not final and (rivals or not large or not self._seen_around(segment, best)):
            return
        self._reset()
        if large:
            self._stand([best], rivals[0] if rivals else None, segment, moments)

    def _stand(self, changes: list[Change], rival: Change | None, segment: Segment, moments: list[Moment]) -> None:
        """From now on these changes stand, since the likeliest of them began."""
        began = begin_of(segment, max(changes, key=lambda change: change.evidence))
        way = segment.position_m[began:]
        seen = self._recent.segment(began - len(moments), Offset())
        since = int(moments[began][1]), moments[began][2]
        for change in changes:
            self.standing.add(change, rival, since, (float(way.min()), float(way.max())), seen)

    def _gone_around(self, segment: Segment) -> bool:
        return bool(np.ptp(segment.position_m) >= _LOOK * self._machine.way_m)

    def _seen_around(self, segment: Segment, best: Change) -> bool:
        if not self._gone_around(segment):
            return False
        behind = abs(float(segment.position_m[-1]) - best.place.centre_m) if best.place else np.inf
        return best.place is None or behind > _PASSED * best.place.width_m

    def _reset(self) -> None:
        self._first.reset()
        self._further.reset()
        self._cells.reset()
        self._pending = -1

    def state(self) -> dict[str, NDArray[Any]]:
        parts = {f"{name}.{key}": array for name, part in self._parts().items() for key, array in part.state().items()}
        numbers = np.array([self._pending, self._taken, self.judged, self._far])
        return parts | {"numbers": numbers, "unknown": np.array(sorted(self._unknown), dtype="U16")}

    def load(self, state: dict[str, NDArray[Any]]) -> None:
        for name, part in self._parts().items():
            part.load({k.removeprefix(f"{name}."): v for k, v in state.items() if k.startswith(f"{name}.")})
        self._pending, self._taken, self.judged, far = (int(n) for n in state["numbers"])
        self._far = bool(far)
        self._unknown = {str(name) for name in state["unknown"]}

    def _parts(self) -> dict[str, Any]:
        charts = {"first": self._first, "further": self._further, "cells": self._cells}
        return charts | {"recent": self._recent, "standing": self.standing}
