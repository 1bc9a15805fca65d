"""Alarms that stand, and the newest windows, over which a change is named."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.monitoring.naming import Change, Segment
from livebode.monitoring.offset import Place

Floats = NDArray[np.float64]


@dataclass
class Alarm:
    """A change that was named, and has not gone.

    `now` is its amount over the newest windows, `height` the sum that it is held by, between 0 and the threshold: at 0
    it has gone.
    """

    change: Change
    since_sample: int
    since_s: float
    now: float
    height: float
    score: float = 0.0
    information: float = 0.0

    def row(self) -> list[float]:
        """As numbers, for a snapshot."""
        c, nowhere = self.change, Place(np.nan, np.nan)
        place = c.place or nowhere
        return [
            c.direction, c.amount, c.bound, c.evidence, place.centre_m, place.width_m,
            self.since_sample, self.since_s, self.now, self.height, self.score, self.information,
        ]  # fmt: skip

    @classmethod
    def of(cls, row: NDArray[Any]) -> Alarm:
        """From a snapshot's numbers."""
        direction, amount, bound, evidence, centre, width, sample, *rest = (float(n) for n in row)
        place = Place(centre, width) if np.isfinite(centre) else None
        return cls(Change(int(direction), amount, bound, evidence, place), int(sample), *rest)


@dataclass
class Recent:
    """The newest windows, as many as an alarm may look back over."""

    rows: int
    score: list[Floats] = field(default_factory=list)
    information: list[Floats] = field(default_factory=list)
    moment: list[tuple[float, float, float]] = field(default_factory=list)
    """Position, newest sample and time of each."""

    def add(self, score: Floats, information: Floats, moment: tuple[float, float, float]) -> None:
        """A window."""
        self.score = [*self.score[-self.rows + 1 :], score]
        self.information = [*self.information[-self.rows + 1 :], information]
        self.moment = [*self.moment[-self.rows + 1 :], moment]

    def segment(self, first: int) -> Segment:
        """Windows from position `first` on, which counts from the end."""
        position_m = np.array([m[0] for m in self.moment[first:]])
        return Segment(np.array(self.score[first:]), np.array(self.information[first:]), position_m)

    def state(self) -> dict[str, NDArray[Any]]:
        return {"score": np.array(self.score), "information": np.array(self.information), "moment": np.array(self.moment)}

    def load(self, state: dict[str, NDArray[Any]]) -> None:
        self.score, self.information = list(state["score"]), list(state["information"])
        self.moment = [(float(a), float(b), float(c)) for a, b, c in state["moment"]]
