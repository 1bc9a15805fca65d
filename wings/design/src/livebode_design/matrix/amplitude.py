"""The amplitude of each input for the smallest worst sigma within all limits: a convex problem."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats
from livebode.core import needing

_ROUNDS = 40
_REACHED = 1e-5  # of a limit, and of the largest cost


def best_amplitudes(cost: Floats, peaks: Floats) -> Floats:
    """a > 0 that minimises the largest Σ_j cost[r, j]/a_j² with |Σ_j peaks[s, t, j]·a_j| ≤ 1, shape (inputs,).

    The costs are convex in a and the limits linear, so the minimum is the only one. SciPy's SLSQP solves it for few
    rows and samples; those that its solution violates most are added until there are none.

    Parameters
    ----------
    cost
        At least 0, shape (rows, inputs).
    peaks
        Signals as a share of their limits, shape (signals, samples, inputs).

    Examples
    --------
    Two inputs that share one limit, of which the second is four times as costly:

    >>> best_amplitudes(np.array([[1.0, 8.0]]), np.array([[[1.0, 1.0]]])).round(4)
    array([0.3333, 0.6667])
    """
    inputs = cost.shape[1]
    alone = np.abs(peaks).max(axis=(0, 1))
    scale = 1 / (inputs * np.where(alone > 0, alone, 1.0))
    price, reach = cost / scale**2, peaks * scale
    limits, rows = np.empty((0, inputs)), np.empty((0, inputs))
    a = np.ones(inputs)
    for _ in range(_ROUNDS):
        seen = reach @ a
        worst = np.abs(seen).argmax(axis=1)
        at = np.arange(len(seen))
        violated = np.abs(seen[at, worst]) > (1 + _REACHED if len(limits) else 0)
        value = price @ a**-2.0
        known = (rows @ a**-2.0).max() if len(rows) else 0.0
        if not violated.any() and value.max() <= known * (1 + _REACHED):
            break
        signs = np.sign(seen[at, worst])[:, None]
        limits = np.vstack([limits, (signs * reach[at, worst])[violated]])
        rows = np.vstack([rows, price[[value.argmax()]]])
        a = _solved(rows, limits, a)
    return np.asarray(a * scale / np.abs(reach @ a).max())


def _solved(rows: Floats, limits: Floats, begin: Floats) -> Floats:
    """The minimum for these rows and limits only, in a and t ≥ log(cost)."""
    with needing("SciPy", "analysis", "a design for several inputs"):
        from scipy.optimize import minimize

    inside = begin / max(1.0, float((limits @ begin).max()))
    start = np.append(inside, np.log((rows @ inside**-2.0).max()))
    constraints = [
        {
            "type": "ineq",
            "fun": lambda x: x[-1] - np.log(rows @ x[:-1] ** -2.0),
            "jac": lambda x: np.hstack(
                [2 * rows * x[:-1] ** -3.0 / (rows @ x[:-1] ** -2.0)[:, None], np.ones((len(rows), 1))]
            ),
        },
        {
            "type": "ineq",
            "fun": lambda x: 1 - limits @ x[:-1],
            "jac": lambda _: np.hstack([-limits, np.zeros((len(limits), 1))]),
        },
    ]
    found = minimize(  # type: ignore[call-overload]
        lambda x: float(x[-1]),
        start,
        jac=lambda _: np.eye(len(start))[-1],
        bounds=[*[(1e-6, 1e6)] * len(inside), (None, None)],
        constraints=constraints,
        method="SLSQP",
        options={"maxiter": 200, "ftol": 1e-10},
    )
    return np.asarray(found.x[:-1], dtype=np.float64)
