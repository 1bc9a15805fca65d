"""Bounds of fits that lack two effects at once: `python -m studies.fit_combinations --runs 200`.

Every run is another machine: two masses behind a drive, their parameters, lines and noise drawn at random, with two of
{lag, delay, friction, further mode, third mass}, none of which is specified. Its response is exact (matrix exponentials
of a state-space model, independent of the fitted models), with known noise. Counted is how often the 95 % bounds cover
Js, mL, Keff and bs (of rigid body and first mode) and the margins of a PI loop, of those fits that call their bounds
95 % bounds; and how wide they are compared with those of the fit that knows the structure.

Seeds below 1000 are for development; the figures of the documentation begin at seed 1000.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, expm

from livebode.analysis import margins_of, stable
from livebode.core import PID, Lines, Loop, Responses
from livebode.fitting import Fit, Fitter, TwoMass, fit
from livebode.fitting.extended import LAG, MODE, ExtendedModel
from studies.result import Verdict

RUNS, SEED = 200, 1000
COVERED, WIDER = 0.90, 1.3
RATE_HZ, RADIUS_M = 4000.0, 0.02
EFFECTS = ("lag", "delay", "friction", "further mode", "third mass")
FITTED = ("Js", "mL", "Keff", "bs")
MARGINS = ("gain_margin", "phase_margin", "peak_sensitivity", "bandwidth")
LINES = (Lines.parse("25:135:10", rate_hz=4000, window=800), Lines.parse("20:140:5", rate_hz=4000, window=800))

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Machine:
    """A state-space model from motor torque to motor speed with its delay, and the two masses that it is of.

    Attributes
    ----------
    truth
        Js, mL, Keff, bs of rigid body and first mode.
    """

    a: Floats
    b: Floats
    c: Floats
    delay_s: float
    truth: Floats
    lines: Lines
    noise: float
    loop: Loop

    def response(self, frequency_hz: Floats) -> Complex:
        """Exact behind a zero-order hold at the rate and the delay, from the input's tick to the sampled output."""
        n, tick = len(self.b), 1 / RATE_HZ
        whole, late = divmod(self.delay_s * RATE_HZ, 1.0)
        held = np.zeros((n + 1, n + 1))
        held[:n, :n], held[:n, n] = self.a, self.b
        step, soon = expm(held * tick), expm(held * tick * (1 - late))
        new = soon[:n, n]
        old = step[:n, n] - new
        z = np.exp(2j * np.pi * frequency_hz * tick)
        poles, vectors = np.linalg.eig(step[:n, :n])
        left, right = self.c @ vectors, np.linalg.solve(vectors, np.stack([new, old], axis=-1).astype(complex))
        share = left / (z[:, np.newaxis] - poles)
        return np.asarray((share @ right[:, 0] + share @ right[:, 1] / z) * z**-whole)


def machine(effects: tuple[str, ...], seed: int) -> Machine:
    """A random machine with these effects."""
    rng = np.random.default_rng([seed, *(EFFECTS.index(e) for e in effects)])
    lines = LINES[int(rng.integers(len(LINES)))]
    low, top = float(lines.frequency_hz[0]), float(lines.frequency_hz[-1])
    js, ratio = _log(rng, 5e-4, 5e-3), _log(rng, 0.4, 2.5)
    omega, damping = 2 * np.pi * _log(rng, 1.9 * low, top / 1.9), _log(rng, 0.005, 0.03)
    load, rigid = js * ratio, js * (1 + ratio)
    stiffness = omega**2 * js * load / rigid
    inertias, springs = [js, load], [(stiffness, 2 * damping / omega * stiffness)]
    if "third mass" in effects:
        inertias, springs = _split(rng, inertias, springs, top)
    frictions = np.zeros(len(inertias))
    if "friction" in effects:
        drag = 2 * np.pi * low * rigid
        frictions[0], frictions[-1] = (drag * _log(rng, 0.003, 0.05) for _ in range(2))
    a, b, c = _chain(inertias, springs, frictions)
    truth = _two_masses(*_chain(inertias, springs, 0 * frictions))
    if "further mode" in effects:
        w, zeta, gain = 2 * np.pi * top * _log(rng, 1.1, 2.5), _log(rng, 0.01, 0.05), _log(rng, 0.03, 0.3) / js
        a, b, c = (
            block_diag(a, np.array([[-2 * zeta * w, -(w**2)], [1.0, 0.0]])),
            np.r_[b, 1.0, 0.0],
            np.r_[c, gain, 0.0],
        )
    if "lag" in effects:
        rate = 1 / _log(rng, 1e-4, 1e-3)
        a = np.block([[a, (b * rate)[:, np.newaxis]], [np.zeros((1, len(b))), np.array([[-rate]])]])
        b, c = np.r_[0 * b, 1.0], np.r_[c, 0.0]
    delay_s = rng.uniform(0.5, 3.0) / RATE_HZ if "delay" in effects else 0.0
    truth[1:] /= RADIUS_M**2
    noise, crossover = _log(rng, 0.001, 0.01), 2 * np.pi * _log(rng, 0.6 * low, 1.2 * low)
    loop = Loop(PID(gain=crossover * rigid, integral_time_s=8 / crossover, rate_hz=RATE_HZ))
    return Machine(a, b, c, delay_s, truth, lines, noise, loop)


