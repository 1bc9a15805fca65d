"""A trend in words, and as a picture of a machine's year."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from datetime import UTC, datetime
from itertools import pairwise
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import with_bound
from livebode.dataclass import dataclass
from livebode.language import listed, number, quantity_name, tr, trn
from livebode.pictures import (
    ABOVE,
    LIGHT,
    WIDTH,
    Band,
    Bars,
    DotKind,
    Dots,
    Entry,
    Figure,
    Mark,
    Panel,
    Scale,
    Shade,
    Tag,
    Trace,
    labelled,
    room,
    scale_around,
    stacked,
    value_scale,
)
from livebode_plant.trending import LOGARITHMIC, ChangePoint, History, Ranked, Trend

_DAY_S = 86400.0
_GAP_S = 28 * _DAY_S
_REACH = 0.35  # of the range of the trend and the middle of the runs; what is beyond has a mark at the edge
_COLUMNS, _SMALL = 2, 110.0


@dataclass(frozen=True, eq=False)
class Year:
    """A quantity of a machine over its runs, in the order of time.

    Attributes
    ----------
    title, facts
        What is drawn, and a line below.
    label
        Of the axis: the quantity with its unit.
    time_s
        s since 1970, (runs,).
    value, bound
        Each run without the influence of the covariates, and its 95 % bound, NaN where it is not known, (runs,).
    counted
        False for outliers, (runs,).
    line, line_bound
        The trend and its 95 % bound, (runs,).
    changes
        Time and text of each jump and bend.
    jumps
        Times of the jumps, at which the line ends and begins again.
    covariates
        Values by label, (runs,).
    """

    title: str
    facts: Sequence[str]
    label: str
    time_s: Floats
    value: Floats
    bound: Floats
    counted: NDArray[np.bool_]
    line: Floats
    line_bound: Floats
    changes: Sequence[tuple[float, str]] = ()
    jumps: Sequence[float] = ()
    covariates: Mapping[str, Floats] = field(default_factory=dict)


def year_figure(year: Year) -> Figure:
    """The runs with their bounds, the trend with its band, the changes, gaps without runs, and each covariate below."""
    y = value_scale(*_limits(year), year.label)
    x = _date_scale(year.time_s, 6)
    parts: list[tuple[Scale, list[Mark], float]] = [(y, [*_marks(year, y), *_change_names(year, x, y)], 210.0)]
    for label, values in year.covariates.items():
        parts.append((scale_around([values], label, 3), [_gaps(year.time_s), _dots(year, values)], 66.0))
    left = room(*(scale for scale, _, _ in parts))
    panels, height = stacked(x, parts, left=left, width=584.0 - left)
    return Figure(year.title, year.facts, _key(year), panels, height)


def _dots(year: Year, values: Floats) -> Dots:
    return Dots("covariate", year.time_s, values, LIGHT.traces[1], 2.5)


def years_figure(years: Sequence[Year]) -> Figure:
    """Small pictures of several machines, two in a row."""
    scales = [value_scale(*_limits(year), "", 4) for year in years]
    left = room(*scales)
    panels = []
    for i, (year, y) in enumerate(zip(years, scales)):
        across, down = i % _COLUMNS, i // _COLUMNS
        place = left + across * WIDTH / _COLUMNS, ABOVE + down * (_SMALL + ABOVE + 24.0)
        x = _date_scale(year.time_s, 3)
        panels.append(Panel(*place, WIDTH / _COLUMNS - left - 16.0, _SMALL, x, y, _marks(year, y), title=year.title))
    rows = -(-len(years) // _COLUMNS)
    return Figure("", (), (), panels, rows * (_SMALL + ABOVE + 24.0) + 8.0)


def _marks(year: Year, y: Scale) -> list[Mark]:
    marks: list[Mark] = [_gaps(year.time_s)]
    inside = (year.value >= y.low) & (year.value <= y.high)
    for shown, colour in ((year.counted & inside, LIGHT.run), (~year.counted & inside, LIGHT.muted)):
        low, high = (year.value - year.bound)[shown], (year.value + year.bound)[shown]
        marks.append(Bars("bound", year.time_s[shown], low, high, colour, 1.1, 0.3))
        marks.append(Dots("run", year.time_s[shown], year.value[shown], colour, 3.0))
    size = 0.02 * (y.high - y.low)
    beyond: tuple[tuple[NDArray[np.bool_], float, DotKind], ...] = (
        (year.value < y.low, y.low + size, "down"), (year.value > y.high, y.high - size, "up"),
    )  # fmt: skip
    for of, edge, kind in beyond:
        marks.append(Dots("beyond", year.time_s[of], np.full(int(of.sum()), edge), LIGHT.muted, 5.0, kind))
    edges = [0, *(int(np.searchsorted(year.time_s, t)) for t in year.jumps), len(year.time_s)]
    for first, stop in pairwise(edges):
        part = slice(first, stop)
        times, line, half = year.time_s[part], year.line[part], year.line_bound[part]
        marks.append(Band("band", times, line - half, line + half, LIGHT.newest, 0.25))
        marks.append(Trace("trend", times, line, LIGHT.newest, 1.7))
    ends = np.array([y.low, y.high])
    return marks + [Trace("change", np.full(2, time_s), ends, LIGHT.ink, 0.9, "dashed") for time_s, _ in year.changes]


def _limits(year: Year) -> tuple[float, float]:
    middle = year.value[year.counted]
    half = np.nan_to_num(year.bound[year.counted])
    low = min(float(np.quantile(middle - half, 0.005)), float(year.line.min()))
    high = max(float(np.quantile(middle + half, 0.995)), float(year.line.max()))
    margin = max(_REACH * (high - low) / 2, 1e-9 * abs(high), 1e-300)
    return low - margin, high + margin


def _gaps(time_s: Floats) -> Shade:
    """Spans of four weeks and more without a run."""
    long = np.flatnonzero(np.diff(time_s) > _GAP_S)
    return Shade("gap", time_s[long], time_s[long + 1], LIGHT.nothing)


def _change_names(year: Year, x: Scale, y: Scale) -> list[Tag]:
    """The text of each change beside its line; those of neighbours on different heights."""
    tags = []
    for place, (time_s, text) in enumerate(year.changes):
        height = y.low + (0.9 - 0.1 * (place % 3)) * (y.high - y.low)
        right = float(x.share(time_s)) > 0.5
        beside = time_s + (-0.01 if right else 0.01) * (x.high - x.low)
        tags.append(Tag(text, beside, height, LIGHT.ink, "end" if right else "start"))
    return tags


def _date_scale(time_s: Floats, most: int) -> Scale:
    """Time with the begins of days, months or years as its numbers, in UTC."""
    first, last = float(time_s[0]), float(time_s[-1])
    margin = 0.015 * (last - first) or _DAY_S
    low, high = first - margin, last + margin
    days = (high - low) / _DAY_S
    if days > 31 * (most - 1):
        months = next((n for n in (1, 2, 3, 6, 12, 24, 60, 120) if days / 30.4 / n <= most), 240)
        begin = datetime.fromtimestamp(low, UTC)
        numbers = range(12 * begin.year + begin.month - 1, 12 * begin.year + begin.month + int(days / 28) + 2)
        every = [datetime(n // 12, n % 12 + 1, 1, tzinfo=UTC).timestamp() for n in numbers if n % months == 0]
        words = "%Y-%m"
    else:
        step = next(n for n in (1, 2, 5, 10, 20, 40) if days / n <= most / 1.4) * _DAY_S
        every = [step * n for n in range(int(low / step), int(high / step) + 2)]
        words = "%Y-%m-%d"
    ticks = [at for at in every if low <= at <= high]
    return Scale(low, high, ticks, [datetime.fromtimestamp(at, UTC).strftime(words) for at in ticks])


def _key(year: Year) -> list[Entry]:
    entries = [
        Entry(tr("run with its bound"), LIGHT.run, "dot"), Entry(tr("trend"), LIGHT.newest),
        Entry(tr("its 95 % bound"), LIGHT.newest, "band"),
    ]  # fmt: skip
    if not year.counted.all():
        entries.insert(1, Entry(tr("outlier"), LIGHT.muted, "dot"))
    if (np.diff(year.time_s) > _GAP_S).any():
        entries.append(Entry(tr("no runs"), LIGHT.muted, "band"))
    return entries


def day(unix_s: float) -> str:
    """The date, in UTC, as 2025-03-12."""
    return datetime.fromtimestamp(unix_s, UTC).strftime("%Y-%m-%d")


_MONTHS_MAX = 120


def scale(trend: Trend, unit: str) -> tuple[float, str]:
    """Factor and unit in which changes are given: percent of the level, or the unit where percent have no meaning."""
    return (trend.relative, "%") if isfinite(trend.relative) and unit not in LOGARITHMIC else (1.0, unit)


def amount(trend: Trend, value: float, bound: float, unit: str) -> str:
    """A change with its bound, as "−0.79 ± 0.02"."""
    factor, _ = scale(trend, unit)
    return " ± ".join(with_bound(factor * value, factor * bound)).replace("-", "−")


def change_words(trend: Trend, change: ChangePoint, unit: str) -> str:
    """A jump with amount and date, or the date from which on the slope differs."""
    if change.kind == "bend":
        return tr("other slope from {day}", day=day(change.time_s))
    own = amount(trend, change.amount, change.bound_95, unit)
    return tr("{amount} {unit} on {day}", amount=own, unit=scale(trend, unit)[1], day=day(change.time_s))


def sentence(of: Ranked, quantity: str, unit: str) -> str:
    """What a person should know of a machine whose quantity changed."""
    trend, words = of.trend, []
    factor, shown = scale(trend, unit)
    values = {"quantity": quantity, "machine": of.machine}
    for change in trend.changes:
        if change.kind == "jump":
            own = _size(factor, change.amount, change.bound_95)
            words.append(
                tr("{quantity} of {machine} rose by {amount} {unit} on {day}.",
                   **values, amount=own, unit=shown, day=day(change.time_s))
                if change.amount > 0 else
                tr("{quantity} of {machine} fell by {amount} {unit} on {day}.",
                   **values, amount=own, unit=shown, day=day(change.time_s))
            )  # fmt: skip
    if trend.trending and not (words and abs(trend.per_month) < 2 * trend.per_month_bound_95):
        own = _size(factor, trend.per_month, trend.per_month_bound_95)
        since = day(trend.slope_since_s)
        words.append(
            tr("{quantity} of {machine} rises by {amount} {unit} a month since {day}.",
               **values, amount=own, unit=shown, day=since)
            if trend.per_month > 0 else
            tr("{quantity} of {machine} falls by {amount} {unit} a month since {day}.",
               **values, amount=own, unit=shown, day=since)
        )  # fmt: skip
    if not words:
        own = amount(trend, trend.change, trend.change_bound_95, unit)
        words.append(tr("{quantity} of {machine} changed by {amount} {unit}.", **values, amount=own, unit=shown))
    return " ".join(words)


def months(of: Ranked, limit_percent: float) -> str:
    """Time until the limit, in words; empty if the machine does not approach it."""
    if not isfinite(of.months):
        return ""
    limit = number(limit_percent, "g")
    if of.months == 0:
        return tr("changed by more than {limit} %", limit=limit)
    if of.months > _MONTHS_MAX:
        return tr("more than 10 years to {limit} %", limit=limit)
    return trn("{n} month to {limit} %", "{n} months to {limit} %", max(1, round(of.months)), limit=limit)


def outlook(of: Ranked, limit_percent: float) -> str:
    """When the limit is reached, as a sentence; empty if it is not approached within ten years."""
    limit = number(limit_percent, "g")
    if of.months == 0:
        return tr("This is more than {limit} %.", limit=limit)
    if not of.months <= _MONTHS_MAX:
        return ""
    return trn(
        "The change will be {limit} % in about {n} month.", "The change will be {limit} % in about {n} months.",
        max(1, round(of.months)), limit=limit,
    )  # fmt: skip


def _size(factor: float, value: float, bound: float) -> str:
    return " ± ".join(with_bound(abs(factor * value), factor * bound))


def slope_words(trend: Trend, unit: str) -> str:
    """The present slope."""
    own = amount(trend, trend.per_month, trend.per_month_bound_95, unit)
    return tr("{amount} {unit} a month", amount=own, unit=scale(trend, unit)[1])


def about_method(trend: Trend) -> str:
    """Number of runs, and what was removed."""
    count = trn("{n:,} run", "{n:,} runs", trend.runs)
    if not trend.effects:
        return count
    names = listed(effect.name for effect in trend.effects)
    return tr("{runs}, influence of {names} removed", runs=count, names=names)


def year_of(history: History, machine: str, trend: Trend) -> Year:
    """The picture of a machine's year."""
    unit = history.unit_of(machine)
    slope = slope_words(trend, unit)
    if trend.slope_since_s > trend.since_s:
        slope = tr("{slope} since {day}", slope=slope, day=day(trend.slope_since_s))
    return Year(
        title=tr("{quantity} of {machine}", quantity=quantity_name(history.name), machine=machine),
        facts=(slope, about_method(trend)),
        label=labelled(history.name, unit),
        time_s=trend.time_s,
        value=trend.adjusted,
        bound=np.where(trend.bound_95 > 0, trend.bound_95, np.nan),
        counted=trend.counted,
        line=trend.line,
        line_bound=trend.line_bound_95,
        changes=[(change.time_s, change_words(trend, change, unit)) for change in trend.changes],
        jumps=[change.time_s for change in trend.changes if change.kind == "jump"],
        covariates=trend.covariates,
    )
