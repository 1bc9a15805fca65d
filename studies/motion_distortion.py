"""Coverage of the bounds in steady motion under friction and play, with and without [motion].

`python -m studies.motion_distortion [machines] [seed]` draws machines of `studies.moving_machines` for each row, tracks
12 s of strokes, and prints which share of the errors of the valid lines in steady motion is within the 63 % and 98 %
bounds, how many lines are valid, the median of sigma relative to the response, and how many runs report a distortion.
A run that the correction refuses has no valid line.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np

from livebode import Block, Event, Lines, Responses, Settings, Tracker
from livebode.core import SimulationError
from livebode.excitation import odd_lines
from livebode.motion import MotionCorrection
from studies.moving_machines import Floats, Machines, drawn, recorded, truth

RATES_HZ = (4000.0, 2500.0)
TARGET = (0.60, 0.96)
_SECONDS, _WINDOW_S = 12.0, (0.2, 0.4)
KINDS = {"linear": (False, False), "friction": (True, False), "play": (False, True), "friction and play": (True, True)}


@dataclass(frozen=True)
class Found:
    """Errors of the lines in steady motion, relative to their bounds and to the response, and runs with an event."""

    within: np.ndarray  # of both bounds, (2, any), of valid lines
    sigma: Floats
    valid: float
    told: float

    @property
    def covered(self) -> tuple[float, float]:
        one, two = self.within.mean(axis=1) if self.within.size else (np.nan, np.nan)
        return float(one), float(two)


def measure(kind: str, machines: int, seed: int) -> dict[bool, Found]:
    """The result for so many machines of a kind, without and with [motion]."""
    rng = np.random.default_rng([seed, list(KINDS).index(kind)])
    parts: dict[bool, list[tuple[np.ndarray, ...]]] = {False: [], True: []}
    told = dict.fromkeys(parts, 0)
    for rate_hz, window_s in zip(RATES_HZ, _WINDOW_S):
        window = round(rate_hz * window_s)
        lines = [odd_lines(20, 140, rate_hz, window, seed=int(rng.integers(1 << 30))) for _ in range(machines // 2)]
        axes = drawn(rng, lines, *KINDS[kind])
        for i, block in enumerate(recorded(axes, lines, _SECONDS, rng)):
            for motion, rows in parts.items():
                try:
                    responses, kinds = tracked(block, lines[i], float(axes.radius_m[i]), motion)
                except SimulationError:  # the model of the motion diverges
                    kinds = {"refused"}
                else:
                    rows.append(compared(responses, block, axes.one(i)))
                told[motion] += bool(kinds & {"distorted", "held", "refused"})
    return {motion: _found(rows, told[motion] / (machines // 2 * 2)) for motion, rows in parts.items()}


def _found(rows: list[tuple[np.ndarray, ...]], told: float) -> Found:
    error, one, two, sigma, valid = (np.concatenate(column) for column in zip(*rows))
    known = valid & np.isfinite(sigma)
    return Found(np.stack([error <= one, error <= two])[:, known], sigma[known], float(valid.mean()), told)


def tracked(block: Block, lines: Lines, radius_m: float, motion: bool) -> tuple[Responses, set[str]]:
    """Responses, four a window, and the kinds of the events."""
    settings = Settings(lines=lines, output="y", input="u", excitation="w", schedule="x", hop=lines.window // 4)
    events: list[Event] = []
    if not motion:
        return Tracker(settings).process(block, events.append), {event.kind for event in events}
    correction = MotionCorrection(settings, radius_m=radius_m)
    found = Responses.join([correction.process(block, events.append), correction.finish(events.append)])
    return found, {event.kind for event in events}


def compared(responses: Responses, block: Block, machine: Machines) -> tuple[np.ndarray, ...]:
    """Errors, bounds, sigma and validity, (any,), of the windows whose speed is constant, as in the one before."""
    lines, window = responses.lines, responses.lines.window
    mean = np.convolve(block["x"], np.ones(window) / window, "valid")  # from each sample on
    at = responses.sample - 2 * window + 1
    rows = np.flatnonzero((at >= 0) & (responses.sample < len(block) - window))
    here = mean[at[rows][:, np.newaxis] + np.array([0, window // 2, window, 3 * window // 2])]
    steps = np.diff(here, axis=1)
    rows = rows[np.abs(steps - steps.mean(axis=1, keepdims=True)).max(axis=1) < 0.02 * np.abs(steps.mean(axis=1))][::2]
    exact = truth(machine, lines, responses.schedule[rows], responses.sample[rows] / len(block))
    found = np.abs(responses.value[rows] - exact), responses.bound(1)[rows], responses.bound(2)[rows]
    relative = responses.sigma[rows] / np.abs(exact)
    return (*(x.ravel() for x in (*found, relative)), responses.valid[rows].ravel())


def main(arguments: list[str]) -> int:
    machines, seed = (int(a) for a in (arguments + ["24", "1000"][len(arguments) :])[:2])
    print("| machines | [motion] | within 63 % | within 98 % | valid | median sigma | runs with an event |")
    print("|---|---|---|---|---|---|---|")
    missed = 0
    for kind in KINDS:
        for motion, found in measure(kind, machines, seed).items():
            one, two = found.covered
            missed += one < TARGET[0] or two < TARGET[1]
            sigma = 100 * np.median(found.sigma)
            print(
                f"| {kind} | {'yes' if motion else 'no'} | {100 * one:.0f} % | {100 * two:.0f} % "
                f"| {100 * found.valid:.0f} % | {sigma:.2g} % | {100 * found.told:.0f} % |",
                flush=True,
            )
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
