"""Reference motions: strokes with trapezoidal or S-curve speed, and standstill."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from itertools import pairwise
from math import ceil, inf, isnan, sqrt
from typing import Any, Protocol

import numpy as np

from livebode.arrays import Floats
from livebode.core import UsageError
from livebode.dataclass import dataclass
from livebode.simulation.axis_settings import Limits
from livebode.simulation.values import NonNegative, Positive, nonnegative, positive


class Motion(Protocol):
    """A reference that repeats: one cycle of whole ticks."""

    def cycle(self, rate_hz: float) -> tuple[Floats, Floats]:
        """Cart position, m, and speed, m/s, at every tick of one cycle."""
        ...

    def check(self, limits: Limits) -> None:
        """Raise UsageError if it exceeds the limits."""
        ...


@dataclass(frozen=True, kw_only=True)
class Standstill:
    """The cart is held at one position.

    Parameters
    ----------
    position_m
        Position of the cart, m.

    Examples
    --------
    >>> Standstill(position_m=0.8).cycle(4000)
    (array([0.8]), array([0.]))
    """

    position_m: float = 0.8

    def cycle(self, rate_hz: float) -> tuple[Floats, Floats]:  # noqa: ARG002 - the same at every rate
        return np.array([self.position_m]), np.zeros(1)

    def check(self, limits: Limits) -> None:
        within("position_m", self.position_m, limits)


@dataclass(frozen=True, kw_only=True)
class Strokes:
    """Forward and return strokes between two positions, with a dwell before each stroke.

    The speed is a trapezoid, or with a finite jerk an S-curve; a stroke too short for the speed reaches less. Dwells
    are extended by less than a tick, so that a cycle is whole ticks and every cycle has the same samples.

    Parameters
    ----------
    start_m
        Position of the first dwell, m.
    end_m
        Position of the turning point, m.
    speed_m_per_s
        Largest speed of the reference, m/s.
    acceleration_m_per_s2
        Largest acceleration of the reference, m/s².
    jerk_m_per_s3
        Largest jerk of the reference, m/s³. Default: no limit, which gives trapezoids.
    dwell_s
        Rest before each stroke, s.

    Raises
    ------
    UsageError
        If a value is not positive, or both ends are the same.

    Examples
    --------
    >>> strokes = Strokes(start_m=0.4, end_m=1.2, speed_m_per_s=0.5, acceleration_m_per_s2=2.0, dwell_s=0.1)
    >>> position, speed = strokes.cycle(1000)
    >>> len(position), float(position.min()), float(position.max()), float(abs(speed).max())
    (3900, 0.4, 1.2, 0.5)
    """

    start_m: Positive = 0.25
    end_m: Positive = 1.6
    speed_m_per_s: Positive = 0.38
    acceleration_m_per_s2: Positive = 4.0
    jerk_m_per_s3: Positive = inf
    dwell_s: NonNegative = 0.25

    def __post_init__(self) -> None:
        positive(self, "start_m", "end_m", "speed_m_per_s", "acceleration_m_per_s2")
        nonnegative(self, "dwell_s")
        if isnan(self.jerk_m_per_s3) or self.jerk_m_per_s3 <= 0:
            raise UsageError(
                "out-of-range",
                f"jerk_m_per_s3={self.jerk_m_per_s3} is not above 0",
                "leave it out for trapezoids",
                argument="jerk_m_per_s3",
                value=self.jerk_m_per_s3,
            )
        if self.start_m == self.end_m:
            raise UsageError(
                "conflict",
                f"start_m and end_m are both {self.start_m}",
                "use Standstill to hold the cart",
                argument="end_m",
                value=self.start_m,
            )

    @cached_property
    def _stroke(self) -> _Stroke:
        return _Stroke.of(abs(self.end_m - self.start_m), self.speed_m_per_s, self.acceleration_m_per_s2,
                          self.jerk_m_per_s3)  # fmt: skip

    def cycle(self, rate_hz: float) -> tuple[Floats, Floats]:
        half = ceil((self.dwell_s + self._stroke.duration_s) * rate_hz - 1e-9)
        way, speed = self._stroke.at(np.arange(half) / rate_hz - self.dwell_s)
        sign = 1.0 if self.end_m > self.start_m else -1.0
        position = np.concatenate([self.start_m + sign * way, self.end_m - sign * way])
        return position, sign * np.concatenate([speed, -speed])

    def check(self, limits: Limits) -> None:
        within("start_m", self.start_m, limits)
        within("end_m", self.end_m, limits)
        for name in ("speed_m_per_s", "acceleration_m_per_s2"):
            value, most = getattr(self, name), getattr(limits, f"{name}_max")
            if value > most:
                raise UsageError(
                    "out-of-range",
                    f"{name}={value} is above the limit {name}_max={most}",
                    "choose at most that",
                    argument=name,
                    value=value,
                    high=most,
                )


@dataclass(frozen=True, kw_only=True)
class StrokeSequence:
    """Strokes one after the other from turning point to turning point, each at its own speed.

    The cycle begins again at the first turning point, where the cart is only if it is also the last one.

    Parameters
    ----------
    turning_points_m
        Where the strokes begin and end: one more than there are speeds.
    speeds_m_per_s
        Of each stroke; acceleration, jerk and dwell are those of `Strokes` by default.

    Raises
    ------
    UsageError
        If there is no stroke, the numbers of points and speeds do not match, or a stroke is not one of `Strokes`.

    Examples
    --------
    >>> there_and_back = StrokeSequence(turning_points_m=(0.4, 1.2, 0.4), speeds_m_per_s=(0.5, 0.2))
    >>> there_and_back.edges_s(1000)
    array([0.   , 1.975, 6.275])
    """

    turning_points_m: tuple[float, ...]
    speeds_m_per_s: tuple[float, ...]

    def __post_init__(self) -> None:
        if not self.speeds_m_per_s or len(self.turning_points_m) != len(self.speeds_m_per_s) + 1:
            points, speeds = len(self.turning_points_m), len(self.speeds_m_per_s)
            raise UsageError(
                "wrong-shape",
                f"{points} turning points do not belong to {speeds} speeds",
                "give one point more than speeds, and at least one speed",
                argument="turning_points_m",
                value=points,
            )
        _ = self._strokes

    @cached_property
    def _strokes(self) -> tuple[Strokes, ...]:
        legs = zip(pairwise(self.turning_points_m), self.speeds_m_per_s)
        return tuple(Strokes(start_m=start, end_m=end, speed_m_per_s=speed) for (start, end), speed in legs)

    def cycle(self, rate_hz: float) -> tuple[Floats, Floats]:
        position, speed = (np.concatenate(rows) for rows in zip(*self._legs(rate_hz)))
        return position, speed

    def edges_s(self, rate_hz: float) -> Floats:
        """When each stroke begins with its dwell, and when the last one ends."""
        samples = [position.size for position, _ in self._legs(rate_hz)]
        return np.concatenate([[0], np.cumsum(samples)]) / rate_hz

    def check(self, limits: Limits) -> None:
        for strokes in self._strokes:
            strokes.check(limits)

    def _legs(self, rate_hz: float) -> Iterator[tuple[Floats, Floats]]:
        """The forward half of each pair of strokes."""
        for strokes in self._strokes:
            position, speed = strokes.cycle(rate_hz)
            yield position[: position.size // 2], speed[: speed.size // 2]


def within(name: str, position_m: float, limits: Limits) -> None:
    if not limits.position_m_min <= position_m <= limits.position_m_max:
        raise UsageError(
            "out-of-range",
            f"{name}={position_m} is outside the stroke",
            f"choose from {limits.position_m_min} to {limits.position_m_max} m",
            argument=name,
            value=position_m,
            low=limits.position_m_min,
            high=limits.position_m_max,
        )


@dataclass(frozen=True)
class _Stroke:
    """One stroke from rest to rest as pieces of constant jerk."""

    times_s: Floats  # start of each piece, and the end of the last
    starts: Floats  # distance, speed, acceleration at the start of each piece, shape (pieces, 3)
    jerks: Floats  # of each piece
    way_m: float

    @property
    def duration_s(self) -> float:
        return float(self.times_s[-1])

    @classmethod
    def of(cls, way_m: float, speed: float, acceleration: float, jerk: float) -> _Stroke:
        speed = min(speed, _reachable(way_m, acceleration, jerk))
        acceleration = min(acceleration, sqrt(speed * jerk))
        ramp = acceleration / jerk if jerk < inf else 0.0
        flat = speed / acceleration - ramp
        cruise = way_m / speed - (flat + 2 * ramp)
        up = [(ramp, jerk), (flat, 0.0), (ramp, -jerk)]
        pieces = [*up, (cruise, 0.0), *((time, -j) for time, j in up)]
        leaps = {1: acceleration, 3: 0.0, 5: -acceleration, 6: 0.0}  # of the acceleration, where the jerk is infinite
        times, starts, jerks, state = [0.0], [], [], np.zeros(3)
        for i, (time, j) in enumerate(pieces):
            if ramp == 0.0:
                state[2], j = leaps.get(i, state[2]), 0.0
            starts.append(state.copy())
            jerks.append(j)
            times.append(times[-1] + time)
            state = np.array(_moved(state[0], state[1], state[2], j, time))
        return cls(np.array(times), np.array(starts), np.array(jerks), way_m)

    def at(self, time_s: Floats) -> tuple[Floats, Floats]:
        """Distance and speed at these times; at rest before and after."""
        t = np.clip(time_s, 0.0, self.duration_s)
        i = np.clip(np.searchsorted(self.times_s, t, side="right") - 1, 0, len(self.jerks) - 1)
        start = self.starts[i]
        way, speed, _ = _moved(start[:, 0], start[:, 1], start[:, 2], self.jerks[i], t - self.times_s[i])
        resting = (time_s <= 0) | (time_s >= self.duration_s)
        return np.where(time_s >= self.duration_s, self.way_m, way), np.where(resting, 0.0, speed)


def _moved(way: Any, speed: Any, acceleration: Any, jerk: Any, t: Any) -> tuple[Any, Any, Any]:
    """Constant jerk for a time."""
    return (
        way + t * (speed + t * (acceleration / 2 + t * jerk / 6)),
        speed + t * (acceleration + t * jerk / 2),
        acceleration + t * jerk,
    )


def _reachable(way_m: float, acceleration: float, jerk: float) -> float:
    """The highest speed of a stroke without cruise: v·(v/a + a/j) = way, or 2·v·√(v/j) = way where a is not reached."""
    if jerk == inf:
        return sqrt(way_m * acceleration)
    ramp = acceleration / jerk
    speed = acceleration * (-ramp + sqrt(ramp**2 + 4 * way_m / acceleration)) / 2
    return speed if speed >= acceleration * ramp else float((way_m**2 * jerk / 4) ** (1 / 3))
