"""When a quantity jumped, or when its trend changed: a segmentation by significance."""

from __future__ import annotations

from typing import Literal

import numpy as np

from livebode.arrays import Floats
from livebode.dataclass import dataclass
from livebode_plant.trending.robust_fit import RobustFit, rank_of, robust_fit

ChangeKind = Literal["jump", "bend"]

_KINDS: tuple[ChangeKind, ...] = ("jump", "bend")
SIGNIFICANT = 0.01
"""Probability that a machine without a change is given one; Bonferroni over all places and both kinds."""
_CHANGES_MAX = 5
_ROWS_MIN = 8  # before, after and between changes
_TIMES_MAX = 200
_CLIP = 2.5  # of the scatter: a single outlier is no jump


@dataclass(frozen=True)
class Break:
    """A change: a jump at a time, or a bend, from which on the slope differs."""

    kind: ChangeKind
    time: float

    def term(self, time: Floats) -> Floats:
        """Column of the change in the regression: one step, or a slope of one, from that time on."""
        after = time >= self.time
        return np.where(after, 1.0 if self.kind == "jump" else time - self.time, 0.0)


@dataclass(frozen=True, eq=False)
class Segmentation:
    """The accepted changes in the order of time, the regression with them, and the chance of the first one.

    Attributes
    ----------
    places
        The changes.
    terms
        The terms of the regression, a column for each change, and one for the date of each bend,
        (rows, terms + changes + bends).
    coefficients
        Of all of these; zero for the dates, which are where the residual is smallest.
    fit
        The regression with the changes.
    accuracy
        The regression with the dates, too: its errors are those of `coefficients`.
    without
        The regression without a change.
    p
        Probability of a change like the most significant one in a machine that has none; 1 if too few rows.
    """

    places: tuple[Break, ...]
    terms: Floats
    coefficients: Floats
    fit: RobustFit
    accuracy: RobustFit
    without: RobustFit
    p: float


def segmentation(time: Floats, terms: Floats, value: Floats, sigma: Floats) -> Segmentation:
    """Add the most significant jump or bend to the regression until none is significant, at most five.

    The place of a candidate is where the clipped residuals are explained best (binary segmentation with refitting of
    all coefficients); of the best jump and the best bend, the one with the smaller residuals. It is accepted if its own
    coefficient, with the bound of the regression that contains it, is significant at 1 % divided by the number of
    candidates (twice the number of times). Scatter that is correlated therefore needs a larger jump.

    Parameters
    ----------
    time
        (rows,), ascending; its unit is that of the bends.
    terms
        (rows, terms), of full rank; a constant and the time are among them.
    value, sigma
        As in `robust_fit`.
    """
    places: list[Break] = []
    fit = without = robust_fit(terms, value, sigma)
    columns, first_p = terms, 1.0
    for _ in range(_CHANGES_MAX):
        times = _times(time, places)
        tried = [_tried(place, time, columns, value, sigma) for place in _best(times, time, columns, fit)]
        accepted = _closer([each for each in tried if each is not None])
        if accepted is None:
            break
        place, wider, new = accepted
        p = min(1.0, 2 * len(times) * new.p(np.eye(wider.shape[1])[-1]))
        first_p = first_p if places else p
        if p > SIGNIFICANT:
            break
        places.append(place)
        columns, fit = wider, new
    places.sort(key=lambda place: place.time)
    if places:
        columns = np.column_stack([terms, *(place.term(time) for place in places)])
        fit = robust_fit(columns, value, sigma)
    # A bend at another time adds a step in the first order (Muggeo, Stat. Med. 22, 2003).
    dates = [Break("jump", place.time).term(time) for place in places if place.kind == "bend"]
    wide = np.column_stack([columns, *dates])
    accuracy = robust_fit(wide, value, sigma) if dates else fit
    coefficients = np.pad(fit.coefficients, (0, len(dates)))
    return Segmentation(tuple(places), wide, coefficients, fit, accuracy, without, first_p)


def _times(time: Floats, places: list[Break]) -> list[float]:
    """Times at least eight rows from the ends and from other changes, at most 200."""
    rows = np.arange(_ROWS_MIN, len(time) - _ROWS_MIN + 1)
    for place in places:
        rows = rows[np.abs(rows - np.searchsorted(time, place.time)) >= _ROWS_MIN]
    return list(np.unique(time[rows[:: max(1, -(-len(rows) // _TIMES_MAX))]]).tolist())


def _best(times: list[float], time: Floats, columns: Floats, fit: RobustFit) -> list[Break]:
    """The jump and the bend that explain most of the clipped residuals, beyond what the terms explain."""
    if not times or fit.scatter == 0:
        return []
    limit = _CLIP * fit.scatter
    left = np.clip(fit.residual, -limit, limit)
    q = np.linalg.qr(columns)[0]
    left = left - q @ (q.T @ left)
    breaks = []
    for kind in _KINDS:
        terms = np.column_stack([Break(kind, time_of_change).term(time) for time_of_change in times])
        terms = terms - q @ (q.T @ terms)
        size = np.linalg.norm(terms, axis=0)
        own = size > 1e-6 * size.max()
        gain = np.abs(terms.T @ left)
        breaks.append(Break(kind, times[int(np.argmax(np.where(own, gain / np.where(own, size, 1.0), 0.0)))]))
    return breaks


_Tried = tuple[Break, Floats, RobustFit]


def _tried(place: Break, time: Floats, columns: Floats, value: Floats, sigma: Floats) -> _Tried | None:
    wider = np.column_stack([columns, place.term(time)])
    return (place, wider, robust_fit(wider, value, sigma)) if rank_of(wider) == wider.shape[1] else None


def _closer(tried: list[_Tried]) -> _Tried | None:
    """The one with the smaller residuals, outliers clipped."""
    limit = _CLIP * min((fit.scatter for _, _, fit in tried), default=0.0)
    return min(tried, key=lambda each: float((np.abs(each[2].residual).clip(max=limit) ** 2).sum()), default=None)
