"""A trend in words, and as a picture of a machine's year."""

from __future__ import annotations

from math import isfinite

import numpy as np

from livebode.core import with_bound
from livebode.language import listed, number, tr, trn, worded
from livebode.report import labelled
from livebode_plant.report.year import Year, day
from livebode_plant.trending import LOGARITHMIC, ChangePoint, History, Ranked, Trend

_MONTHS_MAX = 120


def scale(trend: Trend, unit: str) -> tuple[float, str]:
    """Factor and unit in which changes are given: percent of the level, or the unit where percent have no meaning."""
    return (trend.relative, "%") if isfinite(trend.relative) and unit not in LOGARITHMIC else (1.0, unit)


def quantity_name(history: History) -> str:
    """The name of the quantity in the language in use."""
    return worded(history.name.replace("_", " "))


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
        title=tr("{quantity} of {machine}", quantity=quantity_name(history), machine=machine),
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
