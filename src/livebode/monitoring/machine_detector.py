"""Sequential detection of changes against a learned Machine."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.monitoring import evidence as word
from livebode.monitoring.alarms import Alarm, Recent
from livebode.monitoring.charts import Charts
from livebode.monitoring.evidence import Evidence
from livebode.monitoring.machine import Machine
from livebode.monitoring.naming import Change, Segment, begin_of, candidates
from livebode.monitoring.sensitivity import DIRECTIONS
from livebode.monitoring.sentences import changed, cleared, unknown
from livebode.monitoring.standing import Standing
from livebode.nouns import Event

CHARTS = 2 * len(DIRECTIONS) + 2
"""That take a step with a window: up and down for each direction, and for stiffness in the cell where the cart is."""

_RECENT = 300
_DECISIVE = 7.0  # nats between the likeliest name and the next: wrong once in a thousand
_LOOK_WINDOWS = 120  # after so many a change is named by what is likeliest
_LOOK_M = 0.3  # a change is a place's only if the rest is not changed: so far one looks around
_PASSED = 2.0  # standard deviations of a place, behind which its middle is known
_STIFFNESS = DIRECTIONS.index("stiffness")
_SMALL = 0.25  # of the smallest change that an alarm is for: less is none
_STAYS = {word.SLOW, word.UNEVEN, word.DISTURBED}


class MachineDetector:
    """Evidence in, Events out: what changed, by how much, since when, where.

    Every direction has a CUSUM up and one down, with all others held at the baseline, which sees a change soonest; so
    has the stiffness of every cell of 5 cm, over all passes. When one reaches the threshold, the windows since it left
    zero are asked which single change they speak for: a direction, or a place of changed stiffness. The Event comes
    when the likeliest leads by 7 nats and the cart has gone 0.3 m, or after 120 windows. While a change stands, the
    others are judged with it allowed for, whatever its size, and as coarsely as is known of them then; it clears when its own sum is back at zero.

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
        self._recent = Recent(_RECENT)
        self._pending = -1
        self._unknown: set[str] = set()
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
        return events

    def finish(self) -> list[Event]:
        """A change that was found but not yet named, named by what is likeliest."""
        return self._named(final=True) if self._pending >= 0 else []

    def _window(self, seen: Evidence, i: int) -> list[Event]:
        position_m, score, information = float(seen.position_m[i]), seen.score[i], seen.information[i]
        sample, time_s = int(seen.sample[i]), float(seen.time_s[i])
        mark, self.judged = self.judged, self.judged + 1
        self._recent.add(score, information, (position_m, float(sample), time_s))
        gone = self.standing.step(score, information, position_m)
        if gone:
            self._reset()
        events = [cleared(alarm, sample, time_s) for alarm in gone]
        if self.standing.hides(position_m):
            return events
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
            self._cells.step(*(np.where(here, part[_STIFFNESS], 0.0) for part in (score, information)), mark)
        return events + self._look()

    def _look(self) -> list[Event]:
        """The change that the charts have found, once it has a name."""
        if self._pending < 0:
            found = [c.since[c.raised] for c in (self._first, self._further, self._cells) if c.raised.any()]
            if not found:
                return []
            self._pending = int(np.concatenate(found).min())
        return self._named(final=self.judged - self._pending >= _LOOK_WINDOWS)

    def _named(self, final: bool) -> list[Event]:
        first = max(self._pending - self.judged, -len(self._recent.moment))
        moments, standing = self._recent.moment[first:], self.standing.directions
        segment = self._recent.segment(first).without(standing)
        known = self._machine.free if standing else self._machine.held
        found = candidates(segment, known, local=not standing)
        found = [c for c in found if abs(c.amount) >= _SMALL * known.smallest[c.direction]]
        others = [c for c in found[1:] if found[0].evidence - c.evidence < _DECISIVE]
        if not final and (not found or others or not self._seen_around(segment, found[0])):
            return []
        self._reset()
        if not found:
            return []
        began = begin_of(segment, found[0])
        alarm = self.standing.add(found[0], int(moments[began][1]), moments[began][2])
        way = segment.position_m[began:]
        return [changed(alarm, others, (float(way.min()), float(way.max())), int(moments[-1][1]), moments[-1][2])]

    def _seen_around(self, segment: Segment, best: Change) -> bool:
        model, x = self._machine.model, segment.position_m
        if np.ptp(x) < min(_LOOK_M, (model.high_m - model.low_m) / 2):
            return False
        return best.place is None or abs(float(x[-1]) - best.place.centre_m) > _PASSED * best.place.width_m

    def _reset(self) -> None:
        self._first.reset()
        self._further.reset()
        self._cells.reset()
        self._pending = -1

    def state(self) -> dict[str, NDArray[Any]]:
        parts = {f"{name}.{key}": array for name, part in self._parts().items() for key, array in part.state().items()}
        numbers = np.array([self._pending, self.judged])
        return parts | {"numbers": numbers, "unknown": np.array(sorted(self._unknown), dtype="U16")}

    def load(self, state: dict[str, NDArray[Any]]) -> None:
        for name, part in self._parts().items():
            part.load({k.removeprefix(f"{name}."): v for k, v in state.items() if k.startswith(f"{name}.")})
        self._pending, self.judged = (int(n) for n in state["numbers"])
        self._unknown = {str(name) for name in state["unknown"]}

    def _parts(self) -> dict[str, Any]:
        charts = {"first": self._first, "further": self._further, "cells": self._cells}
        return charts | {"recent": self._recent, "standing": self.standing}
