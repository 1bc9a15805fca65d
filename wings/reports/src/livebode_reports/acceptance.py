"""Acceptance: a measured quantity compared with a limit, with a guard band as wide as its bound.

After ISO 14253-1:2017 and JCGM 106:2012, 8.3.2: a limit is met only if the value is inside by more than its expanded
uncertainty, here the half-width of its two-sided 95 % interval; it is failed only if the value is outside by more than
that. Between, the measurement does not decide. The probability of a false pass, and of a false fail, is at most 2.5 %
for each limit.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, isfinite, log, nan, sqrt
from typing import Any, Literal

import numpy as np

from livebode.analysis import LoopReport
from livebode.arrays import Floats
from livebode.configuration import MAGNITUDES, MARGIN_UNITS, LimitSection
from livebode.core import Loop, Response, normal_quantile
from livebode.dataclass import dataclass
from livebode.estimation import convert
from livebode.fitting import Fit
from livebode.language import Message
from livebode_reports.parameter_track import Track

Result = Literal["pass", "fail", "undecided"]

_RISK = 0.05
_UNITS = {
    "stiffness": ("N/m", "N m/rad"), "inertia": ("kg m²",), "load_mass": ("kg",), "damping": ("N s/m", "N m s/rad"),
}  # fmt: skip
_FROM_MARGIN = {"max_sensitivity": "peak_sensitivity"}
_FACTOR_MAX = 1000.0  # more data than this is not a plan

NO_FIT = Message(Message("no model was fitted"))
NO_LOOP = Message(Message("the loop is not described, or its margins are not known"))
NOT_IN_MODEL = Message(Message("the fitted model does not have it"))
SEVERAL = Message(Message("the fitted model has several"))
NO_LINE = Message(Message("no line with a known bound is within the band"))


@dataclass(frozen=True)
class MeasuredValues:
    """Values with the ends of their intervals, which cover all of them together with 95 %, (n,) each."""

    value: Floats
    low: Floats
    high: Floats
    unit: str
    at_hz: Floats | None = None

    @classmethod
    def around(cls, value: Floats, bound: Floats, unit: str) -> MeasuredValues:
        """With intervals of the same size on both sides."""
        return cls(value, value - bound, value + bound, unit)


@dataclass(frozen=True)
class LimitResult:
    """A limit and its result.

    Attributes
    ----------
    limit
        The limit.
    result
        Pass, fail, or undecided.
    value, bound, unit
        The value that is nearest to the limit, or farthest beyond it, with its bound; NaN if it was not measured.
    at_hz
        Frequency of a magnitude; NaN for other quantities.
    times
        Factor by which the data must be more to decide, where the bound is due to noise; infinite if more data do not
        help, NaN where it is decided.
    reason
        Why it was not measured; empty if it was.
    """

    limit: LimitSection
    result: Result
    value: float = nan
    bound: float = nan
    unit: str = ""
    at_hz: float = nan
    times: float = nan
    reason: str = ""

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        values = {
            "quantity": self.limit.quantity, "min": self.limit.min, "max": self.limit.max,
            "band_hz": self.limit.band_hz,
            "result": self.result, "value": self.value, "bound_95": self.bound, "unit": self.unit, "at_hz": self.at_hz,
            "times_the_data": self.times, "reason": self.reason,
        }  # fmt: skip
        return {name: None if isinstance(x, float) and not isfinite(x) else x for name, x in values.items()}


@dataclass(frozen=True, eq=False)
class LimitEvidence:
    """What limits are compared with.

    Attributes
    ----------
    mean, loop
        The mean response, and the loop around it.
    fit, margins
        The fit to the mean and the margins of its loop; None if there are none.
    tracks
        Fits over the run: used where the axis moved, because the machine then differs from position to position.
    """

    mean: Response
    loop: Loop
    fit: Fit | None
    margins: LoopReport | None
    tracks: Sequence[Track] = ()


def accepted(limits: Sequence[LimitSection], of: LimitEvidence) -> tuple[LimitResult, ...]:
    """The result of each limit."""
    return tuple(_accepted(limit, of) for limit in limits)


def _accepted(limit: LimitSection, of: LimitEvidence) -> LimitResult:
    measured = _measured(limit, of)
    if isinstance(measured, str):
        return LimitResult(limit, "undecided", reason=measured)
    return judged(limit, measured)


def judged(limit: LimitSection, measured: MeasuredValues) -> LimitResult:
    """The result for measured values: they pass if all do, and fail if any does.

    Examples
    --------
    >>> limit = LimitSection(quantity="resonance_hz", min=50.0)
    >>> result = judged(limit, MeasuredValues.around(np.array([51.0]), np.array([2.0]), "Hz"))
    >>> result.result, result.times
    ('undecided', 4.0)
    >>> judged(limit, MeasuredValues.around(np.array([53.0]), np.array([2.0]), "Hz")).result
    'pass'
    """
    inside, outside = np.full(len(measured.value), inf), np.full(len(measured.value), -inf)
    if limit.min is not None:
        inside, outside = measured.low - limit.min, limit.min - measured.high
    if limit.max is not None:
        inside, outside = np.minimum(inside, limit.max - measured.high), np.maximum(outside, measured.low - limit.max)
    failed, passed = bool((outside > 0).any()), bool((inside > 0).all())
    i = int(np.argmax(outside) if failed else np.argmin(inside))
    value, low, high = (float(x[i]) for x in (measured.value, measured.low, measured.high))
    upper = limit.max is not None and (limit.min is None or limit.max - value < value - limit.min)
    bound = 0.0 if value == low == high else high - value if upper != failed else value - low
    at_hz = nan if measured.at_hz is None else float(measured.at_hz[i])
    result: Result = "fail" if failed else "pass" if passed else "undecided"
    times = nan
    if result == "undecided":
        away = abs(value - (limit.max if upper else limit.min or 0.0))  # type: ignore[operator]
        times = (bound / away) ** 2 if 0 < bound <= sqrt(_FACTOR_MAX) * away else inf
    return LimitResult(limit, result, value, bound, measured.unit, at_hz, times)


def _measured(limit: LimitSection, of: LimitEvidence) -> MeasuredValues | str:
    if limit.quantity in MAGNITUDES:
        return _magnitudes(limit, of)
    if limit.quantity in MARGIN_UNITS:
        return _margin(limit.quantity, of)
    return _parameter(limit.quantity, of)


def _magnitudes(limit: LimitSection, of: LimitEvidence) -> MeasuredValues | str:
    """Magnitudes of the lines in dB, each with the larger side of its bound."""
    mean, wanted = of.mean, MAGNITUDES[limit.quantity]
    f = mean.lines.frequency_hz
    low, high = limit.band_hz or (0.0, inf)
    value, slopes = mean.value, np.ones(len(f))
    if mean.quantity != wanted:
        if mean.quantity != "plant" or of.loop.feedback is None:
            return NO_LOOP
        value, slope = convert(wanted, mean.value, of.loop.feedback_at(f))  # type: ignore[arg-type]
        slopes = np.abs(slope)
    use = mean.valid & np.isfinite(value) & np.isfinite(mean.sigma) & (f >= low) & (f <= high)
    if not use.any():
        return NO_LINE
    c = sqrt(log(np.count_nonzero(use) / _RISK))
    size, radius = np.abs(value[use]), (mean.bound(c) * slopes)[use]
    with np.errstate(divide="ignore"):
        value_db, low_db, high_db = (20 * np.log10(x) for x in (size, np.maximum(size - radius, 0.0), size + radius))
    unit = "dB" if mean.quantity != wanted or not mean.unit else f"dB re 1 {mean.unit}"
    return MeasuredValues(value_db, low_db, high_db, unit, f[use])


def _margin(quantity: str, of: LimitEvidence) -> MeasuredValues | str:
    """The margin at each place of the schedule; one that no such change can exhaust is infinite."""
    if of.margins is None or of.margins.message:
        return NO_LOOP
    name = _FROM_MARGIN.get(quantity, quantity.rsplit("_", 1)[0])
    places = of.margins.places
    value, sigma = places.of(name)[places.ok], places.sigma[places.ok, places.index(name)]
    if not value.size:
        return NO_LOOP
    bound = np.where(np.isinf(value), 0.0, _joint(value.size) * sigma)
    return MeasuredValues.around(value, bound, MARGIN_UNITS[quantity])


def _parameter(quantity: str, of: LimitEvidence) -> MeasuredValues | str:
    if of.fit is None:
        return NO_FIT
    rows = {name: (value, bound, unit) for name, value, bound, unit in of.fit.rows()}
    names = [name for name, (_, _, unit) in rows.items() if unit in _UNITS[quantity]] if quantity in _UNITS else []
    if quantity not in _UNITS:
        plain = quantity.removesuffix("_hz").removesuffix("_s")
        names = [name for name in rows if name == plain]
    elif quantity == "inertia":
        names = names[:1]  # of the motor
    if len(names) != 1:
        return SEVERAL if names else NOT_IN_MODEL
    (name,) = names
    value, bound, unit = rows[name]
    for track in of.tracks:
        if name in track.values and (known := np.isfinite(track.values[name]) & np.isfinite(track.sigmas[name])).any():
            count = int(np.count_nonzero(known))
            return MeasuredValues.around(track.values[name][known], _joint(count) * track.sigmas[name][known], unit)
    return MeasuredValues.around(np.array([value]), np.array([bound]), unit)


def _joint(count: int) -> float:
    """Deviations that cover so many normal values together with 95 % (Bonferroni)."""
    return normal_quantile(1 - _RISK / (2 * count))
