"""Alarms of a matrix run: how often a healthy gantry has one, and what a weak belt gives.

Run with `python -m studies.matrix_monitoring [runs]`. Each run has 15 repetitions of the experiments and is compared
with a baseline of its own of 20, of the gantry of `studies.matrix_change`, whose lines are at every bin. In the second
part the left belt loses 2 % of its stiffness after 4 to 8 repetitions, also inside of a matrix that is judged.

All this is done twice: with white noise on the speeds, and with a random torque as well, alike on both motors and with
a corner of 20 Hz, so that it leaks into many lines at once. Then how far the errors of the lines are alike is printed.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from livebode.core import Event, MatrixResponses
from livebode.fitting import mean_matrix
from livebode.simulation import Gantry, GantryLoop
from livebode_matrix import MatrixMonitor, MatrixTracker
from livebode_matrix.line_correlation import RowSteps
from studies.matrix_change import EXCITATION, GANTRY, NOISE_RAD_PER_S, RATE_HZ, SETTINGS
from studies.result import Verdict

RUNS, LEARNED, MONITORED = 200, 20, 15
TRACKED = replace(SETTINGS, memory=3)
PART, LOSS_PERCENT = "left belt's stiffness", 2.0
WEAK = replace(GANTRY, stiffness_n_per_m=(1 - LOSS_PERCENT / 100) * 4e5)
ALPHA = 0.05
_NOISE = "the change is near the smallest that three repetitions detect under this torque"
TORQUE_N_M, POLE = 0.03, float(np.exp(-2 * np.pi * 20 / RATE_HZ))


def monitored(parts: list[tuple[Gantry, int]], rng: np.random.Generator, torque_n_m: float) -> MatrixResponses:
    """The matrices of one gantry after the other, with this many repetitions each and a random torque of this rms."""
    tracker, found, start = MatrixTracker(TRACKED), [], 0
    for gantry, repetitions in parts:
        w = np.tile(EXCITATION.samples, repetitions)
        noise = NOISE_RAD_PER_S * rng.standard_normal((3, w.shape[1]))
        torque = torque_n_m * np.sqrt(1 - POLE**2) * lfilter([1.0], [1.0, -POLE], rng.standard_normal(w.shape[1]))
        block = GantryLoop(gantry=gantry, rate_hz=RATE_HZ).simulate(w, np.tile(torque, (2, 1)), noise)
        found.append(tracker.process(replace(block, start=start)))
        start = block.stop + start
    return MatrixResponses.join(found)


def healthy(runs: int, rng: np.random.Generator, torque_n_m: float) -> tuple[int, float]:
    """Alarms at one in 30 days, and the share of judged matrices with an alarm where `ALPHA` is stated."""
    span_s = ((TRACKED.memory - 1) * TRACKED.cycle + TRACKED.span + TRACKED.lines.window) / RATE_HZ
    alarms, often, judged = 0, 0, 0.0
    for _ in range(runs):
        baseline, rows = (monitored([(GANTRY, one)], rng, torque_n_m) for one in (LEARNED, MONITORED))
        alarms += len(MatrixMonitor(baseline).process(rows))
        monitor = MatrixMonitor(baseline, false_alarm_interval_s=span_s / ALPHA)
        often += sum(event.kind == "change" for event in monitor.process(rows))
        judged += monitor.judged_s / span_s
    return alarms, often / judged


def weakened(runs: int, rng: np.random.Generator, torque_n_m: float) -> list[tuple[int, list[Event]]]:
    """Repetitions before the belt is weak, and the events of each run."""
    found = []
    for _ in range(runs):
        before = int(rng.integers(4, 9))
        monitor = MatrixMonitor(monitored([(GANTRY, LEARNED)], rng, torque_n_m), description=GANTRY)
        rows = monitored([(GANTRY, before), (WEAK, MONITORED - before)], rng, torque_n_m)
        found.append((before, monitor.process(rows)))
    return found


def alike(rng: np.random.Generator, torque_n_m: float) -> float:
    """Variance of the sum over the lines, over that of independent lines, as ten baselines show it (median)."""
    found = []
    for _ in range(10):
        rows = monitored([(GANTRY, LEARNED)], rng, torque_n_m)
        mean = mean_matrix(rows)
        use = mean.valid[0].all(axis=1)
        found.append(RowSteps.of(rows).correlation(use, mean.noise[0, use], mean.spread[0, use]).second)
    return float(np.median(found))


def main(arguments: list[str]) -> int:
    """Print what was measured."""
    runs = int(arguments[0]) if arguments else RUNS
    for name, torque_n_m in (("white noise", 0.0), ("and a coloured torque", TORQUE_N_M)):
        print(f"{name}: lines are alike by {alike(np.random.default_rng(3), torque_n_m):.2f} (1: independent)")
        report(runs, torque_n_m)
    return 0


def report(runs: int, torque_n_m: float) -> None:
    """The same with one disturbance."""
    alarms, share = healthy(runs, np.random.default_rng(1), torque_n_m)
    print(Verdict(f"healthy: alarms in {runs} runs at one in 30 days", alarms, 0))
    chance = 2 * (ALPHA * (1 - ALPHA) / (runs * MONITORED / TRACKED.memory)) ** 0.5
    print(Verdict(f"healthy: share of matrices with an alarm where {ALPHA:g} is stated", share, ALPHA + chance))
    found = weakened(runs, np.random.default_rng(2), torque_n_m)
    first = [(before, events[0]) for before, events in found if events]
    print(Verdict("2 % less stiffness: runs with an alarm", len(first) / runs, 0.99, at_least=True, why=_NOISE))
    early = [event.sample < before * TRACKED.cycle for before, event in first]
    print(Verdict("alarms before the change", sum(early), 0))
    delay = [event.sample / TRACKED.cycle - before for before, event in first]
    print(Verdict("repetitions until the alarm, most", max(delay), 2 * TRACKED.memory, why=_NOISE))
    named = [event.details["part"] == PART for _, event in first]
    print(Verdict("first alarm names the left belt", float(np.mean(named)), 0.95, at_least=True))
    reports = [[one.details["changes"] for one in events if "changes" in one.details] for _, events in found]
    last = [one[-1][0] for one in reports if one and one[-1]]
    print(Verdict("newest report names the left belt", float(np.mean([one["name"] == PART for one in last])), 0.95,
                  at_least=True))  # fmt: skip
    inside = [abs(one["amount"] + LOSS_PERCENT) < one["bound"] for one in last]
    print(Verdict("newest amount inside its 95 % bound", float(np.mean(inside)), 0.93, at_least=True))
    print(f"for example: {next(events for _, events in found if events)[0].message}", flush=True)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
