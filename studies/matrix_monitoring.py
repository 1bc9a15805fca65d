"""Alarms of a matrix run: how often a healthy gantry has one, and what a weak belt gives.

Run with `python -m studies.matrix_monitoring [runs]`. Each run has 15 repetitions of the experiments and is compared
with a baseline of its own of 20, of the gantry of `studies.matrix_change`. In the second part the left belt loses 2 %
of its stiffness after 4 to 8 repetitions, also inside of a matrix that is judged.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np

from livebode.core import Event, MatrixResponses
from livebode.mimo import MatrixMonitor, MatrixTracker
from livebode.simulation import Gantry, GantryLoop
from studies.matrix_change import EXCITATION, GANTRY, NOISE_RAD_PER_S, RATE_HZ, SETTINGS
from studies.result import Verdict

RUNS, LEARNED, MONITORED = 200, 20, 15
TRACKED = replace(SETTINGS, memory=3)
PART, LOSS_PERCENT = "left belt's stiffness", 2.0
WEAK = replace(GANTRY, stiffness_n_per_m=(1 - LOSS_PERCENT / 100) * 4e5)
ALPHA = 0.05


def monitored(parts: list[tuple[Gantry, int]], rng: np.random.Generator) -> MatrixResponses:
    """The matrices of one gantry after the other, with this many repetitions each."""
    tracker, found, start = MatrixTracker(TRACKED), [], 0
    for gantry, repetitions in parts:
        w = np.tile(EXCITATION.samples, repetitions)
        noise = NOISE_RAD_PER_S * rng.standard_normal((3, w.shape[1]))
        block = GantryLoop(gantry=gantry, rate_hz=RATE_HZ).simulate(w, noise=noise)
        found.append(tracker.process(replace(block, start=start)))
        start = block.stop + start
    return MatrixResponses.join(found)


def healthy(runs: int, rng: np.random.Generator) -> tuple[int, float]:
    """Alarms at one in 30 days, and the share of judged matrices with an alarm where `ALPHA` is stated."""
    span_s = ((TRACKED.memory - 1) * TRACKED.cycle + TRACKED.span + TRACKED.lines.window) / RATE_HZ
    alarms, often, judged = 0, 0, 0.0
    for _ in range(runs):
        baseline, rows = (monitored([(GANTRY, repetitions)], rng) for repetitions in (LEARNED, MONITORED))
        alarms += len(MatrixMonitor(baseline).process(rows))
        monitor = MatrixMonitor(baseline, false_alarm_interval_s=span_s / ALPHA)
        often += sum(event.kind == "change" for event in monitor.process(rows))
        judged += monitor.judged_s / span_s
    return alarms, often / judged


def weakened(runs: int, rng: np.random.Generator) -> list[tuple[int, list[Event]]]:
    """Repetitions before the belt is weak, and the events of each run."""
    found = []
    for _ in range(runs):
        before = int(rng.integers(4, 9))
        monitor = MatrixMonitor(monitored([(GANTRY, LEARNED)], rng), description=GANTRY)
        found.append((before, monitor.process(monitored([(GANTRY, before), (WEAK, MONITORED - before)], rng))))
    return found


def main(arguments: list[str]) -> int:
    """Print what was measured."""
    runs = int(arguments[0]) if arguments else RUNS
    alarms, share = healthy(runs, np.random.default_rng(1))
    print(Verdict(f"healthy: alarms in {runs} runs at one in 30 days", alarms, 0))
    chance = 2 * (ALPHA * (1 - ALPHA) / (runs * MONITORED / TRACKED.memory)) ** 0.5
    print(Verdict(f"healthy: share of matrices with an alarm where {ALPHA:g} is stated", share, ALPHA + chance))
    found = weakened(runs, np.random.default_rng(2))
    first = [(before, events[0]) for before, events in found if events]
    print(Verdict("2 % less stiffness: runs with an alarm", len(first) / runs, 0.99, at_least=True))
    early = [event.sample < before * TRACKED.cycle for before, event in first]
    print(Verdict("alarms before the change", sum(early), 0))
    delay = [event.sample / TRACKED.cycle - before for before, event in first]
    print(Verdict("repetitions until the alarm, most", max(delay), 2 * TRACKED.memory))
    named = [event.details["part"] == PART for _, event in first]
    print(Verdict("first alarm names the left belt", float(np.mean(named)), 0.95, at_least=True))
    last = [events[-1].details["changes"][0] for _, events in found if events]
    print(Verdict("newest report names the left belt", float(np.mean([one["name"] == PART for one in last])), 0.95,
                  at_least=True))  # fmt: skip
    inside = [abs(one["amount"] + LOSS_PERCENT) < one["bound"] for one in last]
    print(Verdict("newest amount inside its 95 % bound", float(np.mean(inside)), 0.93, at_least=True))
    print(f"for example: {found[0][1][0].message}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
