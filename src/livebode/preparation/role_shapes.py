"""Shape of a response over frequency: its slope, its phase, whether it is a constant share of the excitation."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Complex, Floats

_CHANCE = 1e-3  # probability that noise alone, at any line, is taken for a signal
_LINES_MIN, _SLOPE_LINES = 4, 200  # fewer give no slope, more do not improve it
_NEPERS_FLAT = 0.2  # standard deviation of a gain over frequency that is the excitation itself
_DIRECT_DEG = 60.0  # a drive's delay in the upper half of the band
_LAG_DEG = (-150.0, -30.0)  # of a machine from torque to speed or position, with a delay


def limit(lines: int, windows: int) -> float:
    """Level that the coherence of noise over so many windows exceeds at any line with a probability of 1e-3."""
    return float(1 - (_CHANCE / lines) ** (1 / (windows - 1)))


def wide(f: Floats, factor: float) -> bool:
    """Whether there are enough lines, over a sufficient band, for a slope."""
    return bool(len(f) >= _LINES_MIN and f[-1] >= factor * f[0])


def slope(f: Floats, response: Complex | Floats) -> float:
    """d ln|response|/d ln f, the median over pairs of lines (Theil 1950, Sen 1968), which a notch affects little."""
    some = np.unique(np.linspace(0, len(f) - 1, min(len(f), _SLOPE_LINES)).astype(int))
    one, other = np.triu_indices(some.size, 1)
    at, level = np.log(f[some]), np.log(np.abs(response[some]))
    return float(np.median((level[other] - level[one]) / (at[other] - at[one])))


def mean_deg(response: Complex) -> float:
    """Mean phase, −180 … 180°."""
    return float(np.degrees(np.angle(np.mean(response / np.abs(response)))))


def direct(response: Complex) -> bool:
    """Whether a signal is a constant share of the excitation at all these lines."""
    return unevenness(response) < _NEPERS_FLAT and abs(mean_deg(response)) < _DIRECT_DEG


def unevenness(response: Complex) -> float:
    """Standard deviation of the gain over frequency, Np."""
    return float(np.std(np.log(np.abs(response))))


def lags(angle_deg: float) -> bool:
    """Whether this is the phase of a machine's output relative to its torque."""
    return _LAG_DEG[0] < angle_deg < _LAG_DEG[1]


def sized(response: Complex) -> str:
    """Phase and unevenness for people."""
    return f"{mean_deg(response):.0f}° at the upper lines, gain flat within {100 * unevenness(response):.0f} %"
