"""Tuning verified on random machines: `python -m studies.tune [machines] [stability machines] [first]`.

Each machine has two or three masses, friction and a delay, all drawn at random, and a response at lines with noise
that gives 95 % bounds of ±5 … 30 % of |G| at each line. What is promised for the worst plant within the bounds is
compared with the true plant; the bandwidth with that of the same search with the true plant. The second number counts
the machines at ±10 % whose proposals are only tested for stability; 10000 take about ten minutes of processor time.
They can be tested in parts: `python -m studies.tune 0 5000 5000` tests the second half, without the other tables.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from livebode import PID, Lines, Loop, Responses, TuneError
from livebode.analysis import stable
from livebode.simulation import Friction, Mechanics, Sampled, Spans, linear
from livebode_control.tuning import ControllerProposal, LoopSpecification, PredictedMargins, tune
from livebode_control.tuning.predicted import predicted
from studies.result import Table, Verdict

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

RATE_HZ = 4000.0
LINES = Lines.parse("2:160:2, 166:700:6", rate_hz=RATE_HZ, window=2000)
BOUNDS = (0.05, 0.1, 0.2, 0.3)
LIMITS = LoopSpecification(max_sensitivity=2.0, gain_margin_db=6.0, phase_margin_deg=30.0)
DENSE = np.concatenate([np.geomspace(0.02, 2, 60, endpoint=False), np.geomspace(2, 800, 6000), [2000.0]])
HELD, BANDWIDTH = 0.95, 0.9
_TO_95 = np.sqrt(np.log(20.0))


@dataclass(frozen=True)
class Machine:
    """A linear machine with its delay and the described controller."""

    plant: Sampled
    delay_s: float
    loop: Loop

    def response(self, frequency_hz: Floats) -> Complex:
        return self.plant.response(frequency_hz) * np.exp(-2j * np.pi * frequency_hz * self.delay_s)


def machines(seed: int) -> Iterator[Machine]:
    """Resonances of 35 … 150 Hz with a damping of 3 … 10 %, delays of 0 … 1.5 ms, load over motor 0.3 … 3."""
    rng = np.random.default_rng(seed)
    while True:
        inertia, radius = 10 ** rng.uniform(-3.5, -2), 0.019
        ratio, resonance = rng.uniform(0.3, 3), np.exp(rng.uniform(np.log(35), np.log(150)))
        load = ratio * inertia / radius**2
        reduced = inertia * load / (inertia + load * radius**2)
        stiffness = reduced * (2 * np.pi * resonance) ** 2
        damping = 2 * rng.uniform(0.03, 0.1) * np.sqrt(stiffness * reduced)
        belt = Mechanics(
            masses=int(rng.integers(2, 4)),  # type: ignore[arg-type]
            inertia_kg_m2=inertia,
            pulley_inertia_kg_m2=0.1 * inertia,
            load_kg=load,
            stiffness_n_per_m=stiffness,
            damping_n_s_per_m=damping,
        )
        friction = Friction(
            motor_viscous_n_m_s=inertia * rng.uniform(0, 10), load_viscous_n_s_per_m=load * rng.uniform(0, 5)
        )
        plant = linear(belt, friction, Spans.of(belt, 0.8), load).sampled(RATE_HZ)
        described = PID(gain=inertia * 20, integral_time_s=0.1, rate_hz=RATE_HZ)
        yield Machine(plant, rng.uniform(0, 1.5e-3), Loop(described))


def measured(machine: Machine, bound: float, seed: int, lines: Lines = LINES) -> Responses:
    """One response with circular noise whose 95 % bound at each line is this share of |G|."""
    truth = machine.response(lines.frequency_hz)[np.newaxis]
    sigma = bound / _TO_95 * np.abs(truth)
    noise = np.random.default_rng(seed).standard_normal((2, *truth.shape)) / np.sqrt(2)
    ones, row = np.ones(truth.shape), np.zeros(1, dtype=np.int64)
    value = truth + sigma * (noise[0] + 1j * noise[1])
    return Responses(lines, value, sigma, row + np.inf, ones, ones > 0, row, row, row + 0.0, row + 0.0)


def true_margins(machine: Machine, proposal: ControllerProposal) -> PredictedMargins | None:
    """Margins of the true loop; None where it is unstable."""
    return loop_margins(machine.response(DENSE) * proposal.feedback.model.response(DENSE))


def loop_margins(loop: Complex) -> PredictedMargins | None:
    """Margins of L at DENSE; None where the loop is unstable."""
    row = loop[np.newaxis]
    return predicted(DENSE, row, np.zeros(row.shape)) if stable(row, DENSE).all() else None


def keeps(found: PredictedMargins | None, promised: PredictedMargins) -> bool:
    """Whether the true loop has what was promised, to the digits of a table."""
    return found is not None and (
        found.max_sensitivity <= promised.max_sensitivity * 1.001
        and found.gain_margin_db >= promised.gain_margin_db - 0.01
        and found.phase_margin_deg >= promised.phase_margin_deg - 0.05
        and found.disk_margin >= promised.disk_margin - 0.001
    )


def proposed(
    machine: Machine, bound: float, seed: int, limits: LoopSpecification = LIMITS
) -> ControllerProposal | None:
    """The proposal, or None where livebode refuses."""
    try:
        return tune(measured(machine, bound, seed), machine.loop, limits, loop_checked=True)
    except TuneError:
        return None


@dataclass(frozen=True)
class Promises:
    """What became of the promises with one width of the bounds."""

    bound: float
    machines: int
    refused: int
    kept: int
    unstable: int
    bandwidth: Floats
    ms: Floats

    @property
    def row(self) -> tuple[str | int, ...]:
        made = self.machines - self.refused
        return (
            f"±{100 * self.bound:.0f} %", self.machines, self.refused, f"{100 * self.kept / max(made, 1):.1f} %",
            self.unstable, f"{np.median(self.bandwidth):.2f}", f"{np.median(self.ms):.2f}",
        )  # fmt: skip


def promises(bound: float, count: int, seed: int = 1) -> Promises:
    """Tune `count` machines, and compare with their truth and with full knowledge."""
    refused = kept = unstable = 0
    bandwidth, ms = [], []
    for number, machine in zip(range(count), machines(seed)):
        proposal = proposed(machine, bound, number)
        if proposal is None:
            refused += 1
            continue
        found = true_margins(machine, proposal)
        unstable += found is None
        kept += keeps(found, proposal.promised)
        best = proposed(machine, 0.0, number)
        if found is not None and best is not None and (full := true_margins(machine, best)) is not None:
            bandwidth.append(found.bandwidth_hz / full.bandwidth_hz)
            ms.append(found.max_sensitivity)
    return Promises(bound, count, refused, kept, unstable, np.array(bandwidth), np.array(ms))


@dataclass(frozen=True)
class StabilityCount:
    """Machines tuned, of which livebode refused some, and of whose proposals some are unstable on the true plant."""

    machines: int = 0
    refused: int = 0
    unstable: int = 0

    def __add__(self, other: StabilityCount) -> StabilityCount:
        return StabilityCount(
            self.machines + other.machines, self.refused + other.refused, self.unstable + other.unstable
        )

    def __str__(self) -> str:
        return f"{self.machines} machines, {self.refused} refused, {self.unstable} unstable"


def stability(count: int, first: int = 0, bound: float = 0.1, seed: int = 2) -> Iterator[StabilityCount]:
    """The count after each machine from number `first` on; counts of parts add up to that of the whole."""
    total = StabilityCount()
    for number, machine in zip(range(first + count), machines(seed)):
        if number < first:
            continue
        proposal = proposed(machine, bound, number)
        wrong = proposal is not None and not true_stability(machine, proposal)
        total += StabilityCount(1, proposal is None, wrong)
        yield total


def true_stability(machine: Machine, proposal: ControllerProposal) -> bool:
    """Whether the true loop is stable."""
    loop = machine.response(DENSE) * proposal.feedback.model.response(DENSE)
    return bool(stable(loop[np.newaxis], DENSE).all())


Rule = Callable[[Machine], PID]


def ultimate(machine: Machine) -> tuple[float, float]:
    """Gain and frequency of a P controller's limit of stability: as a relay finds them (Åström, Hägglund 1984)."""
    plant = machine.response(DENSE)
    turn = np.unwrap(np.angle(plant))
    at = int(np.argmax(turn <= -np.pi)) if np.any(turn <= -np.pi) else len(DENSE) - 1
    return 1 / float(np.abs(plant[at])), float(DENSE[at])


