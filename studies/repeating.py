"""Coverage of the bounds where errors repeat with the excitation, or noise is not alike at all lines.

`python -m studies.repeating [case …]` prints for each case the share of errors within the 1σ and 2σ bounds of a single
window, of an average and of the mean over a run, beside the targets, the width of sigma of the average (its rms over
that of the errors, both relative to the response), and the lines that are not valid with the reason.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.signal import lfilter

from livebode import Block, Channel, Lines, Response, Settings, Tracker, multisine
from livebode.core import QuantityKind
from livebode.excitation import odd_lines
from livebode.fitting import mean_response
from livebode.simulation import (
    Backlash,
    BeltAxis,
    Friction,
    Mechanics,
    Sensor,
    SimulatedAxis,
    Standstill,
    two_mass_loop,
)
from studies.common import RATE_HZ, Complex, Floats

TARGET = (0.60, 0.95)
POSITION_M, LEAD, PERIODS = 0.8, 4, 16
LEAD_OF_LOOP = 16_000  # samples until what the noise's beginning moves has died away
ODD = odd_lines(20, 140, RATE_HZ, 1600, seed=1)  # with a detection line near the resonance
COARSE = odd_lines(20, 140, RATE_HZ, 800, seed=1)  # detection lines at 45 and 85 Hz, the resonance between them
GRID = Lines.parse("20:140:20", RATE_HZ, 400)
ON_MAINS = Lines.of_bins([3, 5, 7, 11, 13], 400, RATE_HZ)  # 50 Hz is one of the lines
FROZEN = Mechanics(frozen_position_m=POSITION_M)
Noise = Callable[[np.random.Generator, int], Floats]


@dataclass(frozen=True)
class Case:
    """A machine and what it suffers; `reason` is that for which lines may be invalid instead of covered."""

    name: str
    axis: BeltAxis | None = None
    noise: Noise | None = None
    lines: Lines = ODD
    options: dict[str, str] = field(default_factory=dict)
    damping: float = two_mass_loop.BS
    silent: int = 0  # periods without excitation at the beginning
    output: QuantityKind = "velocity"


def simulated(name: str, **options: object) -> Case:
    return Case(name, replace(BeltAxis(mechanics=FROZEN, motion=Standstill(position_m=POSITION_M)), **options))


def white(rng: np.random.Generator, samples: int) -> Floats:
    return 0.1 * rng.standard_normal(samples)


def sloping(rng: np.random.Generator, samples: int) -> Floats:
    return np.asarray(lfilter([1], [1, -0.999], 0.02 * rng.standard_normal(samples)))


def hum(frequency_hz: float, harmonics: float, level: float = 0.05) -> Noise:
    """A tone of the mains on the output, with white noise; `harmonics` of its amplitude at two and three times it."""

    def of(rng: np.random.Generator, samples: int) -> Floats:
        angle = 2 * np.pi * frequency_hz * np.arange(samples) / RATE_HZ + rng.uniform(0, 2 * np.pi)
        tones = np.cos(angle) + harmonics * (np.cos(2 * angle) + np.cos(3 * angle))
        return level * tones + 0.1 * white(rng, samples)

    return of


QUIET = {"noise": "quiet"}
OTHERS: tuple[QuantityKind, ...] = ("position", "acceleration")
DERIVATIVE = {"position": -1, "velocity": 0, "acceleration": 1}
CASES = (
    *(simulated(f"encoder of {n} bits", sensor=Sensor(encoder_counts_per_turn=2**n)) for n in (12, 14, 16, 18, 20)),
    simulated("backlash of 10 µm", faults=(Backlash(gap_m=1e-5),)),
    replace(simulated("backlash of 10 µm, N = 800", faults=(Backlash(gap_m=1e-5),)), lines=COARSE),
    simulated("Coulomb friction of 2 N", friction=Friction(load_coulomb_n=2.0)),
    simulated("Coulomb friction of 15 N", friction=Friction(load_coulomb_n=15.0)),
    simulated("Coulomb friction of the motor", friction=Friction(motor_coulomb_n_m=0.04)),
    simulated(
        "friction of 2 N under noise",
        friction=Friction(load_coulomb_n=2.0),
        sensor=Sensor(noise_rad_per_s=0.1),
    ),
    *(
        replace(case, name=f"{output}: {case.name}", output=output)
        for case in (
            simulated("Coulomb friction of 2 N", friction=Friction(load_coulomb_n=2.0)),
            simulated("Coulomb friction of the motor", friction=Friction(motor_coulomb_n_m=0.04)),
            simulated("backlash of 10 µm", faults=(Backlash(gap_m=1e-5),)),
            simulated("encoder of 16 bits", sensor=Sensor(encoder_counts_per_turn=2**16)),
        )
        for output in OTHERS
    ),
    Case("hum on a line, with harmonics", noise=hum(50, 0.2), lines=ON_MAINS),
    Case("hum on a line, seen before the excitation", noise=hum(50, 0), lines=ON_MAINS, silent=4),
    Case("white noise, odd lines", noise=white),
    Case("quiet: white noise", noise=white, lines=GRID, options=QUIET),
    Case("quiet: narrow resonance", noise=white, lines=GRID, options=QUIET, damping=13.0),
    Case("quiet: sloping noise", noise=sloping, lines=GRID, options=QUIET),
    Case("quiet: hum beside a line", noise=hum(59, 0), lines=GRID, options=QUIET),
)


@dataclass(frozen=True)
class Found:
    """Of one case: for each way the coverage of 1σ and 2σ at valid lines, the width, which share is valid, and why."""

    coverage: dict[str, tuple[float, float]]
    width: float
    valid: float
    reasons: dict[str, list[float]]

    @property
    def met(self) -> bool:
        """Whether each way reaches the target, or no line is valid."""
        return all(np.isnan(c[0]) or (c[0] >= TARGET[0] and c[1] >= TARGET[1]) for c in self.coverage.values())


def measure(case: Case, runs: int | None = None) -> Found:
    runs = runs or (20 if case.axis else 60)
    truth = truth_of(case)
    hits: dict[str, list[Floats]] = {}
    valid: list[Floats] = []
    reasons: dict[str, set[float]] = {}
    squares = np.zeros(2)
    for seed in range(runs):
        block = recorded(case, seed)
        for way, (response, tracker) in ways(case, block).items():
            error = np.abs(response.value - truth)[response.valid]
            hits.setdefault(way, []).append(np.stack([error <= response.bound(c)[response.valid] for c in (1, 2)]))
            valid.append(response.valid)
            if way == "average":
                relative = np.stack([response.sigma[response.valid], error]) / np.abs(truth[response.valid])
                squares += np.sum(relative**2, axis=1)
            for reason, lines_hz in tracker.found()["judged"]["invalid_lines_hz"].items():
                reasons.setdefault(reason, set()).update(lines_hz)
    together = {way: np.concatenate(rows, axis=1) for way, rows in hits.items()}
    coverage = {way: tuple(h.mean(axis=1)) if h.size else (np.nan, np.nan) for way, h in together.items()}
    width = float(np.sqrt(squares[0] / squares[1])) if squares[1] else np.nan
    return Found(coverage, width, float(np.mean(valid)), {name: sorted(lines_hz) for name, lines_hz in reasons.items()})


def ways(case: Case, block: Block) -> dict[str, tuple[Response, Tracker]]:
    """The newest single window, the mean over the run, and the newest average."""
    settings = Settings(
        lines=case.lines, output="y", input="u", excitation="w", hop=case.lines.window // 4, **case.options
    )
    single, average = Tracker(settings), Tracker(replace(settings, average=True, forgetting=1.0))
    responses = single.process(block)
    last = average.process(block)[-1]
    try:
        mean = mean_response(responses)[0]
    except ValueError:  # no line was ever valid
        mean = responses[-1]
    return {"single": (responses[-1], single), "mean": (mean, single), "average": (last, average)}


def truth_of(case: Case) -> Complex:
    f = case.lines.frequency_hz
    if case.axis is not None:
        velocity = np.asarray(case.axis.linear(POSITION_M).sampled(RATE_HZ).response(f))
        return velocity * (RATE_HZ * (1 - 1 / case.lines.z)) ** DERIVATIVE[case.output]
    return two_mass_loop.TwoMassPlant(bs=case.damping).response(f)


def recorded(case: Case, seed: int) -> Block:
    """Whole periods, from when the machine has settled; other phases with each seed."""
    period = multisine(case.lines, phases="random", seed=seed)
    if case.axis is None:
        return _of_loop(case, period, seed)
    seconds = (LEAD + PERIODS) * period.size / RATE_HZ
    block, _ = SimulatedAxis(replace(case.axis, excitation_n_m=period, seconds=seconds, run_in_s=8.0, seed=seed)).run()
    y = block["velocity"]
    if DERIVATIVE[case.output] < 0:
        y = np.cumsum(y) / RATE_HZ
    elif DERIVATIVE[case.output] > 0:
        y = np.diff(y, prepend=y[0]) * RATE_HZ
    channels = Channel("w"), Channel("u"), Channel("y", kind=case.output)
    return Block(np.array([block["w"], block["u"], y])[:, LEAD * period.size :], channels, RATE_HZ)


def _of_loop(case: Case, period: Floats, seed: int) -> Block:
    drive = two_mass_loop.TwoMassLoop(two_mass_loop.TwoMassPlant(bs=case.damping))
    samples = LEAD_OF_LOOP + PERIODS * period.size
    assert case.noise is not None
    noise = case.noise(np.random.default_rng(1000 + seed), samples)[:, np.newaxis]
    u, y = drive.under(period, noise)
    w = np.tile(period, samples // period.size)
    at = LEAD_OF_LOOP - case.silent * period.size
    if case.silent:  # before the excitation there is only the noise
        still = drive.under(np.zeros(period.size), noise)
        before = slice(0, LEAD_OF_LOOP)
        w[before], u[:, before], y[:, before] = 0.0, still[0][:, before], still[1][:, before]
    return Block(np.array([w, u[0], y[0]])[:, at:], ("w", "u", "y"), RATE_HZ)


def main(names: list[str]) -> int:
    cases = [case for case in CASES if not names or case.name in names]
    print(f"target: {TARGET[0]:.0%} within 1σ and {TARGET[1]:.0%} within 2σ at the valid lines")
    missed = 0
    for case in cases:
        found = measure(case)
        missed += not found.met
        shares = ", ".join(f"{way} {c[0]:.0%}/{c[1]:.0%}" for way, c in found.coverage.items())
        reasons = "; ".join(f"{k}: {', '.join(f'{f:g}' for f in v)} Hz" for k, v in found.reasons.items())
        verdict = "met" if found.met else "missed"
        valid = f"{found.valid:.0%} valid{f' ({reasons})' if reasons else ''}"
        print(f"{verdict:6} {case.name}: {shares}; width {found.width:.1f}; {valid}")
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
