"""Sequential detection of changes relative to a learned Machine: samples in, Events out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from livebode.arrays import Floats
from livebode.core import Block, Event, Lines, Stage, StatefulBase
from livebode.language import Message
from livebode.monitoring import evidence as word
from livebode.monitoring.accuracy import ChangeAccuracy, information_needed
from livebode.monitoring.alarms import ActiveAlarms, Alarm, RecentWindows
from livebode.monitoring.between_runs import RunOffset
from livebode.monitoring.change_date import ChangeDate, date_of, independent, rows_of
from livebode.monitoring.charts import Charts, threshold
from livebode.monitoring.evidence import Evidence
from livebode.monitoring.machine import LearnedMachine
from livebode.monitoring.model_evidence import ModelEvidence
from livebode.monitoring.monitored_time import WEAK, MonitoredTime, PassedPlaces
from livebode.monitoring.naming import NamedChange, ScoredWindows, begin_of, candidates, far, lead
from livebode.monitoring.sensitivity import DIRECTIONS, Offset
from livebode.monitoring.sentences import (
    about,
    about_far,
    changed,
    cleared,
    corrected,
    far_away,
    joint,
    offset_unknown,
    unknown,
)
from livebode.monitoring.stretches import Stretches, WindowStretch

CHARTS = 2 * len(DIRECTIONS) + 2
"""Charts that take a step with a window: up and down for each direction, and for stiffness in the cart's cell."""

_DECISIVE = 7.0  # nats between the likeliest change and the next: wrong once in a thousand
_LOOK_WINDOWS = 600  # windows after which a change is identified as the likeliest one
_OFTEN, _SELDOM = 40, 10  # windows during which every one, and then every tenth, is an occasion to name it
_LEFT_WINDOWS = 300  # of motion elsewhere, after which a cell's chart no longer prevents the update of the run's offset
_LOOK = 0.22  # of the travel: a change is local only if the rest is unchanged, so this must be observed
_PASSED = 2.0  # standard deviations of a place, after which its centre is known
_STIFFNESS = DIRECTIONS.index("stiffness")
_SMALL = 0.5  # of the smallest change for an alarm: less is no change
_STAYS = {word.SLOW, word.UNEVEN, word.DISTURBED, word.UNEXCITED}

Moment = tuple[float, float, float]
"""Position, newest sample and time of a window."""


