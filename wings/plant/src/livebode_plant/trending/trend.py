"""Trend: how a quantity of a machine changed over months, from one value for each run."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf, nan, tau

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import INTERVAL_FACTOR
from livebode.dataclass import dataclass
from livebode.language import Message
from livebode_plant.trending.changes import ChangeKind, Segmentation, segmentation
from livebode_plant.trending.robust_fit import rank_of

MONTH_S = 365.25 / 12 * 86400
YEAR_S = 12 * MONTH_S
RUNS_MIN = 20
SPAN_S_MIN = 28 * 86400.0
_SEASON_S_MIN = 1.5 * YEAR_S  # below, a season of one year cannot be separated from a trend
_WILD = 8.0  # interquartile ranges from the median: a failed sensor, which would move the whole regression
_ALIKE = 0.95  # share of the time that the covariates explain, from which a warning is given
_HEAD = 2  # columns for the constant and the time


@dataclass(frozen=True)
class ChangePoint:
    """A jump by `amount` in the unit of the quantity; or a bend, from which on the slope per month differs by it."""

    kind: ChangeKind
    time_s: float
    amount: float
    bound_95: float


@dataclass(frozen=True)
class Effect:
    """Influence of a covariate: change of the quantity for one unit of it."""

    name: str
    per_unit: float
    bound_95: float


@dataclass(frozen=True, eq=False)
class Trend:
    """How a quantity of a machine changes.

    Attributes
    ----------
    runs
        Number of runs that the trend was computed from.
    outliers
        Number of those that do not count, because they are far from all others.
    left_out
        Number of runs without a value of the quantity or of a covariate.
    since_s, until_s
        First and last run, s since 1970.
    level
        Value of the regression at the first run, at the mean of the covariates.
    per_month, per_month_bound_95
        Slope now: after the last bend.
    slope_since_s
        From when on this is the slope: the last bend, or the first run.
    change, change_bound_95
        Of the regression from the first to the last run, jumps included, covariates excluded.
    changes
        Jumps and bends in the order of time.
    effects
        Of the covariates.
    p
        Probability of a trend or a change like this in a machine that does not change.
    scatter, correlation
        From run to run, and between neighbours.
    remarks
        What limits the result.
    time_s, adjusted, bound_95
        The runs in the order of time, with the influence of covariates and season removed, and their own bounds,
        (runs,) each.
    counted
        Whether a run counts, (runs,).
    line, line_bound_95
        The regression at these times, (runs,).
    covariates
        Values of each covariate, (runs,).
    """

    runs: int
    outliers: int
    left_out: int
    since_s: float
    until_s: float
    level: float
    per_month: float
    per_month_bound_95: float
    slope_since_s: float
    change: float
    change_bound_95: float
    changes: tuple[ChangePoint, ...]
    effects: tuple[Effect, ...]
    p: float
    scatter: float
    correlation: float
    remarks: tuple[str, ...]
    time_s: Floats
    adjusted: Floats
    bound_95: Floats
    counted: NDArray[np.bool_]
    line: Floats
    line_bound_95: Floats
    covariates: Mapping[str, Floats]

    @property
    def relative(self) -> float:
        """Percent for one unit of the quantity, of its level; NaN where the level is not far from zero."""
        return 100 / abs(self.level) if abs(self.level) > 5 * self.scatter else nan

    @property
    def trending(self) -> bool:
        """Whether the bound of the slope excludes zero."""
        return abs(self.per_month) > self.per_month_bound_95

    def months_to(self, limit: float) -> float:
        """Months from the last run until the quantity is `limit` from its level at the first run, at the present slope.

        0 if it is that far already; infinite if the bound of the slope includes zero.
        """
        if abs(self.change) >= limit:
            return 0.0
        if not self.trending:
            return inf
        towards = self.change if self.per_month > 0 else -self.change
        return (limit - towards) / abs(self.per_month)


@dataclass(frozen=True)
class NotAssessed:
    """Why there is no trend."""

    runs: int
    reason: str


def trend_of(
    time_s: Floats,
    value: Floats,
    bound_95: Floats,
    covariates: Mapping[str, Floats] | None = None,
    member: NDArray[np.intp] | None = None,
) -> Trend | NotAssessed:
    """The trend of a quantity over the runs of one machine.

    The value is regressed on the time, the covariates and, from 1.5 years on, a season (sine and cosine of a year and
    half a year), robustly and with the bounds of `robust_fit`; jumps and bends are found by `segmentation`. `p` is
    twice the smaller of the probabilities of the slope over all runs, without changes, and of the most significant
    change, so that the search for changes does not make it too small.

    Biased if the quantity depends on a covariate other than linearly, or with a delay; if a covariate has an error of
    its own (its influence is then underestimated); and if a season shorter than 1.5 years has no covariate that
    explains it, which then looks like a trend or a bend. A change that is too small to be found is part of the slope.

    Parameters
    ----------
    time_s
        Time of each run, s since 1970, (runs,), in any order.
    value
        The quantity, (runs,); NaN if a run has none.
    bound_95
        95 % bound of each value, (runs,); NaN where it is not known.
    covariates
        Mean of each covariate in each run, (runs,); NaN where it is not known.
    member
        Number of the axis of each run, (runs,), if they are of several: each has a level of its own, and the level of
        the trend is that of the axis with the smallest number.

    Examples
    --------
    >>> day = np.arange(200.0) * 86400
    >>> scatter = np.random.default_rng(1).normal(0, 0.003, 200)
    >>> trend = trend_of(day, 1 - 0.002 * day / MONTH_S + scatter, np.full(200, 0.001))
    >>> f"{trend.per_month:.4f} ± {trend.per_month_bound_95:.4f}"
    '-0.0021 ± 0.0002'
    """
    usable, remarks = _usable(covariates or {})
    kept, names = np.isfinite(time_s) & np.isfinite(value), sorted(usable)
    for name in names:
        kept &= np.isfinite(usable[name])
    rows = np.flatnonzero(kept)
    rows = rows[np.argsort(time_s[rows], kind="stable")]
    time = time_s[rows]
    span_s = float(time[-1] - time[0]) if len(rows) else 0.0
    if reason := _too_little(len(rows), span_s):
        return NotAssessed(len(rows), reason)
    month = (time - time[0]) / MONTH_S
    season = _season(time) if span_s >= _SEASON_S_MIN else np.zeros((len(rows), 0))
    others = np.column_stack([*(usable[name][rows] for name in names), season])
    levels = _levels(np.zeros_like(rows) if member is None else member[rows])
    others = np.column_stack([others - others.mean(axis=0), levels])
    terms = np.column_stack([np.ones(len(rows)), month - month.mean(), others])
    if rank_of(terms) < terms.shape[1]:
        return NotAssessed(len(rows), Message("the covariates cannot be separated from each other or from the time"))
    bound = bound_95[rows]
    sigma = np.where(np.isfinite(bound) & (bound > 0), bound, 0.0) / INTERVAL_FACTOR
    segments = segmentation(month, terms, value[rows], sigma)
    remarks += _alike(terms, names)
    used = {name: usable[name][rows] for name in names}
    return _trend(segments, _HEAD + others.shape[1], time, bound, used, tuple(remarks), len(time_s) - len(rows))


def _trend(
    segments: Segmentation,
    before: int,
    time: Floats,
    bound: Floats,
    covariates: dict[str, Floats],
    remarks: tuple[str, ...],
    left_out: int,
) -> Trend:
    """The trend from a regression whose changes follow after so many terms."""
    value, unit, to_s = segments.coefficients, np.eye(len(segments.coefficients)), float(time[0])
    changing = segments.terms.copy()
    changing[:, _HEAD:before] = 0.0
    bends = [i for i, place in enumerate(segments.places) if place.kind == "bend"]
    slope = unit[[1, *(before + i for i in bends)]].sum(axis=0)
    total = changing[-1] - changing[0]
    line = changing @ value
    slope_bound, total_bound, *bounds = segments.accuracy.bound_95(np.vstack([slope, total, unit])).tolist()
    return Trend(
        runs=len(time),
        outliers=int((segments.fit.weight == 0).sum()),
        left_out=left_out,
        since_s=to_s,
        until_s=float(time[-1]),
        level=float(line[0]),
        per_month=float(value @ slope),
        per_month_bound_95=slope_bound,
        slope_since_s=to_s + max((segments.places[i].time for i in bends), default=0.0) * MONTH_S,
        change=float(value @ total),
        change_bound_95=total_bound,
        changes=tuple(
            ChangePoint(place.kind, to_s + place.time * MONTH_S, float(value[i]), bounds[i])
            for i, place in enumerate(segments.places, before)
        ),
        effects=tuple(Effect(name, float(value[i]), bounds[i]) for i, name in enumerate(covariates, _HEAD)),
        p=min(1.0, 2 * min(segments.without.p(np.eye(before)[1]), segments.p)),
        scatter=segments.fit.scatter,
        correlation=segments.fit.correlation,
        remarks=remarks,
        time_s=time,
        adjusted=line + segments.fit.residual,
        bound_95=bound,
        counted=segments.fit.weight > 0,
        line=line,
        line_bound_95=segments.accuracy.bound_95(changing),
        covariates=covariates,
    )


def _too_little(runs: int, span_s: float) -> str:
    if runs < RUNS_MIN:
        return Message("{runs} runs with a value, and a trend needs {needed}", runs=runs, needed=RUNS_MIN)
    if span_s < SPAN_S_MIN:
        return Message(
            "the runs span {days:.1f} days, and a trend needs {needed:.0f}",
            days=span_s / 86400,
            needed=SPAN_S_MIN / 86400,
        )
    return ""


def _usable(covariates: Mapping[str, Floats]) -> tuple[dict[str, Floats], list[str]]:
    """Covariates that vary, without the values of a failed sensor, and remarks on the others."""
    usable, remarks = {}, []
    for name, values in covariates.items():
        known = values[np.isfinite(values)]
        if len(known) < RUNS_MIN:
            remarks.append(f"{name} is known in {len(known)} runs only and was not used")
            continue
        low, middle, high = np.quantile(known, (0.25, 0.5, 0.75))
        if high - low <= 1e-9 * abs(middle):
            remarks.append(f"{name} is constant and was not used")
            continue
        usable[name] = np.where(np.abs(values - middle) <= _WILD * (high - low), values, nan)
    return usable, remarks


def _season(time_s: Floats) -> Floats:
    angle = tau * time_s[:, np.newaxis] / YEAR_S * np.array([1.0, 2.0])
    return np.column_stack([np.cos(angle), np.sin(angle)])


def _levels(member: NDArray[np.intp]) -> Floats:
    """A column for each member but the first, 1 where a row belongs to it."""
    return np.asarray(member[:, np.newaxis] == np.unique(member)[1:], dtype=np.float64)


def _alike(terms: Floats, names: list[str]) -> list[str]:
    """A remark if the other terms explain most of the time."""
    others = np.delete(terms, 1, axis=1)
    left = terms[:, 1] - others @ np.linalg.lstsq(others, terms[:, 1], rcond=None)[0]
    if float(left @ left) > (1 - _ALIKE) * float(terms[:, 1] @ terms[:, 1]):
        return []
    return [f"{' and '.join(names) or 'the season'} changes with the time, so the bound of the trend is wide"]
