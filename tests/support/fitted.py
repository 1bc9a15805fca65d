"""Known models and noisy responses to fit them to."""

from __future__ import annotations

import numpy as np

from livebode.core import Lines, Responses
from livebode.fitting import Parameter, PhysicalModel

LINES = Lines.parse("20:140:20", rate_hz=4000, window=400)
TRUTH = np.array([0.0028, 6.7, 5.0e5, 130.0, 0.0, 0.0, 0.0])


class Pendulum(PhysicalModel):
    """A user's model: torque to angle of a pendulum."""

    name = "pendulum"
    parameters = (
        Parameter("J", "kg m²", start=0.1, low=1e-6, high=1e3),
        Parameter("c", "N m s/rad", start=1.0, low=1e-6, high=1e3),
        Parameter("k", "N m/rad", start=1e3, low=1e-3, high=1e7),
        Parameter("delay", "s", start=0.0, low=-0.01, high=0.01),
    )

    def transfer(self, inertia, damping, stiffness):
        return [1.0], [inertia, damping, stiffness]


def noisy(
    value: np.ndarray,
    lines: Lines,
    relative: float,
    rows: int,
    seed: int = 0,
    dof: float = np.inf,
    reported: float = 1.0,
) -> Responses:
    """`rows` times the same response with noise of `relative`·|G|; its sigma is `reported` times that, from dof."""
    rng = np.random.default_rng(seed)
    shape = (rows, len(lines))
    sigma = np.broadcast_to(relative * np.abs(value), shape)
    noise = sigma * (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)
    judged = reported * sigma * (np.sqrt(rng.gamma(dof, 1 / dof, shape)) if np.isfinite(dof) else 1.0)
    n = np.arange(rows)
    return Responses(
        lines=lines, value=value + noise, sigma=judged, dof=np.full(rows, dof), coherence=np.ones(shape),
        valid=np.ones(shape, dtype=bool), first=20 * n, sample=20 * n + lines.window - 1, time_s=n / 200,
        schedule=np.full(rows, np.nan),
    )  # fmt: skip