def _log(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _split(
    rng: np.random.Generator, inertias: list[float], springs: list[tuple[float, float]], top_hz: float
) -> tuple[list[float], list[tuple[float, float]]]:
    """The motor's inertia as two, with a mode of both above the lines."""
    js, load = inertias
    share, omega, damping = _log(rng, 0.05, 0.4), 2 * np.pi * top_hz * _log(rng, 1.2, 2.5), _log(rng, 0.01, 0.05)
    stiffness = omega**2 * js * share * (1 - share)
    return [js * (1 - share), js * share, load], [(stiffness, 2 * damping / omega * stiffness), *springs]


def _chain(
    inertias: list[float], springs: list[tuple[float, float]], frictions: Floats
) -> tuple[Floats, Floats, Floats]:
    """States: the speeds, and the deflection of each spring."""
    n = len(inertias)
    a = np.zeros((2 * n - 1, 2 * n - 1))
    for i, (stiffness, damping) in enumerate(springs):
        a[n + i, i], a[n + i, i + 1] = 1.0, -1.0
        for mass, sign in ((i, -1.0), (i + 1, 1.0)):
            a[mass, n + i] += sign * stiffness / inertias[mass]
            a[mass, i] += sign * damping / inertias[mass]
            a[mass, i + 1] -= sign * damping / inertias[mass]
    a[np.arange(n), np.arange(n)] -= frictions / np.array(inertias)
    b, c = np.zeros(2 * n - 1), np.zeros(2 * n - 1)
    b[0], c[0] = 1 / inertias[0], 1.0
    return a, b, c


def _two_masses(a: Floats, b: Floats, c: Floats) -> Floats:
    """Js, load, stiffness and damping at the shaft of the rigid body and the first mode of a chain."""
    pole, vectors = np.linalg.eig(a)
    residue = (c @ vectors) * np.linalg.solve(vectors, b.astype(complex))
    rigid = float(residue[np.abs(pole) < 1e-6 * np.abs(pole).max()].sum().real)
    first = min(np.flatnonzero(pole.imag > 0), key=lambda i: abs(pole[i]))
    inertia = 1 / (rigid + 2 * residue[first].real)
    load = 1 / rigid - inertia
    reduced = inertia * load * rigid
    return np.array([inertia, load, abs(pole[first]) ** 2 * reduced, -2 * pole[first].real * reduced])


def true_margins(of: Machine) -> dict[str, float] | None:
    """Margins of the exact loop from a dense grid; None where it is not stable."""
    f = np.geomspace(0.05, RATE_HZ / 2, 60000)
    open_loop = of.response(f) * np.asarray(of.loop.feedback_at(f))
    if not stable(open_loop[np.newaxis], f)[0]:
        return None
    size, angle = np.log(np.abs(open_loop)), np.angle(-open_loop)
    at_gain = np.flatnonzero(size[1:] * size[:-1] < 0)
    turn = np.degrees([np.interp(0, *_ascending(size[i : i + 2], angle[i : i + 2])) for i in at_gain])
    at_phase = np.flatnonzero((open_loop.imag[1:] * open_loop.imag[:-1] < 0) & (open_loop.real[1:] < 0))
    level = np.array([np.interp(0, *_ascending(open_loop.imag[i : i + 2], size[i : i + 2])) for i in at_phase])
    if open_loop[-1].real < 0:  # at half the rate L is real
        level = np.append(level, size[-1])
    rise = -level[level < 0] * 20 / np.log(10)
    closed = np.abs(open_loop / (1 + open_loop))
    return {
        "gain_margin": float(min(rise, default=np.inf)),
        "phase_margin": float(min(turn, key=abs, default=np.inf)),
        "peak_sensitivity": float(np.max(1 / np.abs(1 + open_loop))),
        "bandwidth": float(f[np.argmax(closed < 10 ** (-3 / 20))]),
    }


def _ascending(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    return (x, y) if x[0] < x[1] else (x[::-1], y[::-1])


def measured(of: Machine, seed: int) -> Responses:
    """One noisy response with known sigma."""
    rng = np.random.default_rng([seed, 99])
    value = of.response(of.lines.frequency_hz)[np.newaxis]
    sigma, ones, row = of.noise * np.abs(value), np.ones(value.shape), np.zeros(1, dtype=int)
    noise = sigma * (rng.standard_normal(value.shape) + 1j * rng.standard_normal(value.shape)) / np.sqrt(2)
    return Responses(of.lines, value + noise, sigma, row + np.inf, ones, ones > 0, row, row, row + 0.0, row + np.nan)


def informed(effects: tuple[str, ...], responses: Responses) -> Floats | None:
    """95 % bounds of Js, mL, Keff and bs by the fit of the true structure, without competitors; None if it fails."""
    base = TwoMass(radius_m=RADIUS_M)
    mode = {"further mode", "third mass"} & set(effects)
    extras = (*((LAG,) if "lag" in effects else ()), *((MODE,) if mode else ()))
    model = ExtendedModel(base, extras, float(responses.lines.frequency_hz[-1])) if extras else base
    free = (("delay",) if "delay" in effects else ()) + (("B", "BL") if "friction" in effects else ())
    fixed = {} if free[:1] == ("delay",) else {"delay": 0.0}
    found = Fitter(model, free=free, fixed=fixed).process(responses).only(FITTED)
    return np.asarray(found.bound()[0]) if found.ok[0] else None


@dataclass(frozen=True)
class Outcome:
    """One run: whether the fit calls its bounds 95 % bounds, what they cover, and their width over the informed fit's;
    NaN where there is nothing to compare."""

    complete: bool
    covered: Floats
    wider: Floats


def outcome(effects: tuple[str, ...], seed: int) -> Outcome | None:
    """Fit one machine; None if the fit is refused."""
    of = machine(effects, seed)
    responses = measured(of, seed)
    found = fit(responses, TwoMass(radius_m=RADIUS_M))
    if found.status != "ok":
        return None
    value, bound = (np.array([part(name) for name in FITTED]) for part in (found.__getitem__, found.bound))
    known = informed(effects, responses)
    wider = np.full(len(FITTED), np.nan) if known is None else bound / known
    return Outcome(
        found.complete, np.concatenate([np.abs(value - of.truth) <= bound, _margins_covered(of, found)]), wider
    )


def _margins_covered(of: Machine, found: Fit) -> Floats:
    truth = true_margins(of)
    read = margins_of(found, of.loop)
    if truth is None or not read.ok[0]:
        return np.full(len(MARGINS), np.nan)
    column = [read.index(name) for name in MARGINS]
    value, bound, right = read.value[0, column], read.bound()[0, column], np.array([truth[name] for name in MARGINS])
    with np.errstate(invalid="ignore"):
        return np.where(np.isinf(right) & np.isinf(value), 1.0, np.abs(value - right) <= bound)


@dataclass(frozen=True)
class Found:
    """Outcomes of one combination."""

    effects: tuple[str, ...]
    runs: int
    fitted: int
    complete: int
    covered: Floats
    wider: Floats

    def __str__(self) -> str:
        covered = " ".join(f"{100 * x:4.0f}" for x in self.covered)
        wider = " ".join(f"{x:5.2f}" for x in self.wider)
        name = " + ".join(self.effects) or "none"
        return f"{name:28}{self.fitted:4}/{self.runs:<4}{self.complete:4} | {covered} | {wider}"


def measure(effects: tuple[str, ...], runs: int, seed: int) -> Found:
    """All runs of one combination."""
    fits = [one for i in range(runs) if (one := outcome(effects, seed + i)) is not None]
    complete = [one for one in fits if one.complete]
    nothing = np.full((1, len(FITTED) + len(MARGINS)), np.nan)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a combination without any fit to compare with
        covered = np.nanmean(np.array([one.covered for one in complete]) if complete else nothing, axis=0)
        wider = np.nanmedian(np.array([one.wider for one in complete]) if complete else nothing[:, :4], axis=0)
    return Found(effects, runs, len(fits), len(complete), covered, wider)


def sets(which: str) -> Iterator[tuple[str, ...]]:
    """No effect, each alone, and each two."""
    for count in {"none": (0,), "one": (1,), "two": (2,), "all": (0, 1, 2)}[which]:
        yield from combinations(EFFECTS, count)


def verdicts(found: list[Found]) -> list[Verdict]:
    """Against the targets."""
    result = []
    for one in found:
        name = " + ".join(one.effects) or "none"
        claim = f"{name}: least coverage of Js, mL, Keff, bs"
        result.append(Verdict(claim, float(one.covered[: len(FITTED)].min()), COVERED, at_least=True))
        claim = f"{name}: least coverage of the margins"
        result.append(Verdict(claim, float(one.covered[len(FITTED) :].min()), COVERED, at_least=True))
        if one.effects in ((), ("delay",)):
            result.append(Verdict(f"{name}: median width over the informed fit's", float(one.wider.mean()), WIDER))
    return result


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m studies.fit_combinations", description=__doc__)
    parser.add_argument("--runs", type=int, default=RUNS, help="of each combination")
    parser.add_argument("--seed", type=int, default=SEED, help="of the first run")
    parser.add_argument("--sets", choices=("none", "one", "two", "all"), default="all", help="how many effects")
    options = parser.parse_args()
    print(f"{options.runs} runs each, from seed {options.seed}; fitted, called 95 % bounds;")
    print(f"covered in % of {', '.join((*FITTED, *MARGINS))}; median width of {', '.join(FITTED)}")
    found = []
    for effects in sets(options.sets):
        found.append(measure(effects, options.runs, options.seed))
        print(found[-1], flush=True)
    for verdict in verdicts(found):
        print(verdict)


if __name__ == "__main__":
    main()
