"""Answers of the package best-linear-approximation (PyPI, Python ≥ 3.12) to a seeded closed loop with a cube.

    python3.12 -m venv /tmp/bla && /tmp/bla/bin/pip install best-linear-approximation
    /tmp/bla/bin/python tools/bla_reference.py tests/fitting/stored/best_linear_approximation.json

The package follows R. Pintelon, J. Schoukens, System Identification, 2nd ed., Wiley 2012, section 4.3.
`tests/fitting/test_recordings_truth.py` compares livebode with them on the same records.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np

RATE_HZ, WINDOW, PERIODS, REALISATIONS = 1000.0, 256, 6, 8
BINS = tuple(range(1, 61, 2))
_SETTLING = 3  # periods before the first recorded one
_SEED = 20


def records(cube: float, noise: float = 0.02) -> np.ndarray:
    """Reference w, input u and output y, shape (3, REALISATIONS, PERIODS, WINDOW).

    x is u through 0.5/(1 − 0.5·z⁻¹) and a delay of one sample, y = x + cube·x³ + noise, u = w − 0.4·y, all after the
    settling of the loop.
    """
    rng = np.random.default_rng(_SEED)
    phases = rng.uniform(0, 2 * np.pi, (REALISATIONS, len(BINS)))
    angles = 2 * np.pi * np.outer(BINS, np.arange(WINDOW)) / WINDOW
    period = np.cos(angles[np.newaxis] + phases[:, :, np.newaxis]).sum(axis=1)
    w = np.tile(period / period.std(), _SETTLING + PERIODS)
    v = noise * rng.standard_normal(w.shape)
    u, y, x = np.zeros(w.shape), np.zeros(w.shape), np.zeros(REALISATIONS)
    for n in range(w.shape[1]):
        y[:, n] = x + cube * x**3 + v[:, n]
        u[:, n] = w[:, n] - 0.4 * y[:, n]
        x = 0.5 * x + 0.5 * u[:, n]
    return np.array([signal[:, _SETTLING * WINDOW :].reshape(REALISATIONS, PERIODS, WINDOW) for signal in (w, u, y)])


def answers(cube: float) -> dict[str, list[float]]:
    """Value, noise and total standard deviation of the mean, by the package."""
    from best_linear_approximation.robust import closed_loop  # of its own environment

    w, u, y = (np.moveaxis(signal, (0, 1, 2), (1, 2, 0))[:, np.newaxis] for signal in records(cube))
    found = closed_loop(w[..., 0], u, y, RATE_HZ, np.array(BINS)).G
    value = found.value[:, 0, 0]
    return {
        "re": value.real.tolist(),
        "im": value.imag.tolist(),
        "noise": found.noise.std[:, 0, 0].tolist(),
        "total": found.total.std[:, 0, 0].tolist(),
    }


if __name__ == "__main__":
    found = {f"{cube:g}": answers(cube) for cube in (0.0, 0.02, 0.1)}
    Path(sys.argv[1]).write_text(json.dumps(found, indent=1) + "\n")
