"""Whether friction explains what a model without it lacks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.fitting.problem import Measured, Problem
from livebode.fitting.weighing import own_epsilon, weights

Floats = NDArray[np.float64]

_FROM = 0.03
_EXPLAINED = 0.5


def held_by_friction(problem: Problem, measured: Measured, values: Floats, epsilon: Floats) -> NDArray[np.bool_]:
    """Rows whose ε (rows,) falls to less than half as soon as one viscous friction of the model is fitted too.

    Dry friction that holds an axis at standstill acts on so small a motion much like a viscous one, and a real
    viscous one biases stiffness and inertia alike. Looked at are rows that lack more than 3 % of |G|; what another
    machine than the model's lacks, friction does not explain.
    """
    found = np.zeros(len(epsilon), dtype=bool)
    lacking = np.flatnonzero(epsilon > _FROM)
    frictions = [name for name in problem.model.frictions if name in problem.held]
    if not (lacking.size and frictions):
        return found
    some, eps = measured.rows(lacking), epsilon[lacking]
    for name in frictions:
        wider = Problem(problem.model, problem.grid, {k: v for k, v in problem.held.items() if k != name}, (name,))
        at = wider.model.names.index(name)
        start = values[lacking].copy()
        start[:, at] = wider.model.drag(start, problem.grid)[:, at]
        weight = weights(some.sigma, np.abs(some.value), eps / 2)
        solution, _ = wider.solve(some, weight, start, _ROUNDS)
        dof = 2.0 * np.count_nonzero(some.use, axis=1) - wider.size
        found[lacking] |= own_epsilon(some, solution.response, dof) < _EXPLAINED * eps
    return found


_ROUNDS = 15
