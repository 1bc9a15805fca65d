"""Alarms of a machine's model: each with its change, and the active ones with their present amounts."""

from __future__ import annotations

from dataclasses import field, replace
from math import isnan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Stage, StatefulBase
from livebode.dataclass import dataclass
from livebode.monitoring.change_date import ChangeDate
from livebode.monitoring.machine import LearnedMachine
from livebode.monitoring.naming import NamedChange, ScoredWindows, bound
from livebode.monitoring.sensitivity import FAR, LocalChange, Offset


@dataclass
class Alarm:
    """An identified change that is still active.

    Attributes
    ----------
    change, rival
        The identified change, and another that explains it nearly as well (None without such a change).
    date
        Beginning of the change.
    way_m
        Range of the cart's positions while it was identified.
    now, bound
        Its amount over the newest windows, of the logarithm, and the half-width of its 95 % bound.
    height
        The sum that keeps it active, between 0 and the threshold: at 0 it is cleared.
    announced
        Whether its Event was given.
    reported, reported_bound
        Amount and bound of its newest Event.
    """

    change: NamedChange
    rival: NamedChange | None
    date: ChangeDate
    way_m: tuple[float, float]
    now: float
    bound: float
    height: float
    announced: bool = False
    score: float = 0.0
    information: float = 0.0
    reported: float = 0.0
    reported_bound: float = 0.0

    @property
    def needs_correction(self) -> bool:
        """Whether the amount now differs from the reported one by more than both bounds."""
        return self.announced and abs(self.now - self.reported) > self.bound + self.reported_bound

    def announce(self) -> Alarm:
        """The alarm itself, with its present amount recorded as reported."""
        if not self.announced:
            self.change = replace(self.change, amount=self.now)
        self.announced, self.reported, self.reported_bound = True, self.now, self.bound
        return self

    def row(self) -> list[float]:
        """Numbers of this alarm, for a snapshot."""
        earliest_s = np.nan if self.date.earliest_s is None else self.date.earliest_s
        date = [self.date.since_sample, self.date.since_s, earliest_s, self.date.latest_s]
        numbers = [*date, *self.way_m, self.now, self.bound, self.height, self.announced]
        sums = [self.score, self.information, self.reported, self.reported_bound]
        return [*_numbers(self.change), *_numbers(self.rival), *numbers, *sums]

    @classmethod
    def of(cls, row: NDArray[Any]) -> Alarm:
        """From a snapshot's numbers."""
        change, rival = _change(row[:_NUMBERS]), _change(row[_NUMBERS : 2 * _NUMBERS])
        assert change is not None
        sample, since_s, earliest_s, latest_s, *numbers = (float(n) for n in row[2 * _NUMBERS :])
        low, high, now, bound, height, announced, *sums = numbers
        date = ChangeDate(int(sample), since_s, None if isnan(earliest_s) else earliest_s, latest_s)
        return cls(change, rival, date, (low, high), now, bound, height, bool(announced), *sums)


_NUMBERS = 6


def _numbers(change: NamedChange | None) -> list[float]:
    if change is None:
        return [-1.0] * _NUMBERS
    place = change.place or LocalChange(np.nan, np.nan)
    return [change.direction, change.amount, change.bound, change.evidence, place.centre_m, place.width_m]


def _change(numbers: NDArray[Any]) -> NamedChange | None:
    direction, amount, bound, evidence, centre_m, width_m = (float(n) for n in numbers)
    place = LocalChange(centre_m, width_m) if np.isfinite(centre_m) else None
    return NamedChange(int(direction), amount, bound, evidence, place) if direction >= 0 else None


@dataclass
class RecentWindows(StatefulBase):
    """The newest windows, as many as an alarm may look back over; scores are of changes from the baseline."""

    _stage = Stage("recent-windows", 1)

    rows: int
    score: list[Floats] = field(default_factory=list)
    information: list[Floats] = field(default_factory=list)
    moment: list[tuple[float, float, float]] = field(default_factory=list)
    """Position, newest sample and time of each."""

    def add(self, score: Floats, information: Floats, moment: tuple[float, float, float]) -> None:
        """A window."""
        self.score.append(score)
        self.information.append(information)
        self.moment.append(moment)
        if len(self.moment) > 2 * self.rows:  # seldom, since it moves them
            del self.score[: -self.rows], self.information[: -self.rows], self.moment[: -self.rows]

    def __len__(self) -> int:
        return min(len(self.moment), self.rows)

    def segment(self, first: int, offset: Offset) -> ScoredWindows:
        """Windows from position `first` on, which counts from the end, as evidence of changes beyond the offset."""
        position_m = np.array([m[0] for m in self.moment[first:]])
        information = np.array(self.information[first:])
        return ScoredWindows(np.array(self.score[first:]) - information @ offset.logarithms, information, position_m)

    def _state(self) -> dict[str, Any]:
        return {name: np.array(getattr(self, name)[-self.rows :]) for name in ("score", "information", "moment")}

    def _load(self, state: dict[str, Any]) -> None:
        self.score, self.information = list(state["score"]), list(state["information"])
        self.moment = [(float(a), float(b), float(c)) for a, b, c in state["moment"]]


