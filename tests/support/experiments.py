"""What an excitation really does to the simulated axis, for the tests of what was predicted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from livebode.simulation import BeltAxis, SimulatedAxis

RUN_IN_S = 10.0  # the loop is then in its periodic state


def extremes(
    axis: BeltAxis, samples: np.ndarray, alignments: int = 1, seconds: float = 2.0, run_in_s: float = RUN_IN_S
):
    """Lowest and highest value of each quantity over this many alignments of excitation and motion."""
    found: dict[str, tuple[float, float]] = {}
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
            low, high = found.get(name, (np.inf, -np.inf))
            found[name] = (min(low, float(x.min())), max(high, float(x.max())))
    return found
