"""Whether friction explains the error of a model without it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.fitting.problem import Measured, Problem, Solution
from livebode.fitting.weighing import lacks_more_than, own_epsilon, weights

_FROM = 0.03
_EXPLAINED = 0.5
_ROUNDS = 15


def held_by_friction(problem: Problem, measured: Measured, without: Solution, dof: Floats) -> NDArray[np.bool_]:
    """Rows whose ε falls to less than half as soon as one viscous friction of the model is fitted too.

    Dry friction of an axis at standstill acts on such a small motion much like a viscous one, and a real viscous one
    biases stiffness and inertia alike. Only rows with a model error above 3 % of |G| are examined; the error of a wrong
    model is not explained by friction.
    """
    found = np.zeros(len(dof), dtype=bool)
    frictions = [name for name in problem.model.frictions if name in problem.held]
    lacking = np.flatnonzero(lacks_more_than(_FROM, measured, without.response, dof))
    if not (lacking.size and frictions):
        return found
    some = measured[lacking]
    eps = own_epsilon(some, without.response[lacking], dof[lacking])
    for name in frictions:
        wider = problem.variant(free=(name,))
        at = wider.model.names.index(name)
        start = without.values[lacking]
        start[:, at] = wider.model.shown(start, problem.grid)[:, at]
        weight = weights(some.sigma, np.abs(some.value), eps / 2)
        solution, _ = wider.solve(some, weight, start, _ROUNDS)
        found[lacking] |= own_epsilon(some, solution.response, dof[lacking] - 1) < _EXPLAINED * eps
    return found