def ziegler_nichols(machine: Machine) -> PID:
    """PI from the ultimate gain Ku and period: 0.45·Ku, Ti = Tu/1.2 (Ziegler and Nichols 1942)."""
    gain, frequency_hz = ultimate(machine)
    return PID(gain=0.45 * gain, integral_time_s=1 / (1.2 * frequency_hz), rate_hz=RATE_HZ)


def symmetric_optimum(machine: Machine) -> PID:
    """Kessler 1958: for 1/(J·s) with the small time constant T, gain = J/(2·T), Ti = 4·T; T = delay + 1.5 samples."""
    small_s = machine.delay_s + 1.5 / RATE_HZ
    return PID(gain=_inertia(machine) / (2 * small_s), integral_time_s=4 * small_s, rate_hz=RATE_HZ)


def inertia_rule(machine: Machine) -> PID:
    """One-button tuning as servo drives describe it: estimate the total inertia, and take the gains for a bandwidth.

    Kinco, CD420 user manual, 8.1.2: the inertia is identified, the user enters a bandwidth, the drive computes both
    gains. Infranor, XtraPulsGEM manual: 50 Hz is the low of three bandwidths. Resonances are not identified. Gain =
    J·ω, Ti = 4/ω.
    """
    omega = 2 * np.pi * 50.0
    return PID(gain=_inertia(machine) * omega, integral_time_s=4 / omega, rate_hz=RATE_HZ)


