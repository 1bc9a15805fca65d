"""Noise, distortion and time variation of a machine that changes within a recording: coverage and parts.

`python -m studies.variation [--runs 500] [--seed 1000]` simulates recordings of a machine whose response at 13 lines
changes evenly, settles, steps or varies periodically, by 1 to 10 %, with white noise at the output. Each is averaged
as windows and with `--average`. The table has for each case how many recordings are reported; the share of the
responses at random moments within one and two sigma of the mean; sigma over the least that covers 63 % within one and
98 % within two, median; and the noise and the standard deviation over the recording over the true ones, median.
For real recordings see `studies.leave_one_out`.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.core import Block, Channel, Lines, Response
from livebode.estimation import Settings, Tracker
from livebode.fitting import Drift, RunningMean

RATE_HZ, WINDOW, PERIODS = 1000.0, 200, 60
LINES = Lines.parse("20:140:10", RATE_HZ, WINDOW)
NOISE, MOMENTS = 0.1, 100
HEADER = ("change", "average", "reported", "1 sigma", "2 sigma", "width", "noise", "variation")
Course = Callable[[Floats], Floats]


def rest(_: np.random.Generator) -> Course:
    return np.zeros_like


def linear(_: np.random.Generator) -> Course:
    return lambda share: share


def settling(rng: np.random.Generator) -> Course:
    time_constant = rng.uniform(0.1, 0.4)
    return lambda share: 1 - np.exp(-share / time_constant)


def step(rng: np.random.Generator) -> Course:
    at = rng.uniform(0.1, 0.9)
    return lambda share: (share > at).astype(np.float64)


def periodic(rng: np.random.Generator) -> Course:
    cycles, phase = rng.uniform(1.5, PERIODS / 4), rng.uniform(0, 2 * np.pi)
    return lambda share: np.sin(2 * np.pi * cycles * share + phase) / 2


CASES = (rest, linear, settling, step, periodic)


@dataclass(frozen=True)
class Recording:
    """Samples with noise, and the truth: response at the beginning, and its change by the course."""

    samples: Floats
    begin: Complex
    change: Complex
    course: Course

    def response(self, share: Floats) -> Complex:
        """(moments, lines)."""
        return np.asarray(self.begin + np.outer(self.course(share), self.change))


def changes(rng: np.random.Generator, begin: Complex) -> Complex:
    """Changes of responses by 0.3 … 10 %, in any direction."""
    size = rng.uniform(0.01, 0.1) * rng.uniform(0.3, 1, begin.shape)
    return np.asarray(size * begin * np.exp(2j * np.pi * rng.uniform(size=begin.shape)))


def recorded(case: Callable[[np.random.Generator], Course], rng: np.random.Generator) -> Recording:
    """The output is the sum of the lines, each with the response of the moment."""
    n, lines = np.arange(WINDOW * PERIODS), len(LINES)
    phase = -np.pi * np.arange(lines) ** 2 / lines
    carrier = np.exp(1j * (2 * np.pi * np.outer(LINES.bins, n) / WINDOW + phase[:, np.newaxis]))
    course = case(rng)
    begin = rng.uniform(0.2, 3, lines) * np.exp(2j * np.pi * rng.uniform(size=lines))
    change = changes(rng, begin)
    now = begin[:, np.newaxis] + np.outer(change, course((n + 0.5) / n.size))
    w, y = carrier.real.sum(axis=0), (now * carrier).real.sum(axis=0)
    return Recording(np.array([w, w, y + NOISE * rng.standard_normal(n.size)]), begin, change, course)


def averaged(of: Recording, *, average: bool) -> tuple[Response, Drift]:
    """The mean of a recording as `livebode run` and `Run.average` compute it, without and with --average."""
    forgetting = {"forgetting": 1.0} if average else {}
    settings = Settings(lines=LINES, output="y", input="u", excitation="w", average=average, hop=WINDOW, **forgetting)
    mean = RunningMean()
    mean.add(Tracker(settings).process(Block(of.samples, tuple(map(Channel, "wuy")), RATE_HZ)))
    return mean.response()[0], mean.drift.result()


def row(case: Callable[[np.random.Generator], Course], average: bool, seeds: range) -> tuple[str, ...]:
    """A row of the table, by `HEADER`."""
    reported, within, width, noise, variation = 0, [], [], [], []
    noise_of_mean = NOISE * np.sqrt(4 / WINDOW / PERIODS)
    for seed in seeds:
        rng = np.random.default_rng(seed)
        of = recorded(case, rng)
        response, drift = averaged(of, average=average)
        reported += drift.significant
        distance = np.sort(np.abs(of.response(rng.uniform(size=MOMENTS)) - response.value), axis=0)
        within.append([np.mean(distance < c * response.sigma) for c in (1, 2)])
        width.append(response.sigma / np.maximum(distance[62], distance[97] / 2))
        noise.append(response.noise / noise_of_mean)
        if case is not rest:
            true = np.std(of.course(np.linspace(0, 1, 2001))) * np.abs(of.change)
            variation.append(drift.rms / true)
    one, two = 100 * np.mean(within, axis=0)
    of_rest = "" if case is rest else f"{np.median(variation):.2f}"
    shares = f"{100 * reported / len(seeds):.1f} %", f"{one:.1f} %", f"{two:.1f} %"
    return (
        case.__name__,
        "yes" if average else "no",
        *shares,
        f"{np.median(width):.2f}",
        f"{np.median(noise):.2f}",
        of_rest,
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1000)
    options = parser.parse_args()
    print(f"{options.runs} recordings a case, of {PERIODS} periods, {len(LINES)} lines")
    print("  ".join(f"{cell:>9}" for cell in HEADER))
    seeds = range(options.seed, options.seed + options.runs)
    for case in CASES:
        for average in (False, True):
            print("  ".join(f"{cell:>9}" for cell in row(case, average, seeds)), flush=True)


if __name__ == "__main__":
    main()
