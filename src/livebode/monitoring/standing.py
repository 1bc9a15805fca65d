"""The changes that stand: how large they are by now, and whether they have gone."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.monitoring.alarms import Alarm
from livebode.monitoring.machine import Machine
from livebode.monitoring.naming import Change, Segment, bound
from livebode.monitoring.offset import FAR, Offset, Place

Floats = NDArray[np.float64]

_MEMORY = 0.95  # per window, of a change's size by now
_HELD_FROM = 0.25  # of the change when it was named, or of the smallest if that is less: below it is on its way out
_UNSEEN = 0.01  # of a change at a place: where there is less, the rest of the way is judged
_MOVING = 0.005  # of the offset, from one stretch to the next: the others wait until the model has come along
_MOST = 0.7  # of a logarithm: a factor of two


class Standing:
    """Alarms, with the Offset that they make of the model.

    The model follows the changes that stand, stretch by stretch, so that evidence stays small and a large change does
    not look like another one besides (Gauss–Newton). Changes of directions are estimated together.
    """

    def __init__(self, machine: Machine, threshold: float) -> None:
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
        """Numbers of the directions that stand changed all along the way."""
        return sorted({a.change.direction for a in self.alarms if a.change.place is None})

    @property
    def far(self) -> bool:
        """Whether the model has not come along with a machine that differs in more than one direction."""
        return sum(not a.announced for a in self.alarms) > 1

    def hides(self, position_m: float) -> bool:
        """Whether what stands keeps a window there from being judged for anything else."""
        places = [a.change.place for a in self.alarms if a.change.place is not None]
        return self._moving or any(_share(place, position_m) > _UNSEEN for place in places)

    def add(
        self, change: Change, rival: Change | None, since: tuple[int, float], way_m: tuple[float, float], seen: Segment
    ) -> None:
        """A change that was named, with the windows since it began: their evidence of changes from the baseline."""
        alarm = Alarm(change, rival, *since, way_m, change.amount, change.bound, self._threshold)
        alarm.information = 2 * change.evidence / change.amount**2
        alarm.score = change.amount * alarm.information
        if abs(change.amount) > FAR:  # not told from a model that came along: as linear as it is from the baseline
            alarm.bound = float(np.hypot(alarm.bound, _neglected(np.array([change.amount]))))
        self.alarms.append(alarm)
        self._score, self._information = seen.score.sum(axis=0), seen.information.sum(axis=0)
        self._moving = True

    def announced(self, known: bool = True) -> list[Alarm]:
        """Alarms that were not out yet, and whose amount is `known`; that of a place is when it is next passed.

        One that comes to nothing once the model has come along is dropped.
        """
        new = [a for a in self.alarms if not a.announced]
        if self.far and (not known or any(abs(a.now) == _MOST for a in new)):
            return []
        new = [a.tell() for a in new if not known or a.change.place is not None or not self._moving]
        nothing = [a for a in new if abs(a.now) <= max(a.bound, self._middle(a))]
        self.alarms = [a for a in self.alarms if not any(a is n for n in nothing)]
        return [a for a in new if not any(a is n for n in nothing)]

    def corrected(self) -> list[tuple[Alarm, float]]:
        """Alarms that are out with an amount that does not hold now that the others have their names, and that."""
        wrong = [(a, a.told) for a in self.alarms if a.change.place is None and a.told_wrong]
        return [(alarm.tell(), told) for alarm, told in wrong]

    def step(self, score: Floats, information: Floats, position_m: float) -> list[Alarm]:
        """Take a window; the alarms that it ends."""
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
        # Against a machine without this change, with the others as they stand.
        i = share**2 * information[j, j]
        s = share * score[j] + i * amount
        if change.place is not None:
            alarm.score, alarm.information = _MEMORY * alarm.score + s, _MEMORY * alarm.information + i
        ratio = self._size(alarm) * (np.sign(change.amount) * s - self._middle(alarm) * i)
        ratio /= self._machine.held.inflation[j]
        alarm.height = float(np.clip(alarm.height + ratio, 0.0, self._threshold))
        return alarm.height == 0.0

    def _size(self, alarm: Alarm) -> float:
        return min(abs(alarm.change.amount), float(self._machine.held.smallest[alarm.change.direction]))

    def _middle(self, alarm: Alarm) -> float:
        """Between an alarm that stands and one that has gone."""
        return max(_HELD_FROM * self._size(alarm), float(self._machine.held.allowed[alarm.change.direction]))

    def _amount(self, alarm: Alarm) -> float:
        """What the offset holds of this alarm."""
        if alarm.change.place is None:
            return float(self.offset.logarithms[alarm.change.direction])
        return next((p.amount for p in self.offset.places if _same(p, alarm.change.place)), 0.0)

    def settle(self) -> None:
        """At a stretch's end: the model comes along with what stands by now."""
        before, places = self.offset, []
        logarithms = self._directions_now()
        for alarm in self.alarms:
            if alarm.change.place is not None:
                if alarm.information > 0:
                    alarm.now = float(np.clip(alarm.score / alarm.information, -_MOST, _MOST))
                places.append(replace(alarm.change.place, amount=alarm.now))
        self.offset = Offset(logarithms, tuple(places))
        at = np.array([p.centre_m for p in places])
        local = np.abs(self.offset.stiffness(at) - before.stiffness(at)).max() if places else 0.0
        moved = np.abs(logarithms - before.logarithms).max()
        self._moving = bool(max(local, moved) > _MOVING)
        if moved > _MOVING:  # what was gathered around the old offset would pull the new one back
            self._forget()

    def _directions_now(self) -> Floats:
        """Amounts of the directions that stand, estimated together, with their bounds."""
        known, logarithms = self.directions, np.zeros_like(self.offset.logarithms)
        inside = self._information[np.ix_(known, known)]
        if known and np.all(np.diagonal(inside) > 0):
            covariance = np.linalg.inv(inside)
            found = covariance @ self._score[known]
            step = self._all_free() - self.offset.logarithms
            for i, j in enumerate(known):
                accuracy = self._machine.held if len(known) == 1 else self._machine.free
                for alarm in (a for a in self.alarms if a.change.direction == j and a.change.place is None):
                    alarm.now = float(np.clip(found[i], -_MOST, _MOST))
                    alarm.bound = bound(accuracy, j, 1 / covariance[i, i])
                    if abs(alarm.now) > FAR:
                        alarm.bound = float(np.linalg.norm([alarm.bound, step[j], _neglected(step)]))
        for alarm in self.alarms:
            if alarm.change.place is None:
                logarithms[alarm.change.direction] = alarm.now
        return logarithms

    def _all_free(self) -> Floats:
        """What every direction would be if none were held at the baseline, by the model as it follows now."""
        return np.asarray(np.linalg.lstsq(self._information, self._score, rcond=None)[0])

    def state(self) -> dict[str, NDArray[Any]]:
        places = [[p.centre_m, p.width_m, p.amount] for p in self.offset.places]
        return {
            "alarms": np.array([a.row() for a in self.alarms]),
            "logarithms": self.offset.logarithms,
            "places": np.array(places),
            "score": self._score,
            "information": self._information,
            "moving": np.array(self._moving),
        }

    def load(self, state: dict[str, NDArray[Any]]) -> None:
        self.alarms = [Alarm.of(row) for row in state["alarms"]]
        self.offset = Offset(np.array(state["logarithms"]), tuple(Place(*map(float, row)) for row in state["places"]))
        self._score, self._information = np.array(state["score"]), np.array(state["information"])
        self._moving = bool(state["moving"])


def _neglected(step: Floats) -> float:
    """What a linear model leaves out of a change by so much, of second order in its largest part."""
    return float(np.abs(step).clip(0.0, _MOST).max() ** 2 / 2)


def _share(place: Place, position_m: float) -> float:
    return float(place.share(np.array([position_m]))[0])


def _same(one: Place, other: Place) -> bool:
    return (one.centre_m, one.width_m) == (other.centre_m, other.width_m)