def _inertia(machine: Machine) -> float:
    """From the lowest line, where the machine is rigid."""
    f = LINES.frequency_hz[:1]
    return float(1 / (2 * np.pi * f[0] * np.abs(machine.response(f)[0])))


RULES: dict[str, Rule] = {
    "Ziegler–Nichols, relay": ziegler_nichols,
    "symmetric optimum": symmetric_optimum,
    "drive: inertia, 50 Hz": inertia_rule,
}


def against_rules(count: int, bound: float = 0.1, seed: int = 1) -> Table:
    """Bandwidth, Ms and failures (unstable, or Ms above 4) of the rules, which know the true plant, and of livebode."""
    found: dict[str, list[PredictedMargins | None]] = {name: [] for name in RULES}
    found["livebode tune, ±10 %"], refused = [], 0
    for number, machine in zip(range(count), machines(seed)):
        for name, rule in RULES.items():
            found[name].append(loop_margins(machine.response(DENSE) * rule(machine).response(DENSE)))
        proposal = proposed(machine, bound, number)
        refused += proposal is None
        if proposal is not None:
            found["livebode tune, ±10 %"].append(true_margins(machine, proposal))
    rows = []
    for name, margins in found.items():
        good = [m for m in margins if m is not None]
        wrong = sum(m is None or m.max_sensitivity > 4 for m in margins)
        rows.append(
            (
                name, len(margins), sum(m is None for m in margins), wrong,
                f"{np.median([m.bandwidth_hz for m in good]):.1f}" if good else "–",
                f"{np.median([m.max_sensitivity for m in good]):.2f}" if good else "–",
            )
        )  # fmt: skip
    header = ("way", "machines", "unstable", "failed", "bandwidth, Hz", "Ms")
    return Table(f"Against what users take ({refused} refused by livebode)", header, rows)


def tuning_ms(count: int = 20) -> float:
    """Median processor time of one tuning, ms."""
    spent = []
    for number, machine in zip(range(count), machines(3)):
        responses = measured(machine, 0.1, number)
        began = time.thread_time()
        try:
            tune(responses, machine.loop, LIMITS, loop_checked=True)
        except TuneError:
            continue
        spent.append(1e3 * (time.thread_time() - began))
    return float(np.median(spent))


def show(table: Table) -> None:
    print(table.caption)
    rows = [table.header, *([str(cell) for cell in row] for row in table.rows)]
    widths = [max(len(row[i]) for row in rows) for i in range(len(table.header))]
    for row in rows:
        print("  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths)))


def show_promises(count: int) -> None:
    """The tables of `count` machines at each width of the bounds."""
    found = [promises(bound, count) for bound in BOUNDS]
    header = ("bounds", "machines", "refused", "kept", "unstable", "bandwidth/full", "Ms")
    show(Table("Promises on the true plant", header, [one.row for one in found]))
    show(against_rules(count))
    share = min(one.kept / max(one.machines - one.refused, 1) for one in found)
    print(f"one tuning: {tuning_ms():.0f} ms of processor time (median)")
    for verdict in (
        Verdict("promised margins hold, share of machines at each width", share, HELD, at_least=True, why="measured"),
        Verdict("bandwidth at ±5 % over full knowledge, median", float(np.median(found[0].bandwidth)), BANDWIDTH,
                at_least=True, why="the bounds cost it"),
    ):  # fmt: skip
        print(verdict)


def show_stability(count: int, first: int) -> None:
    """The count, with progress every 100 machines."""
    total = StabilityCount()
    for total in stability(count, first):
        if total.machines % 100 == 0:
            print(f"±10 %, from machine {first}: {total}", flush=True)
    made = total.machines - total.refused
    print(Verdict(f"unstable proposals at ±10 % in {made}", total.unstable, 0, why="measured"))


def main(count: int = 200, stability_count: int = 1000, first: int = 0) -> None:
    if count:
        show_promises(count)
    show_stability(stability_count, first)


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
