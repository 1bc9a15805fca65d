"""The answers of the first page: resonance, damping and stiffness with bounds, and what limits ask for."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite

import numpy as np

from livebode.analysis import MARGINS
from livebode.core import INTERVAL_FACTOR, Answer, Response, with_bound
from livebode.language import Message, number, quantity_name, tr, worded
from livebode_reports.limits import answer_of
from livebode_reports.parameter_track import Track
from livebode_reports.report_data import ReportData
from livebode_reports.wording import decibels

_STIFFNESS = ("N/m", "N m/rad")
_ANSWERS_MAX = 6
Quantity = tuple[str, str, str]
"""Name, unit, and the value as text."""


def answers(of: ReportData) -> tuple[Answer, ...]:
    """The quantities of the limits with their results, then the most important ones of the fitted model.

    A quantity is that of the mean; of an axis that moved, its range over the run.
    """
    limited = tuple(answer_of(result) for result in of.accepted)
    asked = {result.limit.quantity for result in of.accepted}
    quantities = [quantity for quantity in _quantities(of) if _as_limit(quantity) not in asked]
    if not quantities and not limited:
        return tuple(_peak(of.shown.mean))
    return (*limited, *(Answer(quantity_name(name), value) for name, _, value in by_importance(quantities)))


def _peak(mean: Response) -> Iterator[Answer]:
    """Without a model, the largest line that is above both its neighbours by more than the bounds of both."""
    known = np.flatnonzero(mean.valid & np.isfinite(mean.bound()))
    f, size, radius = mean.frequency_hz[known], np.abs(mean.value[known]), mean.bound()[known]
    above = size - radius > np.maximum(np.append((size + radius)[1:], np.inf), np.append(np.inf, (size + radius)[:-1]))
    if above.any():
        i = int(np.flatnonzero(above)[np.argmax(size[above])])
        level = with_bound(decibels(size[i]), -decibels(1 - radius[i] / size[i]))
        name = tr("peak between {low:g} and {high:g} Hz", low=f[i - 1], high=f[i + 1])
        yield Answer(name, tr("{level} dB at {at:g} Hz", level=" ± ".join(level), at=f[i]))


def about_answers(of: ReportData) -> str:
    """What the bounds of the answers cover."""
    if of.of.moved and _fits(of):
        return tr("The axis moved: ranges of 90 % of the fits over the run. ± covers 95 % of the errors of one fit.")
    return worded(of.fit.about_bounds if of.fit is not None else Message("± covers 95 %")) + "."


def by_importance(quantities: list[Quantity]) -> list[Quantity]:
    """Resonances, their damping, stiffnesses and antiresonances; of a model without these, its first quantities."""
    ranked = [(rank, quantity) for quantity in quantities if (rank := _rank(quantity)) is not None]
    ranked.sort(key=lambda pair: pair[0])
    return [quantity for _, quantity in ranked][:_ANSWERS_MAX] or quantities[:_ANSWERS_MAX]


def _rank(quantity: Quantity) -> int | None:
    name, unit, _ = quantity
    if unit in _STIFFNESS:
        return 2
    if name.startswith("resonance"):
        return 0 if unit == "Hz" else 1 if name.endswith("_damping") else None
    return 3 if name.startswith("antiresonance") and unit == "Hz" else None


def _as_limit(quantity: Quantity) -> str:
    """The name that a limit has for it."""
    name, unit, _ = quantity
    if unit in _STIFFNESS:
        return "stiffness"
    return f"{name}_hz" if unit == "Hz" else name


def _fits(of: ReportData) -> list[Track]:
    return [track for track in of.tracks.values() if track.model != MARGINS]


def _quantities(of: ReportData) -> Iterator[Quantity]:
    if of.of.moved and _fits(of):
        yield from _ranges(_fits(of)[0])
    elif of.fit is not None:
        for name, value, bound, unit in of.fit.rows():
            if bound > 0:  # of what is fixed nothing was measured
                yield name, unit, measured(name, value, bound, unit)


def measured(name: str, value: float, bound: float, unit: str) -> str:
    """Value and bound with the unit; a damping ratio in percent.

    >>> measured("resonance", 74.98899, 0.0312, "Hz"), measured("resonance_damping", 0.0183689, 0.000123, "")
    ('74.989 ± 0.031 Hz', '1.837 ± 0.012 %')
    """
    factor, unit = _shown_in(name, unit)
    text, around = with_bound(factor * value, factor * bound)
    return f"{text} ± {around} {unit}".rstrip() if isfinite(bound) else f"{text} {unit}".rstrip()


def _shown_in(name: str, unit: str) -> tuple[float, str]:
    return (100.0, "%") if name.endswith("_damping") and not unit else (1.0, worded(unit))


def _ranges(track: Track) -> Iterator[Quantity]:
    for name, value in track.values.items():
        known, newest = value[np.isfinite(value)], track.newest.get(name)
        if known.size < 2 or newest is None or not newest.sigma > 0:
            continue
        factor, unit = _shown_in(name, newest.unit)
        bound = factor * INTERVAL_FACTOR * float(np.nanmedian(track.sigmas[name]))
        low, high = (with_bound(factor * float(v), bound)[0] for v in np.quantile(known, (0.05, 0.95)))
        yield name, newest.unit, f"{low} … {high} {unit}".rstrip() + f" (± {number(bound, '.2g')})"
