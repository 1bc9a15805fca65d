"""Levenberg–Marquardt for many small problems at once, each with its own damping."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

Normal = Callable[[Floats], tuple[Floats, Floats, Floats]]
"""From parameters (problems, n): cost (problems,), gradient (problems, n), Gauss–Newton matrix (problems, n, n)."""

_RISE, _FALL = 10.0, 0.2
_STEP_MAX = 0.7  # of a logarithm: a factor of two


def minimise(normal: Normal, start: Floats, rounds: int = 30, tolerance: float = 1e-6) -> tuple[Floats, Floats]:
    """Parameters (problems, n) of least cost near `start`, and that cost (problems,); infinite where there is none.

    A step is taken where it lowers the cost, and its damping falls; elsewhere the damping rises. Ends when no
    parameter moves by more than `tolerance`, or after `rounds`.
    """
    now = start.copy()
    cost, gradient, matrix = normal(now)
    damping = np.full(len(now), 1e-3)
    for _ in range(rounds):
        step = _step(gradient, matrix, damping)
        tried = normal(now + step)
        better = tried[0] < cost
        now[better] += step[better]
        for kept, new in zip((cost, gradient, matrix), tried):
            kept[better] = new[better]
        damping = np.where(better, damping * _FALL, damping * _RISE)
        if np.max(np.abs(step)) < tolerance:
            break
    return now, np.where(np.isfinite(cost), cost, np.inf)


def _step(gradient: Floats, matrix: Floats, damping: Floats) -> Floats:
    n = gradient.shape[-1]
    diagonal = np.einsum("...ii->...i", matrix)
    floor = 1e-12 * np.max(diagonal, axis=-1, keepdims=True) + 1e-300
    damped = matrix + (damping[:, np.newaxis] * diagonal + floor)[..., np.newaxis] * np.eye(n)
    step = -np.linalg.solve(damped, gradient[..., np.newaxis])[..., 0]
    return np.asarray(step.clip(-_STEP_MAX, _STEP_MAX))
