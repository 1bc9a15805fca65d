"""Modes of generated structures, how many are found and how many are false: `python -m studies.generated_modes [first]
[runs]`.

A structure has 1 … 20 modes between its lines, damping ratios from 0.1 to 5 %, and may have a mode above the lines and
a rigid body. 40 … 800 lines have noise of 1e-4 … 5e-2 of the response, with a sigma that is known or that of the mean
of eight periods (7 complex degrees of freedom). A mode is permitted if no unbiased estimate has to have a scatter of
its damping ratio above 10 % (Cramér and Rao). It is found if a mode of the fit is nearer to its pole than half of its
half-width; a mode of the fit is false if it has no mode of the structure of its own that is nearer than that, four
deviations included, or than one spacing of lines: two modes between the same lines look like one. Seeds below 1000 are
those of development.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from livebode.core import Lines, Response
from livebode.fitting import CommonPoles, fit_common_poles
from studies.common_modes import machine, measured, sampled
from studies.result import Verdict

FIRST, RUNS = 1000, 200
PERMITTED = 0.1
NEAR = 0.5
DOF = 7.0
HIGHEST = 0.45  # of the rate; a mode above would be an alias between the lines
DEVIATIONS = 4.0

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Structure:
    """Frequency, damping ratio and weight of each mode, those between the lines first."""

    modes: Floats
    inside: int
    lines: Lines
    noise: float
    known: bool
    derivative: int
    seed: int

    @property
    def poles(self) -> Complex:
        """Those with a positive imaginary part, rad/s."""
        frequency, damping = self.modes[:, 0], self.modes[:, 1]
        return np.asarray(2 * np.pi * frequency * (1j * np.sqrt(1 - damping**2) - damping))

    @property
    def truth(self) -> Complex:
        """Displacement, velocity or acceleration at the lines, (lines,)."""
        displacement = machine(tuple((f, z) for f, z, _ in self.modes), self.modes[np.newaxis, :, 2])
        for _ in range(self.derivative):
            a, b, c, d = displacement.A, displacement.B, displacement.C, displacement.D
            assert not d.any()
            displacement = type(displacement)(a, b, c @ a, c @ b)
        return np.asarray(sampled(displacement, self.lines)[0])

    def response(self) -> Response:
        """With noise."""
        (noisy,) = measured(self.lines, self.truth[np.newaxis], self.noise, self.seed)
        if self.known:
            return noisy
        scatter = np.random.default_rng([self.seed, 1]).chisquare(2 * DOF, len(self.lines)) / (2 * DOF)
        return replace(noisy, sigma=noisy.sigma * np.sqrt(scatter), dof=DOF)

    def least_scatter(self) -> Floats:
        """Least standard deviation of the damping ratio of each mode, relative, by the bound of Cramér and Rao."""
        (noisy,) = measured(self.lines, self.truth[np.newaxis], self.noise, self.seed)
        s, p = 2j * np.pi * self.lines.frequency_hz[:, np.newaxis], self.poles
        residue = self.modes[:, 2] * np.abs(p) ** 2 / (2j * p.imag) * p**self.derivative
        upper, lower = 1 / (s - p), 1 / (s - p.conj())
        moved, turned = residue * upper**2, residue.conj() * lower**2
        slopes = np.concatenate(
            [moved + turned, 1j * (moved - turned), upper + lower, 1j * (upper - lower)], axis=1
        ) * (np.sqrt(2) / noisy.sigma[:, np.newaxis])
        both = np.concatenate([slopes.real, slopes.imag])
        scale = np.linalg.norm(both, axis=0)
        least = np.linalg.pinv(both / scale, rcond=1e-14)
        real, imaginary = (np.split(least / scale[:, np.newaxis], 4)[i] for i in range(2))
        # ζ = −Re p/|p|
        size = np.abs(p)[:, np.newaxis]
        by_real, by_imaginary = -(p.imag[:, np.newaxis] ** 2) / size**3, (p.real * p.imag)[:, np.newaxis] / size**3
        return np.asarray(np.linalg.norm(by_real * real + by_imaginary * imaginary, axis=1) / self.modes[:, 1])


def generated(seed: int) -> Structure:
    """The structure of a seed."""
    rng = np.random.default_rng(seed)
    inside, count = int(rng.integers(1, 21)), int(np.exp(rng.uniform(np.log(40), np.log(801))))
    first = int(np.exp(rng.uniform(0, np.log(count))))
    window = int((first + count) * rng.uniform(2.5, 10))
    lines = Lines.parse(f"{first}:{first + count - 1}:1", rate_hz=float(window), window=window)
    low, high = lines.frequency_hz[[0, -1]]
    frequency = rng.uniform(low, high, inside) if rng.random() < 0.5 else low * (high / low) ** rng.random(inside)
    if rng.random() < 0.5 and (above := high * rng.uniform(1.6, 3)) < HIGHEST * window:
        frequency = np.append(frequency, above)
    if rng.random() < 0.2:
        frequency = np.append(frequency, low / 50)
    damping = np.exp(rng.uniform(np.log(0.001), np.log(0.05), frequency.size))
    weight = np.exp(rng.normal(0, 0.7, frequency.size)) * rng.choice([-1, 1], frequency.size)
    weight = weight / (frequency / low) ** rng.choice([0, 2])
    noise = float(np.exp(rng.uniform(np.log(1e-4), np.log(5e-2))))
    known, derivative = bool(rng.random() < 0.5), int(rng.integers(0, 3))
    return Structure(np.stack([frequency, damping, weight], axis=1), inside, lines, noise, known, derivative, seed)


@dataclass(frozen=True)
class Found:
    """Permitted and found modes, modes of the fit and the false ones of them, and time."""

    permitted: int
    found: int
    modes: int
    false: int
    time_s: float
    status: str


def poles_of(fit: CommonPoles) -> tuple[Complex, Floats]:
    """Poles of its modes in rad/s, and their standard deviation."""
    if fit.status != "ok":
        return np.empty(0, dtype=np.complex128), np.empty(0)
    count = sum(name.startswith("frequency_") for name in fit.parameters.names)
    both = [(fit[f"frequency_{i + 1}"], fit[f"damping_{i + 1}"]) for i in range(count)]
    frequency, damping = np.array(both).reshape(-1, 2).T
    spread = [[fit.bound(f"{word}_{i + 1}", 0.68) for word in ("frequency", "damping")] for i in range(count)]
    of_frequency, of_damping = np.array(spread).reshape(-1, 2).T
    omega = 2 * np.pi * frequency
    poles = omega * (1j * np.sqrt(np.maximum(1 - damping**2, 0)) - damping)
    return poles, np.hypot(2 * np.pi * of_frequency, omega * of_damping)


def paired(apart: Floats, limit: Floats) -> NDArray[np.intp]:
    """Rows and columns of pairs whose distance is within its limit, (2, pairs), as many as possible."""
    rows, columns = optimize.linear_sum_assignment(np.where(apart <= limit, apart / limit, 1e3))
    near = apart[rows, columns] <= limit[rows, columns]
    return np.array([rows[near], columns[near]])


def judged(structure: Structure) -> Found:
    """One structure fitted."""
    permitted = structure.least_scatter()[: structure.inside] <= PERMITTED
    begin = time.process_time()
    fit = fit_common_poles([structure.response()])
    spent = time.process_time() - begin
    poles, spread = poles_of(fit)
    apart = np.abs(structure.poles[:, np.newaxis] - poles)
    half = NEAR * np.abs(structure.poles.real)[:, np.newaxis]
    rows, _ = paired(apart, np.broadcast_to(half, apart.shape))
    spacing = 2 * np.pi * float(np.diff(structure.lines.frequency_hz)[0])
    _, right = paired(apart, np.maximum(half + DEVIATIONS * spread, spacing))
    found = np.isin(np.flatnonzero(permitted), rows)
    return Found(int(permitted.sum()), int(found.sum()), poles.size, poles.size - right.size, spent, fit.status)


def main(first: int, runs: int) -> None:
    results = []
    for seed in range(first, first + runs):
        structure = generated(seed)
        one = judged(structure)
        results.append(one)
        if one.found < one.permitted or one.false:
            print(
                f"seed {seed}: {structure.inside} modes, {len(structure.lines)} lines, noise {structure.noise:.1e}: "
                f"found {one.found} of {one.permitted}, {one.false} of {one.modes} false, {one.status}, "
                f"{one.time_s:.1f} s",
                flush=True,
            )
    permitted, found, modes, false = (sum(getattr(one, name) for one in results) for name in
                                      ("permitted", "found", "modes", "false"))  # fmt: skip
    print(f"{runs} structures: {found} of {permitted} permitted modes found, {false} of {modes} false")
    print(Verdict("share of the permitted modes that are found", found / permitted, 0.95, at_least=True))
    print(Verdict("share of the modes of the fits that are false", false / max(modes, 1), 0.02))
    times = np.array([one.time_s for one in results])
    print(f"time of a fit: median {np.median(times):.2f} s, longest {times.max():.2f} s")


if __name__ == "__main__":
    given = [int(word) for word in sys.argv[1:]]
    main(*given, *(FIRST, RUNS)[len(given) :])
