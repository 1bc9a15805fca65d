"""Bounds of fits whose model lacks something, and of fits whose model is right: `python -m studies.fit_bounds [runs]`.

Each run is one response of two masses (Table I of Nevaranta 2016 at 0.8 m) at 21 lines, 20 … 120 Hz, with noise of 1 %
of |G|, and something that the fitted model does not have. What counts is how often the 95 % bounds cover the true Js,
mL, Keff and bs, and how wide they are beside those of the same model without competitors.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from livebode.core import Lines, Responses
from livebode.fitting import EvaluationGrid, Fitter, TwoMass, fit
from livebode.fitting.extended import LAG, MODE, ExtendedModel
from livebode.simulation import BeltAxis, Mechanics
from studies.result import Verdict

RUNS = 200
NOISE = 0.01
COVERED, WIDER = 0.90, 1.3
LINES = Lines.parse("20:120:5", rate_hz=4000, window=800)
WIDE = Lines.parse("20:200:5", rate_hz=4000, window=800)
BELT = TwoMass(radius_m=0.019)
TRUTH = {"Js": 0.0028, "mL": 6.7, "Keff": 5.0e5, "bs": 130.0}
FITTED = tuple(TRUTH)

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Case:
    """A machine, the model that is fitted to it, and what of it is true.

    Attributes
    ----------
    value
        Its response at `lines`.
    free
        What the user frees.
    truth
        Js, mL, Keff, bs, as far as two masses have a true value of them.
    right
        Whether the fitted model is the machine's.
    noise
        Standard deviation of the lines' noise as a share of |G|.
    """

    name: str
    value: Complex
    free: tuple[str, ...] = ()
    truth: tuple[float, ...] = tuple(TRUTH.values())
    right: bool = False
    noise: float = NOISE
    lines: Lines = LINES


def belt(**others: float) -> Complex:
    """Two masses with a friction or a delay."""
    return BELT.at([(TRUTH | others).get(name, 0.0) for name in BELT.names], EvaluationGrid.of(LINES))


def with_extra(extra: str, **others: float) -> Complex:
    """Two masses with something beside them."""
    model = ExtendedModel(BELT, (extra,), LINES.frequency_hz[-1])
    return model.at([(TRUTH | others).get(name, 0.0) for name in model.names], EvaluationGrid.of(LINES))


def with_mode(frequency_hz: float, share: float) -> Complex:
    """A further mode whose gain is a share of the motor's 1/Js."""
    return with_extra(MODE, mode=frequency_hz, mode_damping=0.03, mode_gain=share / TRUTH["Js"])


def three_masses() -> Case:
    """The simulated belt with its free pulley; true is what its rigid body and its first mode make of two masses.

    The design's Js counts that pulley with the motor, but it moves with the cart: no response shows that number.
    """
    machine = BeltAxis(mechanics=Mechanics(masses=3)).linear(0.8)
    pole, vectors = np.linalg.eig(machine.a)
    residue = (machine.c @ vectors).ravel() * np.linalg.solve(vectors, np.asarray(machine.b).ravel())
    rigid = float(residue[np.abs(pole) < 1].sum().real)
    first = np.flatnonzero((pole.imag > 1) & (np.abs(pole) < 2 * np.pi * 100))[0]
    inertia = 1 / (rigid + 2 * residue[first].real)
    load = 1 / rigid - inertia
    reduced, arm = inertia * load * rigid, 0.019**2
    stiffness, damping = abs(pole[first]) ** 2 * reduced, -2 * pole[first].real * reduced
    value = machine.sampled(4000.0).response(WIDE.frequency_hz)
    truth = (inertia, load / arm, stiffness / arm, damping / arm)
    return Case("three-mass belt by two masses, 20 … 200 Hz", value, truth=truth, lines=WIDE)


