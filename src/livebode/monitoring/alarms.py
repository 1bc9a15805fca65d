"""Active alarms, and the newest windows, from which a change is identified."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import isnan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Stage, StatefulBase
from livebode.monitoring.change_date import ChangeDate
from livebode.monitoring.naming import NamedChange, ScoredWindows
from livebode.monitoring.offset import LocalChange, Offset


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