_MEMORY = 0.95  # per window, of a change's present size
_HELD_FROM = 0.25  # of the change when it was identified, or of the smallest if that is less: below, it is disappearing
_UNSEEN = 0.01  # of a change at a place: where its share is less, the rest of the travel is judged
_MOVING = 0.005  # of the offset, from one stretch to the next: the others wait until the model has converged
_MOST = 0.7  # of a logarithm: a factor of two


class ActiveAlarms(StatefulBase):
    """Alarms, with the resulting Offset of the model.

    The model follows the active changes, stretch by stretch, so that evidence remains small and a large change does
    not appear as an additional one (Gauss–Newton). Changes of directions are estimated together.
    """

    _stage = Stage("active-alarms", 2)
    _STATE = ("_score", "_information", "_moving")

    def __init__(self, machine: LearnedMachine, threshold: float) -> None:
        self._machine, self._threshold = machine, threshold
        self.alarms: list[Alarm] = []
        self.offset = Offset()
        self._moving = False
        self._forget()

    def _forget(self) -> None:
        n = len(self.offset.logarithms)
        self._score, self._information = np.zeros(n), np.zeros((n, n))

    @property
    def directions(self) -> list[int]:
        """Numbers of the directions with an active change along the whole travel."""
        return sorted({a.change.direction for a in self.alarms if a.change.place is None})

    @property
    def far(self) -> bool:
        """Whether the model does not yet follow a machine that differs in more than one direction."""
        return sum(not a.announced for a in self.alarms) > 1

    def hides(self, position_m: float) -> bool:
        """Whether an active change prevents other judgements of a window at this position."""
        places = [a.change.place for a in self.alarms if a.change.place is not None]
        return self._moving or any(_share(place, position_m) > _UNSEEN for place in places)

    def add(
        self,
        change: NamedChange,
        rival: NamedChange | None,
        date: ChangeDate,
        way_m: tuple[float, float],
        seen: ScoredWindows,
    ) -> None:
        """Add an identified change, with the windows since it began: their evidence of changes from the baseline."""
        alarm = Alarm(change, rival, date, way_m, change.amount, change.bound, self._threshold)
        alarm.information = 2 * change.evidence / change.amount**2
        alarm.score = change.amount * alarm.information
        if abs(change.amount) > FAR:  # the model does not follow it yet: a linear estimate from the baseline
            alarm.bound = float(np.hypot(alarm.bound, _neglected(np.array([change.amount]))))
        self.alarms.append(alarm)
        self._score, self._information = seen.score.sum(axis=0), seen.information.sum(axis=0)
        self._moving = True

    def announced(self, known: bool = True) -> list[Alarm]:
        """Alarms not yet reported whose amount is `known`; the amount at a place is known when it is next passed.

        An alarm whose amount vanishes once the model follows it is dropped.
        """
        new = [a for a in self.alarms if not a.announced]
        if self.far and (not known or any(abs(a.now) == _MOST for a in new)):
            return []
        new = [a.announce() for a in new if not known or a.change.place is not None or not self._moving]
        nothing = [a for a in new if abs(a.now) <= max(a.bound, self._middle(a))]
        self.alarms = [a for a in self.alarms if not any(a is n for n in nothing)]
        return [a for a in new if not any(a is n for n in nothing)]

    def corrected(self) -> list[tuple[Alarm, float]]:
        """Reported alarms whose amount is wrong now that the others are identified, with the reported amount."""
        wrong = [(a, a.reported) for a in self.alarms if a.change.place is None and a.needs_correction]
        return [(alarm.announce(), reported) for alarm, reported in wrong]

    def step(self, score: Floats, information: Floats, position_m: float) -> list[Alarm]:
        """Process a window; returns the alarms that it ends."""
        if not self.alarms:
            return []
        hidden = any(_share(p, position_m) > _UNSEEN for p in self.offset.places)
        if not hidden:
            self._score = _MEMORY * self._score + score + information @ self.offset.logarithms
            self._information = _MEMORY * self._information + information
        gone = [a for a in self.alarms if self._gone(a, score, information, position_m, hidden)]
        self.alarms = [a for a in self.alarms if not any(a is g for g in gone)]
        return gone

    def _gone(self, alarm: Alarm, score: Floats, information: Floats, position_m: float, hidden: bool) -> bool:
        change, j = alarm.change, alarm.change.direction
        share = 1.0 if change.place is None else _share(change.place, position_m)
        if not alarm.announced or (change.place is None and hidden) or share <= _UNSEEN:
            return False
        amount = self._amount(alarm)
        # Compared with a machine without this change, with the others at their present amounts.
        i = share**2 * information[j, j]
        s = share * score[j] + i * amount
        if change.place is not None:
            alarm.score, alarm.information = _MEMORY * alarm.score + s, _MEMORY * alarm.information + i
        ratio = self._size(alarm) * (np.sign(change.amount) * s - self._middle(alarm) * i)
        ratio /= self._machine.held.inflation[j]
        alarm.height = min(max(float(alarm.height + ratio), 0.0), self._threshold)
        return alarm.height == 0.0

    def _size(self, alarm: Alarm) -> float:
        return min(abs(alarm.change.amount), float(self._machine.held.smallest[alarm.change.direction]))

    def _middle(self, alarm: Alarm) -> float:
        """Log-likelihood ratio between an active alarm and one that has disappeared."""
        return max(_HELD_FROM * self._size(alarm), float(self._machine.held.allowed[alarm.change.direction]))

    def _amount(self, alarm: Alarm) -> float:
        """The part of the offset that belongs to this alarm."""
        if alarm.change.place is None:
            return float(self.offset.logarithms[alarm.change.direction])
        return next((p.amount for p in self.offset.places if _same(p, alarm.change.place)), 0.0)

    def settle(self) -> None:
        """At a stretch's end: update the model to the active changes."""
        before, places = self.offset, []
        logarithms = self._directions_now()
        for alarm in self.alarms:
            if alarm.change.place is not None:
                if alarm.information > 0:
                    alarm.now = float(np.clip(alarm.score / alarm.information, -_MOST, _MOST))
                places.append(replace(alarm.change.place, amount=alarm.now))
        self.offset = Offset(logarithms, tuple(places))
        centres = np.array([p.centre_m for p in places])
        local = np.abs(self.offset.stiffness(centres) - before.stiffness(centres)).max() if places else 0.0
        moved = np.abs(logarithms - before.logarithms).max()
        self._moving = bool(max(local, moved) > _MOVING)
        if moved > _MOVING:  # evidence around the old offset would pull the new one back
            self._forget()

    def _directions_now(self) -> Floats:
        """Amounts of the active directions, estimated together, with their bounds."""
        known, logarithms = self.directions, np.zeros_like(self.offset.logarithms)
        inside = self._information[np.ix_(known, known)]
        if known and np.all(np.diagonal(inside) > 0):
            covariance = np.linalg.inv(inside)
            amounts = covariance @ self._score[known]
            step = self._all_free() - self.offset.logarithms
            for i, j in enumerate(known):
                accuracy = self._machine.held if len(known) == 1 else self._machine.free
                for alarm in (a for a in self.alarms if a.change.direction == j and a.change.place is None):
                    alarm.now = float(np.clip(amounts[i], -_MOST, _MOST))
                    alarm.bound = bound(accuracy, j, 1 / covariance[i, i])
                    if abs(alarm.now) > FAR:
                        alarm.bound = float(np.linalg.norm([alarm.bound, step[j], _neglected(step)]))
        for alarm in self.alarms:
            if alarm.change.place is None:
                logarithms[alarm.change.direction] = alarm.now
        return logarithms

    def _all_free(self) -> Floats:
        """Amount of every direction if none were fixed at the baseline, by the model at its present offset."""
        return np.asarray(np.linalg.lstsq(self._information, self._score, rcond=None)[0])

    def _state(self) -> dict[str, Any]:
        places = [[p.centre_m, p.width_m, p.amount] for p in self.offset.places]
        own = {"logarithms": self.offset.logarithms, "places": places}
        return super()._state() | own | {"alarms": np.array([alarm.row() for alarm in self.alarms])}

    def _load(self, state: dict[str, Any]) -> None:
        super()._load(state)
        self.alarms = [Alarm.of(row) for row in state["alarms"]]
        self.offset = Offset(state["logarithms"], tuple(LocalChange(*map(float, row)) for row in state["places"]))


def _neglected(step: Floats) -> float:
    """Error of a linear model for a change of this size, of second order in its largest part."""
    return float(np.abs(step).clip(0.0, _MOST).max() ** 2 / 2)


def _share(place: LocalChange, position_m: float) -> float:
    return float(place.share(np.array([position_m]))[0])


def _same(first: LocalChange, second: LocalChange) -> bool:
    return (first.centre_m, first.width_m) == (second.centre_m, second.width_m)