class MachineDetector(StatefulBase):
    """Evidence in, Events out: what changed, by how much, since when, where.

    Every direction has a CUSUM up and one down, with all others fixed at the baseline, which detects a change soonest;
    so has the stiffness of each of 28 cells of the travel, over all passes. When one reaches the threshold, the single
    change that best explains the windows since it left zero is determined: a direction, or a place of changed
    stiffness. It is identified when its lead is 7 nats, its size is half of the smallest change for an alarm, and the
    cart has moved a fifth of its travel; or after 600 windows, if its size is at least that smallest change. It is
    reported as soon as the model follows it. While a change is active, others are judged with this change free, so
    with less accuracy. It is cleared when its own sum is back at zero.

    Parameters
    ----------
    machine
        The learned machine.
    threshold
        See `false_alarms.threshold`, for `CHARTS` charts.
    """

    _stage = Stage("machine-detector", 2)
    _STATE = (
        "_first", "_further", "_cells", "standing", "_own", "_recent", "_pending", "_taken", "_far", "_passed",
        "_healthy_from", "time", "places",
    )  # fmt: skip

    def __init__(self, machine: LearnedMachine, threshold: float) -> None:
        held, free, size = machine.held, machine.free, len(machine.windows)
        self._machine = machine
        self._first = Charts(held.smallest, held.allowed, threshold)
        self._further = Charts(free.smallest, free.allowed, threshold)
        self._cells = Charts(np.repeat(held.smallest[:1], size), np.repeat(held.allowed[:1], size), threshold)
        self.standing = ActiveAlarms(machine, threshold)
        self._own = RunOffset(machine.between, held, threshold)
        self._recent = RecentWindows(_LOOK_WINDOWS)
        self._passed = np.full(size, -1)  # mark of the newest window in each cell
        self._pending, self._taken = -1, 0
        self._healthy_from = 0  # mark of the first window after the newest change has disappeared
        self._unknown: set[str] = set()
        self._far = False
        self.time = MonitoredTime(DIRECTIONS, machine.information, held, threshold)
        self.places = PassedPlaces(machine, float(self.time.needed[_STIFFNESS]))
        self._needed_further = information_needed(machine.information, free, threshold)

    @property
    def judged(self) -> int:
        """Windows judged so far, in time that is monitored."""
        return self.time.judged

    @property
    def offset(self) -> Offset:
        """Offset of the model: the active changes, and this run's own offset."""
        standing = self.standing.offset
        return Offset(standing.logarithms + self._own.replayed, standing.places)

    def process(self, seen: Evidence) -> list[Event]:
        """Events of these windows, whose evidence was computed with the present `offset`."""
        events: list[Event] = []
        around = seen.score + seen.information @ self.offset.logarithms
        for i, status in enumerate(seen.status.tolist()):
            if status == word.JUDGED:
                events += self._window(seen, i, around[i])
                continue
            events += self.time.step(None, status, int(seen.sample[i]), float(seen.time_s[i]))
            if status not in _STAYS and status not in self._unknown:
                self._unknown.add(status)
                events.append(unknown(self._machine, seen, i))
        self.standing.settle()
        self._own.settle(self._oldest(), idle=self._pending < 0 and not self.standing.alarms)
        sample, time_s = int(seen.sample[-1]), float(seen.time_s[-1])
        if self._own.unreachable and word.OFFSET not in self._unknown:
            self._unknown.add(word.OFFSET)
            events.append(offset_unknown(self._machine, self._own.error_reachable, sample, time_s))
        return events + self._new_events(sample, time_s)

    def finish(self) -> list[Event]:
        """Identify a change that was found but not yet identified as the likeliest one."""
        if self._pending >= 0:
            self._name(final=True)
        _, sample, time_s = self._recent.moment[-1] if self._recent.moment else (0.0, 0.0, 0.0)
        return self._new_events(int(sample), time_s, known=False) + self.time.finish() + self.places.finish()

    def _new_events(self, sample: int, time_s: float, known: bool = True) -> list[Event]:
        """Events of new changes, and corrections of the reported amounts."""
        if self._far:
            self._far = False
            return [far_away(self.standing.alarms[-1], sample, time_s)]
        new = self.standing.announced(known)
        wrong = self.standing.corrected() if new and known else []
        events = [changed(a, sample, time_s, within_run=self.within_run(a)) for a in new]
        return events + [corrected(a, reported, sample, time_s, within_run=self.within_run(a)) for a, reported in wrong]

    def within_run(self, alarm: Alarm) -> bool:
        """Whether its amount is relative to the earlier part of this run, not to the baseline."""
        return self._own.within_run(alarm.change.direction)

    def _window(self, seen: Evidence, i: int, around: Floats) -> list[Event]:
        """Events of a judged window; `around` is its score around the baseline."""
        position_m, sample, time_s = float(seen.position_m[i]), int(seen.sample[i]), float(seen.time_s[i])
        known = seen.information[i]
        score, information = around - known @ self._reference.logarithms, known
        if not self._own.known:
            score, information = (part[0] for part in self._own.judged(score[np.newaxis], known[np.newaxis]))
        gone = self.standing.step(score, information, position_m)
        if gone:
            self._reset()
            self._healthy_from = self._taken
        events = [cleared(alarm, sample, time_s, within_run=self.within_run(alarm)) for alarm in gone]
        hidden = self.standing.hides(position_m)
        share = np.zeros(len(known)) if hidden else self._share(information, position_m)
        events += self.time.step(share, WEAK, sample, time_s)
        if hidden:
            return events
        here = self._machine.cell(position_m)
        events += self.places.step(here, float(information[_STIFFNESS, _STIFFNESS]), sample, time_s)
        mark, self._taken = self._taken, self._taken + 1
        self._recent.add(around, known, (position_m, float(sample), time_s))
        if not self.standing.alarms:
            self._own.step(around, known, mark, time_s)
        if self.standing.directions:
            remaining = ScoredWindows(score[np.newaxis], information[np.newaxis], np.array([position_m]))
            remaining = remaining.without(self.standing.directions)
            inflation = self._machine.free.inflation
            self._further.step(remaining.score[0] / inflation, np.diagonal(remaining.information[0]) / inflation, mark)
        else:
            inflation = self._machine.held.inflation
            score, information = score / inflation, information.diagonal() / inflation
            self._first.step(score, information, mark)
            self._passed[here] = mark
            self._cells.step_one(here, float(score[_STIFFNESS]), float(information[_STIFFNESS]), mark)
        self._look()
        return events

    def _share(self, information: Floats, position_m: float) -> Floats:
        """Information of a window as a share of what a stretch needs; an active change is followed, and needs none."""
        active = self.standing.directions
        if not active:
            return np.asarray(information.diagonal() / self.time.needed)
        window = ScoredWindows(np.zeros((1, len(information))), information[np.newaxis], np.array([position_m]))
        share = window.without(active).information[0].diagonal() / self._needed_further
        share[active] = np.inf
        return np.asarray(share)

    @property
    def _reference(self) -> Offset:
        """The reference of the evidence."""
        return Offset(self.standing.offset.logarithms + self._own.reference)

    def _look(self) -> None:
        """Identify the change that the charts have found, if any."""
        if self._pending < 0:
            begun = [c.since[c.raised] for c in (self._first, self._further, self._cells) if c.alarmed]
            if self._own.chart.alarmed:
                self._own.fix()
                begun.append(self._own.chart.since[self._own.chart.raised])
            if not begun:
                return
            self._pending = int(np.concatenate(begun).min())
        waited = self._taken - self._pending
        if waited <= _OFTEN or waited % _SELDOM == 0:
            self._name(final=waited >= _LOOK_WINDOWS)

    def _name(self, final: bool) -> None:
        first = max(self._pending - self._taken, -len(self._recent))
        moments, standing = self._recent.moment[first:], self.standing.directions
        beyond = self._recent.segment(first, self._reference)
        segment = self._own.segment(beyond).without(standing)
        known = self._accuracy
        changes = candidates(segment, known, self._machine.way_m, local=not standing)
        best = changes[0]
        if (several := [] if standing else far(segment, best, known)) and self._gone_around(segment):
            self._reset()
            self._stand(several, None, segment, moments)
            self._far = True
            return
        rivals = [c for c in changes[1:] if lead(segment, best, c, self._machine.free) < _DECISIVE]
        large = abs(best.amount) >= (1.0 if final else _SMALL) * known.smallest[best.direction]
        if not final and (rivals or not large or not self._seen_around(segment, best)):
            return
        self._reset()
        if large:
            self._stand([best], rivals[0] if rivals else None, segment, moments)

    def _stand(
        self, changes: list[NamedChange], rival: NamedChange | None, segment: ScoredWindows, moments: list[Moment]
    ) -> None:
        """Make these changes active, since the likeliest of them began."""
        likeliest = max(changes, key=lambda change: change.evidence)
        began, date = begin_of(segment, likeliest), self._date(None if len(changes) > 1 else likeliest)
        way = segment.position_m[began:]
        seen = self._own.segment(self._recent.segment(began - len(moments), Offset(self._own.reference)))
        for change in changes:
            self.standing.add(change, rival, date, (float(way.min()), float(way.max())), seen)

    @property
    def _accuracy(self) -> ChangeAccuracy:
        return self._machine.free if self.standing.directions else self._machine.held

    def _date(self, change: NamedChange | None) -> ChangeDate:
        """When the change began, by all windows that are remembered; None: a change of every direction."""
        first = max(self._healthy_from - self._taken, -len(self._recent))
        moments, known = self._recent.moment[first:], self._accuracy
        seen = self._own.segment(self._recent.segment(first, self._reference)).without(self.standing.directions)
        if change is None:
            score, information = independent(seen.score, seen.information)
            scatter, inflation = np.zeros(len(DIRECTIONS)), float(known.inflation.max())
        else:
            share, j = change.share(seen.position_m), change.direction
            score, information = (
                (share * seen.score[:, j])[:, np.newaxis],
                (share**2 * seen.information[:, j, j])[:, np.newaxis],
            )
            scatter, inflation = known.scatter[[j]], float(known.inflation[j])
        time_s = np.array([time_s for _, _, time_s in moments])
        rows = rows_of(score, information, time_s, scatter, inflation)
        remembered = self._healthy_from > 0 and first == self._healthy_from - self._taken
        return date_of(rows, time_s, [int(sample) for _, sample, _ in moments], healthy_before=remembered)

    def _gone_around(self, segment: ScoredWindows) -> bool:
        return bool(np.ptp(segment.position_m) >= _LOOK * self._machine.way_m)

    def _seen_around(self, segment: ScoredWindows, best: NamedChange) -> bool:
        if not self._gone_around(segment):
            return False
        behind = abs(float(segment.position_m[-1]) - best.place.centre_m) if best.place else np.inf
        return best.place is None or behind > _PASSED * best.place.width_m

    def _reset(self) -> None:
        self._first.reset()
        self._further.reset()
        self._cells.reset()
        self._own.chart.reset()
        self._pending = -1

    def _oldest(self) -> int:
        """Mark of the first window since which a chart is not at zero: a change may have begun there.

        The chart of a cell that the cart left long ago is ignored, because nothing updates it.
        """
        visited = (self._cells.sums > 0) & (self._passed > self._taken - _LEFT_WINDOWS)
        since = np.concatenate([self._first.since[self._first.sums > 0], self._cells.since[visited]])
        return int(since.min(initial=self._taken))

    def _state(self) -> dict[str, Any]:
        return super()._state() | {"unknown": sorted(self._unknown)}

    def _load(self, state: dict[str, Any]) -> None:
        super()._load(state)
        self._unknown = {str(name) for name in state["unknown"]}

    def _parts(self) -> dict[str, Any]:
        charts = {"first": self._first, "further": self._further, "cells": self._cells}
        return charts | {"recent": self._recent, "standing": self.standing, "own": self._own}


