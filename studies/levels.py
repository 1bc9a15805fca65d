"""Levels of noise, even and odd distortion: an odd random-phase multisine with detection lines.


The odd-odd multisine with random quiet lines and its robust method (many phase realisations, several periods each) are
those of Pintelon and Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., Wiley 2012, chapter 4.
Feedback carries every distortion into u, and so into y again; to first order Y − Ĝ·U takes that out, with Ĝ the joint
estimate at the excited lines (on feedback and quiet lines: Pintelon, Louarroudi and Lataire, Detecting and Quantifying
the Nonlinear and Time-Variant Effects in FRF Measurements Using Periodic Excitations).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import f as fisher

from livebode import Block, Lines, multisine
from studies.common import RATE_HZ, Complex, Floats, decibels, rms

PERIOD = 4000  # samples: lines 1 Hz apart
PERIODS = 8  # of each phase realisation
LOWEST_HZ, HIGHEST_HZ = 3, 160
GROUP = 4  # odd lines of which one, at random, is quiet
RMS_N_M = 1.87  # of the whole: that of seven lines of 1 N m
CHANCE = 1e-3  # of noise alone to be taken for more


def odd_multisine_lines(seed: int = 0) -> Lines:
    """Odd lines, less one of every GROUP at random; these and the even ones between are detection lines."""
    odd = np.arange(LOWEST_HZ, HIGHEST_HZ, 2)
    generator = np.random.default_rng(seed)
    # The outermost stay excited, so that Ĝ is never extrapolated.
    left_out = {int(generator.choice(group)) for group in np.array_split(odd[1:-1], len(odd) // GROUP)}
    bins = tuple(int(k) for k in odd if k not in left_out)
    return Lines(bins, PERIOD, RATE_HZ, tuple(k for k in range(bins[0], bins[-1]) if k not in bins))


def period_of(lines: Lines, seed: int | None) -> Floats:
    """One period of equal lines; None for Schroeder phases."""
    phases: Any = "schroeder" if seed is None else np.random.default_rng(seed).uniform(0, 2 * np.pi, len(lines))
    return multisine(lines, RMS_N_M * np.sqrt(2 / len(lines)), phases)


@dataclass(frozen=True)
class Levels:
    """Amplitudes at the bins 1 Hz apart, from several phase realisations of one case.

    `response` (realisations, excited) is Ĝ; of the rest Y − Ĝ·U `mean` (realisations, bins) is over the periods, and
    `noise` (realisations, bins) the variance of a single period; `y`, `u` (realisations, excited) are their means.
    """

    lines: Lines
    response: Complex
    mean: Complex
    noise: Floats
    y: Complex
    u: Complex
    crest: float

    @property
    def bins(self) -> Floats:
        return np.arange(self.lines.bins[0], self.lines.bins[-1] + 1)

    @property
    def even(self) -> Any:
        return self.bins % 2 == 0

    @property
    def odd(self) -> Any:
        """The detection lines."""
        return ~self.even & ~np.isin(self.bins, self.lines.bins)

    def within(self, band_hz: tuple[float, float]) -> dict[str, float]:
        """Noise of the mean over the periods, and both distortions, in dB of the response's output in the band."""
        inside = (self.bins >= band_hz[0]) & (self.bins < band_hz[1])
        f = self.lines.frequency_hz
        output = rms(np.abs(self.y[:, (f >= band_hz[0]) & (f < band_hz[1])]))
        return {
            "noise": float(decibels(np.sqrt(np.mean(self.noise[:, inside]) / PERIODS) / output)),
            "even": float(decibels(rms(np.abs(self.mean[:, inside & self.even])) / output)),
            "odd": float(decibels(rms(np.abs(self.mean[:, inside & self.odd])) / output)),
        }

    def above_noise(self, which: Any) -> tuple[float, float]:
        """Power of the mean rest at these bins over that of noise alone, and what chance does not exceed."""
        ratio = PERIODS * np.mean(np.abs(self.mean[:, which]) ** 2) / np.mean(self.noise[:, which])
        values = 2 * self.mean[:, which].size
        return float(ratio), float(fisher.isf(CHANCE, values, values * (PERIODS - 1)))

    def spread(self) -> float:
        """Rms of the output at the excited lines that changes with the phases."""
        off = (self.response - self.response.mean(axis=0)) * self.u
        return float(rms(np.abs(off)) * np.sqrt(len(off) / (len(off) - 1)))


def rest(block: Block, lines: Lines) -> tuple[Complex, Complex, Floats, Complex, Complex]:
    """Of one realisation: Ĝ, mean and variance of Y − Ĝ·U at all bins, and the means of Y and U at the excited ones."""
    y, u = (np.fft.rfft(block[name].reshape(-1, PERIOD), axis=1) * (2 / PERIOD) for name in ("velocity", "u"))
    at = np.asarray(lines.bins)
    every = np.arange(at[0], at[-1] + 1)
    response = y[:, at].mean(axis=0) / u[:, at].mean(axis=0)
    between = np.interp(every, at, response.real) + 1j * np.interp(every, at, response.imag)
    left = y[:, every] - between * u[:, every]
    return response, left.mean(axis=0), left.var(axis=0, ddof=1), y[:, at].mean(axis=0), u[:, at].mean(axis=0)
