"""Levenberg–Marquardt for many small problems at once, each with its own damping."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats

Normal = Callable[[Floats], tuple[Any, ...]]
"""From parameters (problems, n): cost (problems,), gradient (problems, n), Gauss–Newton matrix (problems, n, n), and
further arrays (problems, …) that are reported for the best point."""

_RISE, _FALL = 10.0, 0.2  # factors of Marquardt's damping after a step that raised, or lowered, the cost
_STEP_MAX = 0.7  # of a logarithm: a factor of two


class Minimum(NamedTuple):
    """Result of each problem: parameters (problems, n), cost (problems,; infinite where there is none), whether it
    converged, and the further arrays of `Normal`."""

    parameters: Floats
    cost: Floats
    settled: NDArray[np.bool_]
    known: tuple[Any, ...]


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

    A step is accepted where it lowers the cost, and its damping decreases; elsewhere the damping increases. A problem
    has converged when no parameter would move by more than `tolerance`, or when the predicted decrease of the cost is
    less than `enough`; that last step is still made, and the other arrays are those before it. Ends when all have, or
    after `rounds`.
    """
    now = start.copy()
    state = normal(now)
    damping = np.full(len(now), 1e-3)
    settled = np.zeros(len(now), dtype=bool)
    for _ in range(rounds):
        tried, step = _stepped(now, state[1], state[2], damping, low, high)
        promised = -np.einsum("ri,ri->r", step, state[1]) / 2
        last = (np.abs(step).max(axis=1) < tolerance) | ((promised >= 0) & (promised < enough))
        last &= ~settled
        now[last] = tried[last]
        settled |= last
        if settled.all():
            break
        new = normal(tried)
        better = (new[0] < state[0]) & ~settled
        if better.all():
            now, state = tried, new
        else:
            now[better] = tried[better]
            for kept, other in zip(state, new):
                kept[better] = other[better]
        damping = np.where(better, damping * _FALL, damping * _RISE)
    finite = np.isfinite(state[0])
    return Minimum(now, np.where(finite, state[0], np.inf), settled & finite, state[3:])


def _stepped(
    now: Floats, gradient: Floats, matrix: Floats, damping: Floats, low: Floats | float, high: Floats | float
) -> tuple[Floats, Floats]:
    """The point after a step, within the bounds, and the step. A parameter that its bound blocks is left out."""
    n = gradient.shape[-1]
    kept = ((now <= low) & (gradient > 0)) | ((now >= high) & (gradient < 0))
    if kept.any():
        gradient = np.where(kept, 0.0, gradient)
        matrix = np.where(kept[:, :, np.newaxis] | kept[:, np.newaxis], np.eye(n), matrix)
    diagonal = np.einsum("...ii->...i", matrix)
    floor = 1e-12 * np.max(diagonal, axis=-1, keepdims=True) + 1e-300
    damped = matrix + (damping[:, np.newaxis] * diagonal + floor)[..., np.newaxis] * np.eye(n)
    with np.errstate(all="ignore"):
        step = -np.linalg.solve(damped, gradient[..., np.newaxis])[..., 0]
    tried = (now + step.clip(-_STEP_MAX, _STEP_MAX)).clip(low, high)
    return tried, tried - now