Look = Callable[[Evidence], object]


class MachineMonitor(StatefulBase):
    """Judges every steady window of a recording by a learned Machine.

    Delay: an Event is given at the latest with the first sample of the twelfth window after the one that it refers to.
    The Events do not depend on how the samples are cut into Blocks.
    """

    _stage = Stage("machine-monitor", 1)
    _STATE = ("_stretches", "detector")

    def __init__(self, machine: LearnedMachine, lines: Lines, names: tuple[str, str, str], mean_s: float) -> None:
        self._stretches = Stretches((*names, *machine.covariates.names), lines.window, lines.rate_hz)
        self._evidence = ModelEvidence(machine, lines)
        charts = CHARTS + (2 if machine.between is not None else 0)
        self.detector = MachineDetector(machine, threshold(mean_s, lines.window / lines.rate_hz, charts))

    def process(self, block: Block, look: Look | None = None) -> list[Event]:
        """Events of the windows that this Block completes; LivebodeError where a channel is missing.

        `look` is called with the Evidence of every stretch, to show or record it.
        """
        return self._judged(self._stretches.process(block), look)

    def rest(self, look: Look | None = None) -> list[Event]:
        """Events of the remaining windows; the next Block starts again without history."""
        return self._judged(self._stretches.finish(), look)

    def finish(self, look: Look | None = None) -> list[Event]:
        """Events as those of `process`, and a change that was found but not yet separated from others."""
        return self.rest(look) + self.detector.finish()

    def standing(self) -> list[dict[str, Any]]:
        """Active changes as plain data."""
        alarms = self.detector.standing.alarms
        far = [about_far(alarms[-1])] if self.detector.standing.far else []
        return far + [about(alarm, within_run=self.detector.within_run(alarm)) for alarm in self._announced()]

    def together(self) -> list[Message]:
        """Their present amounts, estimated together; empty where none is known."""
        if self.detector.standing.far:
            return [Message("the machine is so far from the baseline that no amount can be given")]
        return joint(self._announced())

    def _announced(self) -> list[Alarm]:
        return [alarm for alarm in self.detector.standing.alarms if alarm.announced]

    def _judged(self, stretches: list[WindowStretch], look: Look | None) -> list[Event]:
        events: list[Event] = []
        for stretch in stretches:
            seen = self._evidence.process(stretch, self.detector.offset)
            if look is not None:
                look(seen)
            events += self.detector.process(seen)
        return events

    def _state(self) -> dict[str, Any]:
        return super()._state() | {"level": self._evidence.level}

    def _load(self, state: dict[str, Any]) -> None:
        super()._load(state)
        self._evidence.level = float(state["level"])
