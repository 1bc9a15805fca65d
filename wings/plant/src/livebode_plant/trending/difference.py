"""Difference: a quantity of two machines, or of one machine in two spans of time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from livebode.arrays import Floats
from livebode_plant.trending.fleet import discoveries
from livebode_plant.trending.quantity_history import History, MachineHistory
from livebode_plant.trending.robust_fit import rank_of, robust_fit

_RUNS_MIN = 8  # of each side
_BOUND_95 = 1.959964


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
    found = [(history, _regressed(one, other)) for history, one, other in pairs]
    few = [history.name for history, one in found if one is None]
    known = [(history, one) for history, one in found if one is not None]
    significant = discoveries([one[4] for _, one in known])
    return [
        LevelDifference(history.model, history.name, history.unit, *one[:5], own, one[5])
        for (history, one), own in zip(known, significant)
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
    sigma = np.where(np.isfinite(side.bound_95) & (side.bound_95 > 0), side.bound_95, 0.0) / _BOUND_95
    rows = np.column_stack([side.value, sigma, *(covariates[name] for name in names)])
    return np.asarray(rows[np.isfinite(rows).all(axis=1)])
