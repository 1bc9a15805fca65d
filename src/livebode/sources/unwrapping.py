"""Angles and counters that wrap: unwrapped, and recognised by their jumps."""

from __future__ import annotations

from math import pi

import numpy as np

from livebode.arrays import Floats
from livebode.core import Channel
from livebode.dataclass import dataclass

_COUNTS = tuple(float(1 << bits) for bits in range(8, 33))
_ANGLES = (2 * pi, 360.0, 1.0)
_OF_TURN = 1 / 8  # that an ordinary step may be: above it, a signal that switches may look like one that wraps
_NEAR = 2.0  # ordinary steps by which a jump may differ from a turn, as one of them is in it
_ROUNDING = 1e-6  # of a turn, of a text table with few digits
_JUMPS_MAX = 1 << 20  # beyond which a signal jumps for another reason


class Unwrapping:
    """Unwraps a signal that arrives in parts: each sample is within half a turn of the one before it.

    The first sample remains as it is. Missing samples stay missing, and the next one follows the last known one.

    Examples
    --------
    >>> Unwrapping(360.0).process(np.array([350.0, 355.0, 2.0, np.nan, 6.0, 358.0])).tolist()
    [350.0, 355.0, 362.0, nan, 366.0, 358.0]
    """

    def __init__(self, turn: float) -> None:
        self._turn = turn
        self._last = self._turns = np.nan  # last known sample, as it came, and the turns that were added to it

    def process(self, x: Floats, repeated: int = 0) -> Floats:
        """The next samples; the last `repeated` ones come again at the beginning of the next part."""
        known = np.flatnonzero(np.isfinite(x))
        if not known.size:
            return x
        values = x[known]
        begins = np.isnan(self._last)
        steps = np.diff(values, prepend=values[0] if begins else self._last)
        turns = np.cumsum(np.round(-steps / self._turn)) + (0.0 if begins else self._turns)
        last = int(np.searchsorted(known, x.size - repeated)) - 1
        if last >= 0:
            self._last, self._turns = values[last], turns[last]
        unwrapped = x.copy()
        unwrapped[known] = values + self._turn * turns
        return unwrapped


@dataclass(frozen=True)
class Wrap:
    """A signal that wraps: by this turn, so often."""

    turn: float
    count: int


class WrapSearch:
    """Recognises by its jumps that a signal which arrives in parts is an angle, or a counter, that wraps.

    All of its jumps have the size of one turn, but for two ordinary steps; ordinary steps are less than an eighth of a
    turn; and its values have no larger range than a turn. A turn is 2π, 360 or 1 of a signal without a unit, a turn of
    one that is an angle, or 2⁸ … 2³² of one of whole numbers. Without the unit of an angle, the values are between 0
    and a turn, or half a turn on both sides of 0, and a sawtooth is not an angle: three or more jumps that end at the
    same value, and equal steps between them.
    """

    def __init__(self) -> None:
        self._low, self._high, self._last = np.inf, -np.inf, np.nan
        self._ordinary, self._whole = (np.inf, -np.inf), True  # lowest and highest ordinary step
        self._jumps: list[Floats] = []  # rows of size, and value behind
        self._count = 0

    def process(self, x: Floats) -> None:
        """Search the next samples, in the unit of the source."""
        x = x[np.isfinite(x)]
        if not x.size or self._count > _JUMPS_MAX:
            return
        self._low, self._high = min(self._low, float(x.min())), max(self._high, float(x.max()))
        self._whole = self._whole and bool(np.all(np.abs(x - np.round(x)) <= _ROUNDING))
        joined = x if np.isnan(self._last) else np.append(self._last, x)
        steps, ends = np.diff(joined), joined[1:]
        self._last = float(x[-1])
        extent = self._high - self._low
        large = np.abs(steps) > extent / 2
        self._ordinary = _extended(self._ordinary, steps[~large])
        self._jumps.append(np.array([steps[large], ends[large]]))
        self._count += int(np.count_nonzero(large))

    def finish(self, channel: Channel) -> Wrap | None:
        """The wrap of this channel; None without one."""
        if not self._jumps or self._count > _JUMPS_MAX:
            return None
        extent, sizes = self._high - self._low, np.concatenate(self._jumps, axis=1)
        # What was large in the smaller range that was known then may be ordinary.
        large = np.abs(sizes[0]) > extent / 2
        low, high = _extended(self._ordinary, sizes[0, ~large])
        ordinary = max(-low, high)
        jumps, ends = np.abs(sizes[0, large]), sizes[1, large]
        sawtooth = ends.size > 2 and float(np.ptp(ends)) == 0 and high - low <= _ROUNDING * extent
        sawtooth = sawtooth and channel.unit != "rad"
        if not jumps.size or ordinary <= 0 or sawtooth:
            return None
        for turn in _turns(channel, self._whole):
            margin = _NEAR * ordinary + _ROUNDING * turn
            apart = np.abs(jumps - turn)
            near = float(apart.max()) <= margin and float(np.median(apart)) <= margin / 2
            fits = extent <= turn + margin / 4 and ordinary < _OF_TURN * turn
            if near and fits and (channel.unit == "rad" or self._is_between_borders(turn, margin)):
                return Wrap(turn * channel.factor, int(jumps.size))
        return None

    def _is_between_borders(self, turn: float, margin: float) -> bool:
        """Whether the values are from 0 to a turn, or from half a turn below 0 to half a turn above it."""
        return any(
            abs(self._low + part) <= margin and abs(self._high - turn + part) <= margin for part in (0, turn / 2)
        )


def _extended(limits: tuple[float, float], values: Floats) -> tuple[float, float]:
    """The limits that also contain these values."""
    return float(values.min(initial=limits[0])), float(values.max(initial=limits[1]))


def _turns(channel: Channel, whole: bool) -> tuple[float, ...]:
    """The possible turns of a channel, in the unit of its source."""
    counts = _COUNTS if whole else ()
    if channel.unit == "rad":
        return (2 * pi / channel.factor, *counts)
    if channel.kind not in ("position", "other"):
        return ()
    return (*_ANGLES, *counts) if not channel.unit else counts
