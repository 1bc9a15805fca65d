"""Chirps and noise: coverage of the bounds, and bias at a sharp resonance, of the estimators "lpm" and "welch".

`python -m studies.nonperiodic` (`make nonperiodic`) simulates a machine of one and of two masses, in open and in closed
loop, under a chirp and under noise. It prints how many errors are within the 63 % and the 98 % bound, and the error of
both estimators at a resonance with a damping ratio of 0.5 %, from the same samples without noise. At last it prints how
many responses of the estimator "direct" are valid under the same excitations, and under one that repeats.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.signal import chirp, lfilter, ss2tf

from livebode.core import Block, Lines, Response
from livebode.estimation import NonPeriodicTracker, Settings, Tracker
from livebode.excitation import multisine

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]
Kind = Literal["chirp", "noise"]

KINDS: tuple[Kind, ...] = ("chirp", "noise")
_LOOPS = {False: "open", True: "closed"}
RATE_HZ, WINDOW, BEFORE = 1000.0, 8192, 2000
BAND_HZ = (5.0, 200.0)
GAIN, INTEGRAL_TIME_S = 0.2, 0.1  # of the velocity controller
_INERTIA, _FRICTION = (0.004, 0.006), 0.02


@dataclass(frozen=True)
class Machine:
    """One or two masses: torque in, velocity of the first mass out, with zero-order hold."""

    masses: int
    damping_ratio: float = 0.02
    resonance_hz: float = 60.0

    def transfer(self) -> tuple[Floats, Floats]:
        """Numerator and denominator in falling powers of z, of one length."""
        j1, j2 = _INERTIA
        if self.masses == 1:
            a, b = np.array([[-_FRICTION / (j1 + j2)]]), np.array([1 / (j1 + j2)])
        else:
            reduced, w0 = j1 * j2 / (j1 + j2), 2 * np.pi * self.resonance_hz
            k, d = reduced * w0**2, 2 * self.damping_ratio * reduced * w0
            a = np.array([[-(_FRICTION + d) / j1, d / j1, -k / j1], [d / j2, -d / j2, k / j2], [1, -1, 0]])
            b = np.array([1 / j1, 0, 0])
        n = b.size
        held = np.zeros((n + 1, n + 1))
        held[:n, :n], held[:n, n] = a / RATE_HZ, b / RATE_HZ
        held = expm(held)
        numerator, denominator = ss2tf(held[:n, :n], held[:n, n:], np.eye(n)[:1], np.zeros((1, 1)))
        return numerator[0], denominator

    def response(self, frequency_hz: Floats) -> Complex:
        numerator, denominator = self.transfer()
        z = np.exp(2j * np.pi * np.asarray(frequency_hz) / RATE_HZ)
        return np.asarray(np.polyval(numerator, z) / np.polyval(denominator, z))

    def run(self, w: Floats, noise: Floats, *, closed: bool) -> Block:
        """w, u and y from rest, with this noise on y; in closed loop under a PI controller of the velocity."""
        numerator, denominator = self.transfer()
        if not closed:
            return Block(np.array([w, w, lfilter(numerator, denominator, w) + noise]), ("w", "u", "y"), RATE_HZ)
        above, below = GAIN * np.array([1 + 1 / (RATE_HZ * INTEGRAL_TIME_S), -1.0]), np.array([1.0, -1.0])
        free, fed = np.convolve(denominator, below), np.convolve(numerator, below)
        loop = free + np.convolve(numerator, above)
        u = lfilter(free, loop, w) - lfilter(np.convolve(denominator, above), loop, noise)
        return Block(np.array([w, u, lfilter(fed, loop, w) + lfilter(free, loop, noise)]), ("w", "u", "y"), RATE_HZ)


def excitation(kind: Kind, samples: int, rng: np.random.Generator) -> Floats:
    """One chirp over all samples, or white noise."""
    if kind == "noise":
        return rng.standard_normal(samples)
    t = np.arange(samples) / RATE_HZ
    return np.asarray(chirp(t, BAND_HZ[0], t[-1], BAND_HZ[1]))


def recorded(machine: Machine, kind: Kind, samples: int, seed: int, *, closed: bool, noise: float) -> Block:
    """A part of a run that began earlier, so that both of its ends are transients; coloured noise of this level."""
    rng = np.random.default_rng(seed)
    w = excitation(kind, samples + BEFORE, rng)
    v = lfilter([noise], [1, -0.7], rng.standard_normal(w.size))
    block = machine.run(w, v, closed=closed)
    return Block(block.data[:, BEFORE:], block.channels, RATE_HZ)


def estimated(block: Block, lines: Lines, estimator: str, *, closed: bool, windows: int = 1) -> Response:
    """The last response, of one window or of the average over several."""
    settings = Settings(
        lines=lines, output="y", input="u", excitation="w" if closed else None, estimator=estimator,
        average=windows > 1, forgetting=1.0,
    )  # fmt: skip
    return NonPeriodicTracker(settings).process(block)[-1]


@dataclass(frozen=True)
class Case:
    """A simulated experiment."""

    masses: int
    closed: bool
    kind: Kind
    windows: int

    @property
    def name(self) -> str:
        loop, windows = _LOOPS[self.closed], f"{self.windows} window{'s' * (self.windows > 1)}"
        return f"{self.masses} mass{'es' * (self.masses > 1)}, {loop} loop, {self.kind}, {windows}"


CASES = [Case(*of) for of in product((1, 2), (False, True), KINDS, (1, 8))]


def coverage(case: Case, estimator: str, runs: int, noise: float = 0.1) -> tuple[float, float, float]:
    """Shares of the errors within the 63 % and the 98 % bound, and of the lines that are valid."""
    machine, lines = Machine(case.masses), Lines(tuple(range(80, 1500, 17)), WINDOW, RATE_HZ)
    within, valid = np.zeros(2), 0
    for seed in range(runs):
        block = recorded(machine, case.kind, case.windows * WINDOW, seed, closed=case.closed, noise=noise)
        found = estimated(block, lines, estimator, closed=case.closed, windows=case.windows)
        error = np.abs(found.value - machine.response(lines.frequency_hz))[found.valid]
        within += [np.count_nonzero(error <= found.bound(c)[found.valid]) for c in (1, 2)]
        valid += np.count_nonzero(found.valid)
    return (*(within / valid), valid / (runs * len(lines)))


def bias(kind: Kind, *, closed: bool, samples: int = 8 * WINDOW) -> dict[str, float]:
    """Rms error relative to the peak, at lines within a bandwidth of a resonance with a damping ratio of 0.5 %.

    Without noise. Both estimators have all samples: "lpm" in one window, "welch" in eight.
    """
    machine = Machine(2, damping_ratio=0.005)
    block = recorded(machine, kind, samples, 1, closed=closed, noise=0.0)
    near = np.arange(59.4, 60.6, 2 * RATE_HZ / WINDOW)
    found = {}
    for estimator, windows in (("lpm", 1), ("welch", 8)):
        window = samples // windows
        bins = dict.fromkeys(round(f * (samples // 8) / RATE_HZ) * (window // (samples // 8)) for f in near)
        response = estimated(block, Lines(tuple(bins), window, RATE_HZ), estimator, closed=closed)
        truth = machine.response(response.lines.frequency_hz)
        error = np.where(response.valid, np.abs(response.value - truth), np.inf)
        found[estimator] = float(np.sqrt(np.mean(error**2)) / np.abs(truth).max())
    return found


def valid_direct(w: Floats, *, closed: bool, noise: float, seed: int = 0) -> float:
    """Share of the values of "direct" that are valid, after the first window of a settled run of two masses."""
    v = lfilter([noise], [1, -0.7], np.random.default_rng(seed).standard_normal(w.size))
    block = Machine(2).run(w, v, closed=closed)
    lines = Lines.parse("20:140:20", RATE_HZ, 500)
    settings = Settings(lines=lines, output="y", input="u", estimator="direct", hop=100)
    found = Tracker(settings).process(Block(block.data[:, BEFORE:], block.channels, RATE_HZ))
    return float(found.valid[5:].mean())


def main() -> None:
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 40
    for case in CASES:
        one, two, valid = coverage(case, "lpm", runs)
        print(f"{case.name}: {one:.1%} within 63 %, {two:.1%} within 98 %, {valid:.0%} of the lines valid")
    for samples, kind, closed in product((8 * WINDOW, 2 * WINDOW), KINDS, (False, True)):
        found = bias(kind, closed=closed, samples=samples)
        ratio = found["lpm"] / found["welch"]
        print(
            f"bias at 0.5 % damping, {samples / RATE_HZ:.0f} s, {_LOOPS[closed]} loop, {kind}: lpm {found['lpm']:.2%}, "
            f"welch {found['welch']:.2%} of the peak: ratio {ratio:.3f}"
        )
    period = multisine(Lines.parse("20:140:20", RATE_HZ, 500))
    periodic = np.resize(period / period.std(), 200_000)
    for closed, noise in product((False, True), (0.0, 0.1, 1.0)):
        share = valid_direct(periodic, closed=closed, noise=noise)
        print(f"direct, multisine, {_LOOPS[closed]} loop, noise {noise:g}: {1 - share:.3%} not valid")
    for kind, closed in product(KINDS, (False, True)):
        share = valid_direct(excitation(kind, 100_000, np.random.default_rng(1)), closed=closed, noise=0.1)
        print(f"direct, {kind}, {_LOOPS[closed]} loop: {share:.1%} valid")


if __name__ == "__main__":
    main()
