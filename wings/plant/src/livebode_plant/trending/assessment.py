"""Assessment: the trends of a quantity on all machines, ranked, and differences between two of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf, isfinite, nan

import numpy as np

from livebode.arrays import Floats
from livebode.core import INTERVAL_FACTOR, needing
from livebode.dataclass import dataclass
from livebode_plant.trending.quantity_history import History, MachineHistory
from livebode_plant.trending.robust_fit import rank_of, robust_fit
from livebode_plant.trending.trend import NotAssessed, Trend

with needing("SciPy", "analysis", "a trend"):
    from scipy.stats import false_discovery_control

FALSE_DISCOVERIES = 0.05
"""Expected share of unchanged machines among those that are reported as changed."""

LOGARITHMIC = ("dB",)
"""Units of which percent have no meaning."""


@dataclass(frozen=True)
class Ranked:
    """A machine's place in the ranking.

    Attributes
    ----------
    machine
        Its path.
    trend
        Of the quantity.
    significant
        Whether it is among the discoveries.
    months
        Until the limit; 0 if it is exceeded, infinite if it is not approached, NaN if percent have no meaning.
    """

    machine: str
    trend: Trend
    significant: bool
    months: float


def months_to_limit(trend: Trend, limit_percent: float, unit: str = "") -> float:
    """Months until the change is so many percent of the level; NaN where percent have no meaning."""
    if unit in LOGARITHMIC or not isfinite(trend.relative):
        return nan
    return trend.months_to(limit_percent / trend.relative)


def discoveries(p: Sequence[float]) -> list[bool]:
    """Which of these probabilities are discoveries.

    By the step-up procedure (Benjamini and Hochberg, J. R. Stat. Soc. B 57, 1995): at most 5 % of the machines that are
    reported are expected to be unchanged. This is valid for independent machines and for those with a positive
    dependence, such as a common temperature (Benjamini and Yekutieli, Ann. Stat. 29, 2001).

    >>> discoveries([0.001, 0.2, 0.03, 0.9])
    [True, False, False, False]
    """
    if not p:
        return []
    return [bool(adjusted <= FALSE_DISCOVERIES) for adjusted in false_discovery_control(np.array(p), method="bh")]


def urgency(of: Ranked) -> tuple[bool, float, float, float]:
    """The key by which machines are sorted, the worst first.

    Discoveries come first, by the months until the limit, then by the size of the change; the others follow by
    probability.
    """
    relative = of.trend.relative if isfinite(of.trend.relative) else 1 / max(of.trend.scatter, 1e-300)
    months = of.months if isfinite(of.months) else inf
    if not of.significant:
        return True, 0.0, of.trend.p, 0.0
    return False, months, -abs(of.trend.change) * relative, of.trend.p


SILENT_S = 28 * 86400.0
"""A machine without a run for so long before the newest run of all is reported."""
LIMIT_PERCENT = 10.0


@dataclass(frozen=True, eq=False)
class Assessment:
    """A quantity of all machines.

    Attributes
    ----------
    history
        The runs.
    ranked
        The machines with a trend, the worst first.
    not_assessed
        Why the others have none, by machine.
    silent
        Last run of machines that have sent nothing for four weeks before the newest run, s since 1970.
    """

    history: History
    ranked: tuple[Ranked, ...]
    not_assessed: Mapping[str, str]
    silent: Mapping[str, float]


def assess(histories: Sequence[History], limit_percent: float = LIMIT_PERCENT) -> list[Assessment]:
    """Trends of one or several quantities, with the false discoveries of all together limited.

    Parameters
    ----------
    histories
        The quantities.
    limit_percent
        Change that needs maintenance; see `ranking`.
    """
    trends: list[tuple[int, str, Trend]] = []
    refused: list[dict[str, str]] = [{} for _ in histories]
    for number, history in enumerate(histories):
        for machine, runs in history.machines.items():
            trend = runs.trend()
            if isinstance(trend, NotAssessed):
                refused[number][machine] = trend.reason
            else:
                trends.append((number, machine, trend))
    significant = discoveries([trend.p for *_, trend in trends])
    ranked: list[list[Ranked]] = [[] for _ in histories]
    for (number, machine, trend), own in zip(trends, significant):
        months = months_to_limit(trend, limit_percent, histories[number].unit_of(machine))
        ranked[number].append(Ranked(machine, trend, own, months))
    return [
        Assessment(history, tuple(sorted(ranked[number], key=urgency)), refused[number], silent_since(history))
        for number, history in enumerate(histories)
    ]


def silent_since(found: History) -> dict[str, float]:
    """Last run of the machines that have sent nothing for four weeks before the newest run of all."""
    last = {machine: float(runs.time_s[-1]) for machine, runs in found.machines.items()}
    newest = max(last.values(), default=0.0)
    return {machine: time_s for machine, time_s in last.items() if newest - time_s > SILENT_S}


_RUNS_MIN = 8  # of each side


@dataclass(frozen=True)
class LevelDifference:
    """Second minus first.

    Attributes
    ----------
    model, name, unit
        Of the quantity.
    first, second
        Level of each side, at the mean of the covariates.
    amount, bound_95
        Their difference.
    p
        Probability of such a difference if there is none.
    significant
        Whether it is one of the discoveries: at most 5 % of them are expected to be none.
    runs
        Number of runs of each side.
    """

    model: str
    name: str
    unit: str
    first: float
    second: float
    amount: float
    bound_95: float
    p: float
    significant: bool
    runs: tuple[int, int]


def differences(
    pairs: Sequence[tuple[History, MachineHistory, MachineHistory]],
) -> tuple[list[LevelDifference], list[str]]:
    """The difference in each quantity, and the names of those with fewer than eight runs on a side.

    The levels are compared by the regression of `robust_fit`, with the covariates that both sides have. A trend within
    a side is part of its scatter, so that the bound is then wide.
    """
    compared = [(history, _regressed(first, second)) for history, first, second in pairs]
    few = [history.name for history, fit in compared if fit is None]
    known = [(history, fit) for history, fit in compared if fit is not None]
    significant = discoveries([fit[4] for _, fit in known])
    return [
        LevelDifference(history.model, history.name, history.unit, *fit[:5], own, fit[5])
        for (history, fit), own in zip(known, significant)
    ], few


def _regressed(
    one: MachineHistory, other: MachineHistory
) -> tuple[float, float, float, float, float, tuple[int, int]] | None:
    names = sorted(one.covariates.keys() & other.covariates.keys())
    sides = [_rows(side, names) for side in (one, other)]
    runs = len(sides[0]), len(sides[1])
    if min(runs) < _RUNS_MIN:
        return None
    rows = np.concatenate(sides)
    second = np.repeat([0.0, 1.0], runs)
    others = rows[:, 2:] - rows[:, 2:].mean(axis=0)
    terms = np.column_stack([np.ones(len(rows)), second, others])
    if rank_of(terms) < terms.shape[1]:
        terms = terms[:, :2]
    fit = robust_fit(terms, rows[:, 0], rows[:, 1])
    step = np.eye(terms.shape[1])[1]
    first, amount = fit.coefficients[:2].tolist()
    return first, first + amount, amount, float(fit.bound_95(step)[0]), fit.p(step), runs


def _rows(side: MachineHistory, names: Sequence[str]) -> Floats:
    """Value, standard deviation and covariates of the runs that have them all."""
    covariates: Mapping[str, Floats] = side.covariates
    sigma = np.where(np.isfinite(side.bound_95) & (side.bound_95 > 0), side.bound_95, 0.0) / INTERVAL_FACTOR
    rows = np.column_stack([side.value, sigma, *(covariates[name] for name in names)])
    return np.asarray(rows[np.isfinite(rows).all(axis=1)])
