"""What an excitation does to the simulated axis, to compare with what a design predicts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from livebode.simulation.configuration import BeltAxis
from livebode.simulation.source import SimulatedAxis

SETTLED_S = 10.0  # the loop is then in its periodic state to 1e-8


def extremes(
    axis: BeltAxis,
    samples: NDArray[np.float64],
    *,
    alignments: int = 1,
    seconds: float = 2.0,
    run_in_s: float = SETTLED_S,
) -> dict[str, tuple[float, float]]:
    """Lowest and highest torque, speed, travel and following error under an excitation.

    Parameters
    ----------
    axis
        The machine and its motion; its excitation is replaced.
    samples
        One period of the excitation, N m.
    alignments
        Number of starts of the excitation relative to the motion, evenly spaced over its period.
    seconds, run_in_s
        Length of each simulation, and of what precedes it.

    Returns
    -------
    dict
        (lowest, highest) of `torque` in N m, and of the cart's `speed` in m/s, `travel` (its position) and
        `following error` in m.
    """
    ranges: dict[str, tuple[float, float]] = {}
    for shift in np.arange(alignments) * len(samples) // alignments:
        run = replace(axis, excitation_n_m=np.roll(samples, shift), run_in_s=run_in_s, seconds=seconds)
        block, truth = SimulatedAxis(run).run()
        radius = axis.mechanics.radius_m
        observed = {
            "torque": block["u"],
            "speed": truth.states[1] * radius,
            "travel": truth.position_m,
            "following error": (block["position_reference"] - truth.states[0]) * radius,
        }
        for name, x in observed.items():
            low, high = ranges.get(name, (np.inf, -np.inf))
            ranges[name] = (min(low, float(x.min())), max(high, float(x.max())))
    return ranges
