"""Steps of proposals with filters, computed tick by tick: `python -m studies.tune_filter_steps [machines]`.

The linear machines of `studies.tune` without delay, measured with 95 % bounds of ±5 % at each line. The proposed
controller and its biquads are computed as a drive does; the true output is compared with the predicted step. The axis
of `studies.tune_steps` has friction, but its simulated drive has no filters.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from livebode import PID, Lines, TuneError
from livebode.simulation import Sampled
from livebode_control.tuning import tune
from livebode_control.tuning.filters import Biquad
from livebode_control.tuning.predicted_steps import predicted_steps
from studies.result import Table, Verdict
from studies.tune import LIMITS, LINES, RATE_HZ, machines, measured, show

Floats = NDArray[np.float64]

FINER = Lines.parse("2:160:1, 166:700:6", rate_hz=RATE_HZ, window=4000)
_BOUND, _SAMPLES = 0.05, 400
_INSIDE, _DEVIATION = 0.95, 0.05


def stepped(plant: Sampled, controller: PID, filters: Sequence[Biquad], samples: int) -> Floats:
    """The output after a unit step of the reference."""
    state, total, y = np.zeros(len(plant.b)), 0.0, np.empty(samples)
    memory = np.zeros((len(filters), 2))
    for n in range(samples):
        y[n] = plant.c @ state
        error = 1 - y[n]
        total += error / (RATE_HZ * controller.integral_time_s)
        u = controller.gain * (error + total)
        for one, kept in zip(filters, memory):
            (b0, b1, b2), (a1, a2), x = one.b, one.a, u
            u = b0 * x + kept[0]
            kept[:] = b1 * x - a1 * u + kept[1], b2 * x - a2 * u
        state = plant.a @ state + plant.b * u
    return y


@dataclass(frozen=True)
class FilteredStep:
    """Share of the samples within the band, and the largest deviation, over the size of the step."""

    inside: float
    deviation: float


def compared(count: int, lines: Lines = LINES, seed: int = 2) -> list[FilteredStep]:
    """One step of each machine that is not refused and has filters."""
    found = []
    for number, machine in zip(range(count), machines(seed)):
        prompt = replace(machine, delay_s=0.0)
        try:
            proposal = tune(measured(prompt, _BOUND, number, lines), prompt.loop, LIMITS, loop_checked=True)
        except TuneError:
            continue
        feedback = proposal.feedback
        if not feedback.biquads:
            continue
        assert isinstance(feedback.controller, PID)
        y = stepped(prompt.plant, feedback.controller, feedback.biquads, _SAMPLES)
        step, _ = predicted_steps(proposal.plant, feedback.model, (np.arange(y.size) + 0.5) / RATE_HZ)
        inside = float(np.mean((y >= step.low) & (y <= step.high)))
        found.append(FilteredStep(inside, float(np.abs(y - step.value[0]).max())))
    return found


def main(count: int = 200) -> None:
    found = {"2 Hz": compared(count), "1 Hz": compared(count, FINER)}
    rows = []
    for distance, steps in found.items():
        inside, deviation = (np.array([getattr(one, name) for one in steps]) for name in ("inside", "deviation"))
        rows.append(
            (
                distance, len(steps), f"{100 * inside.mean():.1f} %", f"{100 * np.median(deviation):.1f} %",
                f"{100 * deviation.max():.1f} %",
            )
        )  # fmt: skip
    header = ("lines up to 160 Hz", "steps", "in the band", "deviation", "worst")
    show(Table("Steps of proposals with filters", header, rows))
    least = min(float(np.mean([one.inside for one in steps])) for steps in found.values())
    print(Verdict("share of samples within the band", least, _INSIDE, at_least=True, why="measured"))
    deviation = float(np.median([one.deviation for one in found["2 Hz"]]))
    print(Verdict("median of the largest deviation", deviation, _DEVIATION, why="measured"))


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