def cases() -> list[Case]:
    return [
        Case("the model is right", belt(), right=True),
        Case("the model is right but for 1.5 ticks of delay", belt(delay=3.75e-4), right=True),
        Case("mode above the band, 200 Hz, 5 % of 1/Js", with_mode(200, 0.05)),
        Case("mode above the band, 200 Hz, 30 % of 1/Js", with_mode(200, 0.3)),
        Case("mode above the band, 200 Hz, 30 % of 1/Js, noise 0.1 %", with_mode(200, 0.3), noise=0.001),
        Case("mode at the band's edge, 125 Hz, 10 % of 1/Js", with_mode(125, 0.1)),
        Case("friction not freed, BL 10 N s/m", belt(BL=10.0)),
        Case("friction not freed, B 5 mN m s", belt(B=0.005)),
        Case("lag of 0.4 ms, the delay freed", with_extra(LAG, lag=4e-4), free=("delay",)),
        Case("lag of 1 ms, the delay freed", with_extra(LAG, lag=1e-3), free=("delay",)),
        three_masses(),
    ]


def responses_of(case: Case, runs: int, seed: int = 12) -> Responses:
    """As many noisy responses of one case, with known sigma."""
    rng = np.random.default_rng(seed)
    shape, rows = (runs, len(case.lines)), np.arange(runs)
    sigma = np.broadcast_to(case.noise * np.abs(case.value), shape)
    noise = sigma * (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)
    ones, unknown = np.ones(shape), np.full(runs, np.nan)
    return Responses(case.lines, case.value + noise, sigma, rows + np.inf, ones, ones > 0, rows, rows, unknown, unknown)


@dataclass(frozen=True)
class Found:
    """Coverage of the 95 % bounds of Js, mL, Keff, bs without and with competitors, how wide the latter are beside the
    former, and the share of fits that are reported as incomplete."""

    case: Case
    before: Floats
    now: Floats
    wider: Floats
    incomplete: float


def measure(case: Case, runs: int) -> Found:
    """Fit every run with competitors, and without."""
    measured = responses_of(case, runs)
    # A right model has the delay that is there; before, nobody freed one.
    free = ("delay",) if case.free or (case.right and "delay" in case.name) else ()
    fixed = {} if free else {"delay": 0.0}
    before = Fitter(BELT, free=free, fixed=fixed).process(measured).only(FITTED)
    fits = [fit(measured[i], BELT, free=case.free) for i in range(runs)]
    value = np.array([[f[name] for name in FITTED] for f in fits])
    bound = np.array([[f.bound(name) for name in FITTED] for f in fits])
    old = np.abs(before.value - case.truth) <= before.bound()
    now = np.abs(value - case.truth) <= bound
    wider = np.nanmean(bound / before.bound(), axis=0)
    return Found(case, old.mean(axis=0), now.mean(axis=0), wider, float(np.mean([not f.complete for f in fits])))


def verdicts(found: list[Found]) -> list[Verdict]:
    """Against the targets."""
    result = []
    for one in found:
        claim = f"{one.case.name}: least coverage of Js, mL, Keff, bs"
        result.append(Verdict(claim, float(one.now.min()), 0.93 if one.case.right else COVERED, at_least=True))
        if one.case.right:
            result.append(Verdict(f"{one.case.name}: mean width over today's", float(one.wider.mean()), WIDER))
            result.append(Verdict(f"{one.case.name}: width of the widest over today's", float(one.wider.max()), WIDER))
    return result


def least_width(runs: int) -> dict[str, float]:
    """How much wider the bound of bs is with frictions free than held: the least where they are not known."""
    measured = responses_of(cases()[0], runs)
    held = Fitter(BELT).process(measured).bound()[:, BELT.names.index("bs")]
    return {
        " and ".join(free): float(
            np.median(Fitter(BELT, free=free).process(measured).bound()[:, BELT.names.index("bs")] / held)
        )
        for free in (("B",), ("BL",), ("B", "BL"))
    }


def main(runs: int) -> None:
    print(f"{runs} runs each; Js, mL, Keff, bs: covered by 95 % bounds before and now, in %; width now over before")
    found = []
    for case in cases():
        one = measure(case, runs)
        found.append(one)
        before, now = (" ".join(f"{100 * x:5.1f}" for x in part) for part in (one.before, one.now))
        wide = " ".join(f"{x:4.2f}" for x in one.wider)
        print(f"{case.name:58} {before} | {now} | {wide} | incomplete {100 * one.incomplete:.0f} %", flush=True)
    for verdict in verdicts(found):
        print(verdict)
    for free, times in least_width(runs).items():
        print(f"bound of bs with {free} free over that without: {times:.2f}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else RUNS)
