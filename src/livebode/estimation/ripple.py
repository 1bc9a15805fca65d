"""Ripple: torque that repeats with the motor's angle, and its share in a window's response."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Lines, Stage, StatefulBase, UsageError
from livebode.dataclass import dataclass

_MORE = 1.3  # times the amplitude: its error has a fixed size, unlike noise, and the 63 % bound must cover it


@dataclass(frozen=True)
class RippleOrder:
    """One order of a ripple that is added to the input and not in the logged one.

    Attributes
    ----------
    cycles
        Per unit of the schedule: 24 a turn of a pulley of 19 mm are 201 a metre.
    amplitude
        In the input's unit.
    """

    cycles: float
    amplitude: float

    def __post_init__(self) -> None:
        for name in ("cycles", "amplitude"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise UsageError(
                    "out-of-range",
                    f"ripple: {name} = {getattr(self, name)} is not a positive number",
                    "choose a number above 0",
                    argument=name,
                    value=getattr(self, name),
                )


def ripple_power(orders: tuple[RippleOrder, ...], lines: Lines, rate_per_s: Floats) -> Floats:
    """Largest |D|² of the ripple at each line, D its spectrum over a window, (rows, lines).

    A tone of amplitude T that is d bins beside a line has |D| = T·N/2·sinc(d) there. Where the speed changes within a
    window, the smallest d is used. NaN rates have none.

    Parameters
    ----------
    orders
        Orders of the ripple.
    lines
        The lines, with window and rate.
    rate_per_s
        Speeds of the schedule at the window's beginning and end, (2, rows).

    Examples
    --------
    >>> lines = Lines.parse("20:60:20", rate_hz=4000, window=400)
    >>> power = ripple_power((RippleOrder(200.0, 0.1),), lines, np.array([[0.3], [0.3]]))
    >>> (np.sqrt(power) / 200).round(3)
    array([[0.  , 0.  , 0.13]])
    """
    bins, total = np.asarray(lines.bins), np.zeros((rate_per_s.shape[1], len(lines)))
    for order in orders:
        met = np.abs(np.nan_to_num(rate_per_s, nan=np.inf)) * order.cycles / lines.resolution_hz
        least, most = met.min(axis=0)[:, np.newaxis], met.max(axis=0)[:, np.newaxis]
        beside = np.maximum(np.maximum(least - bins, bins - most), 0.0)
        leak = np.where(np.isfinite(beside), np.sinc(np.where(np.isfinite(beside), beside, 0.0)), 0.0)
        total += (_MORE * order.amplitude * lines.window / 2 * leak) ** 2
    return total


class RippleSpeed(StatefulBase):
    """Speed of the schedule over the first and the second half of each window."""

    _stage = Stage("ripple-speed", 1)
    _STATE = ("_past",)

    def __init__(self, lines: Lines) -> None:
        self._window, self._rate_hz = lines.window, lines.rate_hz
        self._past = np.full(lines.window, np.nan)

    def restart(self) -> None:
        self._past[:] = np.nan

    def at(self, schedule: Floats, position: NDArray[np.int64]) -> Floats:
        """Speeds of the windows that end at these positions of the next stretch, per second, (2, rows)."""
        known = np.concatenate([self._past, schedule])
        self._past = known[known.size - self._window :]
        last, half = position + self._window, self._window // 2
        middle, first = known[last - half], known[last - self._window + 1]
        late, early = half, self._window - 1 - half
        return np.stack([(middle - first) / max(early, 1), (known[last] - middle) / late]) * self._rate_hz


class HopSpeed(StatefulBase):
    """Speed of the schedule from one spectrum to the next, where only its value at the windows' centres is sent."""

    _stage = Stage("hop-speed", 1)
    _STATE = ("_last",)

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._last = np.full(2, np.nan)

    def at(self, schedule: Floats, sample: NDArray[np.int64]) -> Floats:
        """Speeds per second at these samples, the same at a window's beginning and end, (2, rows)."""
        known = np.concatenate([self._last[:, np.newaxis], np.stack([sample.astype(np.float64), schedule])], axis=1)
        self._last = known[:, -1]
        apart, moved = np.diff(known)
        return np.tile(moved / apart * self._rate_hz, (2, 1))
