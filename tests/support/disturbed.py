"""Recordings in which some periods differ from the others."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from livebode.core import Lines
from livebode.excitation import multisine

RATE_HZ, WINDOW = 4000, 400
LINES = Lines.parse("20:140:20", RATE_HZ, WINDOW)
NOISE = 0.05


def recorded(
    periods: int = 20,
    *,
    spikes: Iterable[int] = (),
    pauses: Iterable[int] = (),
    disturbed: Iterable[int] = (),
    settles: float = 0.0,
    changes: int | None = None,
) -> dict[str, np.ndarray]:
    """A plant of gain 2; spikes are 50 times the noise, a disturbance is a tone between the lines."""
    rng = np.random.default_rng(5)
    w = np.resize(multisine(LINES), periods * WINDOW)
    at = np.arange(w.size)
    for period in pauses:
        w[period * WINDOW : (period + 1) * WINDOW] = 0.0
    u = w + NOISE * rng.standard_normal(w.size)
    y = 2 * u + settles * np.exp(-at / (WINDOW / 8)) + NOISE * rng.standard_normal(w.size)
    for period in spikes:
        y[period * WINDOW + 137] += 50 * NOISE
    for period in disturbed:
        y += np.where(at // WINDOW == period, 3 * np.sin(2 * np.pi * 33 * at / RATE_HZ), 0.0)
    if changes is not None:
        y[changes * WINDOW :] *= 1.5
    return {"w": w, "u": u, "y": y}
