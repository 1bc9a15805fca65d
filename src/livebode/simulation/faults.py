"""Faults of a machine: over time as a step or a ramp, or at a place of the belt. Any number together."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from livebode.arrays import Floats
from livebode.core import UsageError
from livebode.dataclass import dataclass
from livebode.simulation.values import nonnegative, positive


@dataclass
class Condition:
    """The machine's parameters at some times, each an array: factors on stiffness, damping
    and friction, load, play."""

    stiffness: Floats
    damping: Floats
    load_kg: Floats
    gap_m: Floats
    friction: Floats

    @classmethod
    def healthy(cls, samples: int, load_kg: float) -> Condition:
        return cls(np.ones(samples), np.ones(samples), np.full(samples, load_kg), np.zeros(samples), np.ones(samples))


class Fault(Protocol):
    """Protocol of a fault over time: a class with these two methods works in simulation, truth and checks."""

    @property
    def moments_s(self) -> tuple[float, ...]:
        """Beginning and end of the change: the stability of the loop is checked at these times."""
        ...

    def act(self, time_s: Floats, condition: Condition) -> None:
        """Changes the condition at these times in place."""
        ...


@dataclass(frozen=True, kw_only=True)
class OverTime:
    """Begins at `start_s` and increases linearly during `ramp_s`; 0 is a step."""

    start_s: float = 0.0
    ramp_s: float = 0.0

    def __post_init__(self) -> None:
        nonnegative(self, "start_s", "ramp_s")

    @property
    def moments_s(self) -> tuple[float, ...]:
        return self.start_s, self.start_s + self.ramp_s

    def share(self, time_s: Floats) -> Floats:
        """Share of the change, 0 … 1.

        >>> OverTime(start_s=1.0, ramp_s=2.0).share(np.array([0.5, 1.0, 2.0, 9.0]))
        array([0. , 0. , 0.5, 1. ])
        """
        if self.ramp_s == 0:
            return np.asarray((time_s >= self.start_s).astype(np.float64))
        return np.clip((time_s - self.start_s) / self.ramp_s, 0.0, 1.0)


@dataclass(frozen=True, kw_only=True)
class TensionLoss(OverTime):
    """The belt loses this share of its stiffness, in every span; its damping is unchanged."""

    loss: float

    def __post_init__(self) -> None:
        super().__post_init__()
        _share_below_1(self.loss)

    def act(self, time_s: Floats, condition: Condition) -> None:
        condition.stiffness *= 1 - self.loss * self.share(time_s)


@dataclass(frozen=True, kw_only=True)
class LoadChange(OverTime):
    """The cart's mass changes by `load_kg`, at constant speed."""

    load_kg: float

    def act(self, time_s: Floats, condition: Condition) -> None:
        condition.load_kg += self.load_kg * self.share(time_s)


@dataclass(frozen=True, kw_only=True)
class DampingGrowth(OverTime):
    """The damping of every span increases to `factor` times its value."""

    factor: float

    def __post_init__(self) -> None:
        super().__post_init__()
        positive(self, "factor")

    def act(self, time_s: Floats, condition: Condition) -> None:
        condition.damping *= 1 + (self.factor - 1) * self.share(time_s)


@dataclass(frozen=True, kw_only=True)
class FrictionChange(OverTime):
    """All friction, of motor and cart, changes to `factor` times its value."""

    factor: float

    def __post_init__(self) -> None:
        super().__post_init__()
        nonnegative(self, "factor")

    def act(self, time_s: Floats, condition: Condition) -> None:
        condition.friction *= 1 + (self.factor - 1) * self.share(time_s)


@dataclass(frozen=True, kw_only=True)
class Backlash(OverTime):
    """Play of `gap_m` in total between belt and cart; its corners are rounded over a twentieth of it."""

    gap_m: float

    def __post_init__(self) -> None:
        super().__post_init__()
        positive(self, "gap_m")

    def act(self, time_s: Floats, condition: Condition) -> None:
        condition.gap_m += self.gap_m * self.share(time_s)


@dataclass(frozen=True, kw_only=True)
class SoftSpot:
    """A worn place of the belt: with the cart near it the stiffness is less by loss/(1 + ((x − position)/width)²)²."""

    position_m: float
    width_m: float
    loss: float

    def __post_init__(self) -> None:
        positive(self, "position_m", "width_m")
        _share_below_1(self.loss)

    @property
    def moments_s(self) -> tuple[float, ...]:
        return ()

    def act(self, time_s: Floats, condition: Condition) -> None:
        """No change over time."""

    def factor(self, position_m: Floats) -> Floats:
        """Remaining share of the stiffness with the cart at these positions.

        >>> SoftSpot(position_m=1.0, width_m=0.1, loss=0.2).factor(np.array([0.0, 1.0, 1.1])).round(4)
        array([1.  , 0.8 , 0.95])
        """
        bump = 1 / (1 + ((position_m - self.position_m) / self.width_m) ** 2)
        return np.asarray(1 - self.loss * bump**2)


def _share_below_1(loss: float) -> None:
    if not 0 <= loss < 1:
        raise UsageError(
            "out-of-range",
            f"loss={loss} is not a fraction from 0 to below 1",
            "choose a fraction, such as 0.1",
            argument="loss",
            value=loss,
            low=0,
            high=1,
        )


def condition_at(faults: tuple[Fault, ...], time_s: Floats, load_kg: float) -> Condition:
    """The machine under all faults at these times."""
    condition = Condition.healthy(len(time_s), load_kg)
    for fault in faults:
        fault.act(time_s, condition)
    return condition
