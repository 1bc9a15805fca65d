"""A trend in words, and as a picture of a machine's year."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from itertools import pairwise
from math import isfinite
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import with_bound
from livebode.language import listed, number, quantity_name, tr, trn
from livebode.pictures import Style, drawing, heading, labelled, new_figure, plain, shortened, style
from livebode_plant.trending import LOGARITHMIC, ChangePoint, History, Ranked, Trend

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_DAY_S = 86400.0
_GAP_S = 28 * _DAY_S
_REACH = 0.35  # of the range of the trend and the middle of the runs; what is beyond has a mark at the edge
_COLUMNS = 2


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
    facts: str
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


def year_figure(year: Year, *, dark: bool = False) -> Figure:
    """The runs with their bounds, the trend with its band, the changes, gaps without runs, and each covariate below."""
    look = style(dark)
    below = len(year.covariates)
    with drawing(look):
        figure = new_figure(9.0, 4.3 + 1.15 * below)
        height_in = figure.get_size_inches()[1]
        grid = figure.add_gridspec(
            1 + below, 1, height_ratios=[3.0, *[0.9] * below], left=0.095, right=0.985, top=1 - 1.05 / height_in,
            bottom=0.45 / height_in, hspace=0.16,
        )  # fmt: skip
        heading(figure, look, year.title, year.facts, 0.095)
        axes = figure.add_subplot(grid[0])
        _panel(axes, look, year, year.label)
        _name_changes(axes, look, year)
        panels = [axes]
        for row, (label, values) in enumerate(year.covariates.items(), 1):
            own = figure.add_subplot(grid[row], sharex=axes)
            own.plot(_dates(year.time_s), values, ".", markersize=3, color=look.traces[1])
            own.set_ylabel(shortened(label, 24))
            own.locator_params(axis="y", nbins=3)
            _gaps(own, look, year.time_s)
            plain(own)
            panels.append(own)
        for own in panels[:-1]:
            own.tick_params(axis="x", labelbottom=False)
        _key(figure, look, year, height_in)
    return figure


def years_figure(years: Sequence[Year], *, width_in: float = 9.0, dark: bool = False) -> Figure:
    """Small pictures of several machines, two in a row."""
    look = style(dark)
    rows = -(-len(years) // _COLUMNS)
    with drawing(look):
        figure = new_figure(width_in, 0.35 + 1.85 * rows)
        height_in = figure.get_size_inches()[1]
        grid = figure.add_gridspec(
            rows, _COLUMNS, left=0.075, right=0.965, top=1 - 0.3 / height_in, bottom=0.32 / height_in, hspace=0.5,
            wspace=0.2,
        )  # fmt: skip
        for i, year in enumerate(years):
            axes = figure.add_subplot(grid[i // _COLUMNS, i % _COLUMNS])
            _panel(axes, look, year, "", dates=6)
            axes.set_title(shortened(year.title, 60), loc="left", size=10, color=look.ink, pad=5)
            axes.locator_params(axis="y", nbins=4)
    return figure


def _panel(axes: Axes, look: Style, year: Year, label: str, dates: int = 8) -> None:
    low, high = _limits(year)
    days = _dates(year.time_s)
    _gaps(axes, look, year.time_s)
    inside = (year.value >= low) & (year.value <= high)
    for shown, colour in ((year.counted & inside, look.run), (~year.counted & inside, look.muted)):
        known = shown & np.isfinite(year.bound)
        axes.vlines(
            days[known], (year.value - year.bound)[known], (year.value + year.bound)[known],
            color=colour, alpha=0.3, linewidth=1.1, gid="bound",
        )  # fmt: skip
        axes.plot(days[shown], year.value[shown], ".", markersize=4.5, color=colour, gid="run")
    for beyond, edge, mark in ((year.value < low, low, "v"), (year.value > high, high, "^")):
        axes.plot(days[beyond], np.full(int(beyond.sum()), edge), mark, markersize=4, color=look.muted, clip_on=False)
    edges = [0, *(int(np.searchsorted(year.time_s, t)) for t in year.jumps), len(days)]
    for first, stop in pairwise(edges):
        part = slice(first, stop)
        band = (year.line - year.line_bound)[part], (year.line + year.line_bound)[part]
        axes.fill_between(days[part], *band, color=look.newest, alpha=0.25, linewidth=0, gid="band")
        axes.plot(days[part], year.line[part], color=look.newest, linewidth=1.7, gid="trend")
    for time_s, _ in year.changes:
        axes.axvline(_dates(np.array([time_s]))[0], color=look.ink, linewidth=0.9, dashes=(4, 3), gid="change")
    axes.set_ylim(low, high)
    axes.set_ylabel(label)
    axes.ticklabel_format(axis="y", useOffset=False, scilimits=(-4, 7))
    _date_ticks(axes, year.time_s, dates)
    plain(axes)


def _limits(year: Year) -> tuple[float, float]:
    middle = year.value[year.counted]
    half = np.nan_to_num(year.bound[year.counted])
    low = min(float(np.quantile(middle - half, 0.005)), float(year.line.min()))
    high = max(float(np.quantile(middle + half, 0.995)), float(year.line.max()))
    margin = max(_REACH * (high - low) / 2, 1e-9 * abs(high), 1e-300)
    return low - margin, high + margin


def _gaps(axes: Axes, look: Style, time_s: Floats) -> None:
    """Shade spans of four weeks and more without a run."""
    dates = _dates(time_s)
    for i in np.flatnonzero(np.diff(time_s) > _GAP_S):
        axes.axvspan(dates[i], dates[i + 1], color=look.nothing, alpha=0.6, linewidth=0, gid="gap")


def _name_changes(axes: Axes, look: Style, year: Year) -> None:
    """The text of each change above its line; those of neighbours on different heights."""
    for place, (time_s, text) in enumerate(year.changes):
        share = (time_s - year.time_s[0]) / max(year.time_s[-1] - year.time_s[0], 1.0)
        right = share > 0.6
        axes.annotate(
            shortened(text, 60), xy=(float(_dates(np.array([time_s]))[0]), 0.96 - 0.08 * (place % 3)),
            xycoords=("data", "axes fraction"), xytext=(-5 if right else 5, 0), textcoords="offset points",
            ha="right" if right else "left", va="top", size=9, color=look.ink, parse_math=False,
        )  # fmt: skip


def _date_ticks(axes: Axes, time_s: Floats, most: int) -> None:
    from matplotlib.dates import AutoDateLocator, DateFormatter

    locator = AutoDateLocator(minticks=3, maxticks=most)  # type: ignore[no-untyped-call]
    axes.xaxis.set_major_locator(locator)
    days = float(time_s[-1] - time_s[0]) / _DAY_S
    axes.xaxis.set_major_formatter(DateFormatter("%Y-%m" if days > 120 else "%Y-%m-%d", tz=UTC))  # type: ignore[no-untyped-call]
    axes.margins(x=0.015)


def _dates(time_s: Floats) -> Floats:
    """Days since 1970, which Matplotlib's dates are."""
    return np.asarray(time_s / _DAY_S)


def _key(figure: Figure, look: Style, year: Year, height_in: float) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    dot = {"linestyle": "", "marker": ".", "markersize": 6}
    entries: list[tuple[Line2D | Patch, str]] = [
        (Line2D([], [], color=look.run, **dot), tr("run with its bound")),  # type: ignore[arg-type]
        (Line2D([], [], color=look.newest, linewidth=1.7), tr("trend")),
        (Patch(facecolor=look.newest, alpha=0.3), tr("its 95 % bound")),
    ]
    if not year.counted.all():
        entries.insert(1, (Line2D([], [], color=look.muted, **dot), tr("outlier")))  # type: ignore[arg-type]
    if (np.diff(year.time_s) > _GAP_S).any():
        entries.append((Patch(facecolor=look.nothing, alpha=0.6), tr("no runs")))
    figure.legend(
        [handle for handle, _ in entries], [text for _, text in entries], loc="upper left",
        bbox_to_anchor=(0.095, 1 - 0.74 / height_in), ncols=5, borderpad=0.0, borderaxespad=0.0, handlelength=1.4,
        columnspacing=1.8,
    )  # fmt: skip


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
        facts=f"{slope} · {about_method(trend)}",
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
