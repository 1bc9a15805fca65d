"""Levenberg–Marquardt for many small problems at once, each with its own damping."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

Normal = Callable[[Floats], tuple[Floats, Floats, Floats]]
"""From parameters (problems, n): cost (problems,), gradient (problems, n), Gauss–Newton matrix (problems, n, n)."""

_RISE, _FALL = 10.0, 0.2
_STEP_MAX = 0.7  # of a logarithm: a factor of two


class Minimum(NamedTuple):
    """Where each problem ended: parameters (problems, n), cost (problems,; infinite where there is none), the
    Gauss–Newton matrix there, and whether it settled."""

    parameters: Floats
    cost: Floats
    matrix: Floats
    settled: NDArray[np.bool_]


def minimise(
    normal: Normal,
    start: Floats,
    rounds: int = 30,
    tolerance: float = 1e-6,
    *,
    enough: float = 0.0,
    low: Floats | float = -np.inf,
    high: Floats | float = np.inf,
) -> Minimum:
    """Least cost of each problem near its `start`, between `low` and `high`.

    A step is taken where it lowers the cost, and its damping falls; elsewhere the damping rises. A problem has settled
    when no parameter would move by more than `tolerance`, or when a step promises to lower the cost by less than
    `enough`; that last step is still taken, uncounted. Ends when all have, or after `rounds`.
    """
    now = start.copy()
    cost, gradient, matrix = normal(now)
    damping = np.full(len(now), 1e-3)
    settled = np.zeros(len(now), dtype=bool)
    for _ in range(rounds):
        tried, step = _stepped(now, gradient, matrix, damping, low, high)
        promised = -np.einsum("ri,ri->r", step, gradient) / 2
        settled |= (np.abs(step).max(axis=1) < tolerance) | ((promised >= 0) & (promised < enough))
        if settled.all():
            now = np.where(np.isfinite(tried), tried, now)
            break
        new = normal(tried)
        better = (new[0] < cost) & ~settled if enough else new[0] < cost
        now[better] = tried[better]
        for kept, other in zip((cost, gradient, matrix), new):
            kept[better] = other[better]
        damping = np.where(better, damping * _FALL, damping * _RISE)
    return Minimum(now, np.where(np.isfinite(cost), cost, np.inf), matrix, settled & np.isfinite(cost))


def _stepped(
    now: Floats, gradient: Floats, matrix: Floats, damping: Floats, low: Floats | float, high: Floats | float
) -> tuple[Floats, Floats]:
    """Where a step leads, within the bounds, and the step."""
    n = gradient.shape[-1]
    diagonal = np.einsum("...ii->...i", matrix)
    floor = 1e-12 * np.max(diagonal, axis=-1, keepdims=True) + 1e-300
    damped = matrix + (damping[:, np.newaxis] * diagonal + floor)[..., np.newaxis] * np.eye(n)
    with np.errstate(all="ignore"):
        step = -np.linalg.solve(damped, gradient[..., np.newaxis])[..., 0]
    tried = (now + step.clip(-_STEP_MAX, _STEP_MAX)).clip(low, high)
    return tried, tried - now
