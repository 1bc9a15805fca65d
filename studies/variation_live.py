"""What the bounds of a live average cover while the machine changes, and whether a change is reported.

`python -m studies.variation_live` simulates a belt axis at standstill for 20 s. Its stiffness falls evenly, settles,
steps, or goes to and fro. Each run is tracked with `average` and the default `forgetting`, so that a response is the
mean of about nine periods. Of the true responses at random moments of the nine periods about a response's effective
time, the table has the shares within its bounds of 63.2 % and 98.2 %. `noise` are these shares for sigma without its
part of time variation; `width` is the mean bound over the least radius that covers as much at the same time and line;
`variation` the rms of that part over the true standard deviation within the nine periods. The last columns are the
share of runs with the event `response-changes`, and when it comes. At the end: the share of runs of ten minutes at rest
with that event.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from math import expm1

import numpy as np
from scipy.interpolate import CubicSpline

from livebode import Lines, multisine
from livebode.core import Event, widened
from livebode.estimation import LastingChange, Settings, Tracker
from livebode.simulation import BeltAxis, Mechanics, Sensor, SimulatedAxis, Standstill, TensionLoss
from studies.common import RATE_HZ, SIGMA, WINDOW, Complex, Floats

LINES = Lines.parse("20:140:10", RATE_HZ, WINDOW)
SECONDS, POSITION_M, PERIOD_S = 20.0, 0.8, WINDOW / RATE_HZ
FORGETTING = 0.8
PERIODS = (1 + FORGETTING) / (1 - FORGETTING)  # (Σw)²/Σw²
MOMENTS = 8  # random ones for each response
SETTLED_S = 3.0  # before which the average has fewer periods
PROMISES = -expm1(-1.0), -expm1(-4.0)
Course = Callable[[Floats], Floats]

COURSES: dict[str, Course] = {
    "rest": lambda t: 0.0 * t,
    "linear, 40 % in 20 s": lambda t: 0.4 * t / SECONDS,
    "linear, 10 % in 20 s": lambda t: 0.1 * t / SECONDS,
    "settling, 30 % in 4 s": lambda t: 0.3 * (1 - np.exp(-np.maximum(t - 5, 0) / 4)),
    "step, 10 % at 10 s": lambda t: 0.1 * (t >= 10),
    "periodic, ±5 % in 6 s": lambda t: 0.05 * (1 - np.cos(2 * np.pi * t / 6)),
    "periodic, ±5 % in 1.5 s": lambda t: 0.05 * (1 - np.cos(2 * np.pi * t / 1.5)),
}


@dataclass(frozen=True, kw_only=True)
class Softening(TensionLoss):
    """A loss of stiffness on any course."""

    course: Course

    def share(self, time_s: Floats) -> Floats:
        return np.asarray(self.course(time_s) / self.loss)


def axis(course: Course, seed: int, seconds: float = SECONDS) -> BeltAxis:
    return BeltAxis(
        mechanics=Mechanics(),
        motion=Standstill(position_m=POSITION_M),
        sensor=Sensor(noise_rad_per_s=SIGMA),
        excitation_n_m=multisine(LINES),
        faults=(Softening(loss=0.5, ramp_s=seconds, course=course),),
        seconds=seconds,
        run_in_s=3.0,
        seed=seed,
    )


def truth_of(course: Course) -> Callable[[Floats], Complex]:
    """The response at any times, shape (times, lines)."""
    losses = np.linspace(0.0, 0.45, 31)
    machine = axis(lambda t: 0.45 * t / SECONDS, 0)
    times_s = losses / 0.45 * SECONDS
    spline = CubicSpline(
        losses, [machine.linear(POSITION_M, t).sampled(RATE_HZ).response(LINES.frequency_hz) for t in times_s]
    )
    return lambda time_s: np.asarray(spline(course(time_s)))


@dataclass
class Found:
    """Of all runs of a case: errors at random moments, sigma and its part, shapes (runs, rows, lines[, moments])."""

    errors: Floats
    sigma: Floats
    variation: Floats
    dof: Floats
    spread: Floats
    reported_s: list[float]

    def shares(self, sigma: Floats) -> list[float]:
        bounds = [widened(sigma, self.dof[..., np.newaxis], c)[..., np.newaxis] for c in (1.0, 2.0)]
        return [float(np.mean(self.errors <= bound)) for bound in bounds]

    def widths(self) -> list[float]:
        bounds = [widened(self.sigma, self.dof[..., np.newaxis], c) for c in (1.0, 2.0)]
        least = [np.quantile(self.errors, share, axis=(0, 3)) for share in PROMISES]
        return [float(bound.mean() / own.mean()) for bound, own in zip(bounds, least)]


def measured(course: Course, runs: int, first_seed: int) -> Found:
    """Track `runs` of one course."""
    truth, rng, parts, reported = truth_of(course), np.random.default_rng(first_seed), [], []
    settings = Settings(
        lines=LINES, output="velocity", input="u", excitation="w", hop=WINDOW // 2, average=True, forgetting=FORGETTING
    )
    for seed in range(first_seed, first_seed + runs):
        events: list[Event] = []
        block, _ = SimulatedAxis(axis(course, seed)).run()
        responses = Tracker(settings).process(block, events.append)
        responses = responses[responses.time_s > SETTLED_S]
        reach_s = PERIODS * PERIOD_S / 2
        ages_s = rng.uniform(-reach_s, reach_s, (len(responses), MOMENTS))
        moments_s = np.minimum(responses.time_s[:, np.newaxis] + ages_s, SECONDS)
        true = truth(moments_s).transpose(0, 2, 1)
        grid = truth(responses.time_s[:, np.newaxis] + np.linspace(-reach_s, reach_s, 19))
        errors = np.abs(responses.value[..., np.newaxis] - true)
        parts.append((errors, responses.sigma, responses.variation, responses.dof, grid.std(axis=1)))
        reported += [event.time_s for event in events if event.kind == "response-changes"][:1]
    return Found(*(np.array(part) for part in zip(*parts)), reported)


def alarms_at_rest(runs: int, first_seed: int, minutes: float = 10.0) -> float:
    """Share of runs at rest with an event, from windows with noise."""
    count = round(60 * minutes / PERIOD_S)
    time_s, none, found = np.arange(count) * PERIOD_S, np.full(count, np.nan), 0
    for seed in range(first_seed, first_seed + runs):
        rng, events = np.random.default_rng(seed), list[Event]()
        noise = rng.standard_normal((2, count, len(LINES)))
        value = 1 + 0.02 * (noise[0] + 1j * noise[1])
        test = LastingChange(LINES, events)
        test.process(np.stack([value, np.ones_like(value)]), time_s, none, WINDOW * np.arange(count))
        found += bool(events)
    return found / runs


def main(arguments: list[str] | None = None) -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(prog="python -m studies.variation_live", description=__doc__)
    parser.add_argument("--runs", type=int, default=40, help="runs of each case")
    parser.add_argument("--rest", type=int, default=200, help="runs of ten minutes at rest")
    parser.add_argument("--seed", type=int, default=1000, help="the first seed")
    options = parser.parse_args(arguments)
    print("| stiffness | 63.2 % | 98.2 % | noise | width | variation | reported | after |\n" + "|---" * 8 + "|")
    for name, course in COURSES.items():
        found = measured(course, options.runs, options.seed)
        noise = found.shares(np.sqrt(np.maximum(found.sigma**2 - np.nan_to_num(found.variation) ** 2, 0.0)))
        cells = [" / ".join(f"{100 * share:.1f}" for share in shares) for shares in (found.shares(found.sigma), noise)]
        one, two = cells[0].split(" / ")
        width = " / ".join(f"{width:.2f}" for width in found.widths())
        true = float(np.sqrt(np.mean(found.spread**2)))
        part = f"{np.sqrt(np.nanmean(found.variation**2)) / true:.2f}" if true > 1e-6 else "–"
        when = f"{np.median(found.reported_s):.1f} s" if found.reported_s else "–"
        reported = f"{len(found.reported_s)} of {options.runs}"
        print(f"| {name} | {one} | {two} | {cells[1]} | {width} | {part} | {reported} | {when} |", flush=True)
    share = alarms_at_rest(options.rest, options.seed)
    print(f"\n{options.rest} runs of ten minutes at rest: {100 * share:.2f} % reported")


if __name__ == "__main__":
    main()
