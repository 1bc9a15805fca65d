"""Curves with bounds, the numbers that are drawn of them, and the summary of all responses of a run."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import Response, Responses, decibels
from livebode.dataclass import dataclass

SPAN = (0.05, 0.95)
FLOOR_DB = -1000.0
"""Lower end of a bound that reaches zero: the response cannot be distinguished from zero."""
# The middle of an unwrapped phase curve is between −225° and 135°: the cut is as far as possible from the usual angles
# of machines (multiples of 90°, with a small delay), so that noise does not shift a curve by a whole turn.
_TURN_FROM_DEG = -225.0


def bound_db(value: Complex, radius: Floats) -> tuple[Floats, Floats]:
    """Lower and upper end in dB of a circle around each value; `FLOOR_DB` where it contains zero.

    >>> [float(end[0].round(2)) for end in bound_db(np.array([1j]), np.array([0.5]))]
    [-6.02, 3.52]
    """
    size = np.abs(value)
    with np.errstate(all="ignore"):
        return np.maximum(decibels(np.maximum(size - radius, 0.0)), FLOOR_DB), decibels(size + radius)


def bound_deg(value: Complex, radius: Floats) -> Floats:
    """Half of the angle under which the origin sees the circle, degrees; 180 where the circle contains the origin.

    >>> bound_deg(np.array([2.0 + 0j, 2.0 + 0j]), np.array([1.0, 3.0])).round(6)
    array([ 30., 180.])
    """
    with np.errstate(all="ignore"):
        ratio = radius / np.abs(value)
        return np.where(ratio >= 1, 180.0, np.degrees(np.arcsin(np.minimum(ratio, 1.0))))


def quantiles(values: Floats) -> Floats:
    """5 %, 50 % and 95 % of each column without its NaN, interpolated, shape (3, columns); NaN for an empty column.

    >>> quantiles(np.array([[1.0], [np.nan], [3.0]])).T
    array([[1.1, 2. , 2.9]])
    """
    if not values.shape[0]:
        return np.full((3, values.shape[1]), np.nan)
    ordered = np.sort(np.ascontiguousarray(values.T), axis=1)
    count = np.count_nonzero(np.isfinite(ordered), axis=1)
    every = np.arange(len(ordered))
    rows = []
    for q in (SPAN[0], 0.5, SPAN[1]):
        position = q * np.maximum(count - 1, 0)
        below = position.astype(np.intp)
        above = np.minimum(below + 1, np.maximum(count - 1, 0))
        low, high = ordered[every, below], ordered[every, above]
        rows.append(low + (high - low) * (position - below))
    return np.array(rows)


def unwrapped(phase_deg: Floats, weak: NDArray[np.bool_]) -> Floats:
    """Phase along frequency without jumps of whole turns; shape (lines,), degrees.

    Lines with an unknown phase (`weak`: the bound is larger than the response) follow the others, so that noise cannot
    add turns to the curve.
    """
    known = np.isfinite(phase_deg)
    lead = known & ~weak if np.any(known & ~weak) else known
    if not np.any(lead):
        return phase_deg.copy()
    index = np.arange(len(phase_deg))
    led = np.unwrap(phase_deg[lead], period=360.0)
    middle = (led.min() + led.max()) / 2
    led -= 360.0 * np.floor((middle - _TURN_FROM_DEG) / 360.0)
    return near(phase_deg, np.interp(index, index[lead], led))


def near(phase_deg: Floats, reference_deg: Floats) -> Floats:
    """Angles on the branch within half a turn of the reference."""
    return np.asarray(phase_deg - 360.0 * np.rint((phase_deg - reference_deg) / 360.0))


def circular(value: Complex) -> tuple[Floats, Floats]:
    """Median angle of each column (columns,), and quantiles of the deviation from the mean direction (3, columns)."""
    with np.errstate(all="ignore"):
        turned = value / np.abs(value)
        direction = np.nansum(turned, axis=0)
        direction = np.where(np.abs(direction) > 0, direction, 1.0)
        deviation_deg = quantiles(np.degrees(np.angle(turned * direction.conj())))
    return np.degrees(np.angle(direction)) + deviation_deg[1], deviation_deg


@dataclass(frozen=True, eq=False)
class Curve:
    """A complex value at each frequency, with a circle around it.

    Attributes
    ----------
    frequency_hz
        (lines,), ascending.
    value
        (lines,); NaN where nothing is drawn.
    radius
        Of the circle that is the bound, unit of `value`; NaN where none is known.
    label, bound_label
        In a legend; an empty `bound_label` draws no bound.
    color
        Any colour of Matplotlib; None for the next of the axes.
    """

    frequency_hz: Floats
    value: Complex
    radius: Floats
    label: str
    bound_label: str
    color: Any = None

    @property
    def bounded(self) -> bool:
        """Whether there is a bound to draw."""
        return bool(self.bound_label) and bool(np.isfinite(self.radius).any())

    @property
    def phase_deg(self) -> Floats:
        """Unwrapped along frequency; lines whose bound contains zero follow the others, (lines,)."""
        return unwrapped(np.degrees(np.angle(self.value)), self.radius > np.abs(self.value))


@dataclass(frozen=True, eq=False)
class Cloud:
    """Values of the other responses behind a Curve, (rows, lines); NaN where nothing is drawn."""

    value: Complex

    @property
    def label(self) -> str:
        """In the legend of a Bode plot."""
        return f"5–95 % of {len(self.value)} responses"


@dataclass(frozen=True)
class Summary:
    """5 %, 50 % and 95 % quantiles over the run, each of shape (3, lines); NaN for a line that was never valid.

    `magnitude_db` in dB, `phase_deg` unwrapped along frequency, `coherence` between 0 and 1. `newest` is the last row
    in which any line is valid, or None; `newest_phase_deg` is on the branch of the median.
    """

    responses: Responses
    count: int
    magnitude_db: Floats
    phase_deg: Floats
    coherence: Floats
    newest: Response | None
    newest_value: NDArray[np.complex128]
    newest_bound: Floats
    newest_phase_deg: Floats


def summarised(responses: Responses, mean: Response | None = None) -> Summary:
    """Compute median, range and newest response of a run; never raises, whatever is missing.

    A `mean` of the run replaces the newest response, with its 95 % bound.
    """
    use = usable(responses)
    value = np.where(use, responses.value, np.nan)
    rows = np.flatnonzero(use.any(axis=1))
    newest = responses[int(rows[-1])] if rows.size else None
    newest_value = value[rows[-1]] if rows.size else np.full(len(responses.lines), complex(np.nan))
    bound = responses[int(rows[-1])].bound() if rows.size else np.full(len(responses.lines), np.nan)
    if mean is not None:
        newest, bound = mean, mean.bound()
        newest_value = np.where(mean.valid & np.isfinite(mean.value) & (mean.value != 0), mean.value, np.nan)
    magnitude_db = quantiles(decibels(value))
    middle_deg, deviation_deg = circular(value)
    weak = np.isfinite(bound) & (bound > np.abs(newest_value))
    phase = unwrapped(middle_deg, weak)
    return Summary(
        responses=responses,
        count=int(rows.size),
        magnitude_db=magnitude_db,
        phase_deg=phase + deviation_deg - deviation_deg[1],
        coherence=quantiles(np.where(use & np.isfinite(responses.coherence), responses.coherence, np.nan)),
        newest=newest,
        newest_value=newest_value,
        newest_bound=np.where(np.isfinite(newest_value), bound, np.nan),
        newest_phase_deg=near(np.degrees(np.angle(newest_value)), phase),
    )


def usable(responses: Responses) -> NDArray[np.bool_]:
    """Mask of the values that can be drawn: valid, finite and not zero, shape (rows, lines)."""
    return np.asarray(responses.valid & np.isfinite(responses.value) & (responses.value != 0))
