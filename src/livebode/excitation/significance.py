"""Detection of the excited bins of a period."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Flags, Floats
from livebode.dataclass import dataclass
from livebode.excitation.blocks import grouped

FALSE_ALARM = 1e-3  # probability that any bin of a recording is classified as a line by chance, all bins together
FLOOR_DB = 60.0  # below the strongest line: a converter's rounding and the harmonics of a good drive
# A step this high in the sorted amplitudes separates lines from distortion. Square waves, PRBS and chirps have no
# such step (the largest, from the first to the third harmonic of a square wave, is 9.5 dB).
GAP_DB = 12.0
# Distortion is the smaller part: above a tenth of the power, a frequency response would not describe the drive.
_DISTORTION_SHARE = 0.1
# No converter reaches 138 dB, the resolution of float32: a signal that repeats better is an undistorted reference.
_REFERENCE_NOISE = float(np.finfo(np.float32).eps) ** 2
# Mean square of the error of truncation toward zero, in squares of the step; rounding alone has a quarter of it.
_TRUNCATION = 1 / 3
_LEVELS_MIN = 4.0  # half steps in the root mean square of a signal that is rounded, not designed in levels
# Complex degrees of freedom that the noise of a bin is estimated from. With 20 the F-test requires at most three times
# the power that known noise would require (1e-3 in 1,000 bins), with 1 it would require 70,000 times.
_NOISE_DOF = 20


@dataclass(frozen=True, eq=False)
class BinClasses:
    """Classification of the bins; the shape of each is (bins,), bin 0 first.

    Attributes
    ----------
    amplitude
        Of the mean over the periods, unit of the signal.
    excited
        Bins of the excitation.
    distortion
        Bins with significant power that is not the excitation's: harmonics, mains.
    """

    amplitude: Floats
    excited: Flags
    distortion: Flags


def significant(periods: Complex, false_alarm: float = FALSE_ALARM) -> Flags:
    """Bins whose mean exceeds the scatter between periods, shape (bins,).

    F-test of G|mean|² against the scatter of G groups of neighbouring periods: F ~ F(2, 2d) without a line, so its
    probability is (1 + F/d)^−d. With few periods d = G − 1 is too small for a test, so the scatter is averaged over
    neighbouring bins until d reaches 20; where the bin's own scatter is larger (interference on one line), it is used.
    `false_alarm` is for all bins together (Bonferroni). Never bin 0.
    """
    groups = grouped(periods)
    count, bins = groups.shape
    if count < 2:
        return np.zeros(bins, dtype=np.bool_)
    mean = groups.mean(axis=0)
    own = np.sum(np.abs(groups - mean) ** 2, axis=0) / (count - 1)
    reach = -(-(-(-_NOISE_DOF // (count - 1)) - 1) // 2)
    noise, width = _averaged(own, reach)
    dof = (count - 1) * width
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(mean != 0, count * np.abs(mean) ** 2 / np.maximum(noise, own), 0.0)
    flags = dof * np.log1p(ratio / dof) > np.log(max(bins - 1, 1) / false_alarm)
    flags[0] = False
    return np.asarray(flags)


def _averaged(power: Floats, reach: int) -> tuple[Floats, NDArray[np.int64]]:
    # Mean over bins k − reach … k + reach without bin 0, which holds the drift, and how many bins that were.
    sums = np.concatenate(([0.0], np.cumsum(power)))
    k = np.arange(power.size)
    first, last = np.clip(k - reach, 1, None), np.clip(k + reach + 1, 2, power.size)
    last = np.maximum(last, first + 1)
    last = np.minimum(last, power.size)
    width = np.maximum(last - first, 1)
    return (sums[last] - sums[np.minimum(first, last)]) / width, width


def find_lines(periods: Complex, floor_db: float = FLOOR_DB, gap_db: float = GAP_DB, step: float = 0.0) -> BinClasses:
    """The bins of the excitation among those with significant power.

    Parameters
    ----------
    periods
        Spectra of the steady periods, shape (periods, bins).
    floor_db
        Bins this far below the strongest are rounding, and count as not excited.
    gap_db
        In a measured signal (not in a reference, which repeats without noise), the lines below a step of this height in
        the sorted amplitudes are distortion if they have less than a tenth of the power. ``inf`` switches it off.

    step
        The samples are multiples of this step, unit of the signal; 0 for none. The error of rounding or truncation
        repeats with the excitation. The lines are then the bins above the highest step in the sorted amplitudes, among
        those whose power together such an error can have.

    Notes
    -----
    A multisine with lines of very different design amplitudes, recorded as a measured current, can lose the
    weak group to `gap_db`: record the reference, or switch it off. A line of less than 0.8 steps can be lost to `step`.
    """
    mean = np.abs(periods.mean(axis=0))
    mean[0] = 0.0
    power = significant(periods)
    power &= mean >= mean.max() * 10 ** (-floor_db / 20)
    excited = power.copy()
    if excited.any() and _measured(periods, mean):
        excited &= mean >= _step(mean[excited], gap_db)
    # Noise of half a step spreads the rounding evenly; a signal of a few levels is designed so (PRBS).
    power_all = np.sum(mean**2) / 2
    if excited.any() and _scatter(periods) < (step / 2) ** 2 < power_all / _LEVELS_MIN**2:
        excited &= mean >= _above_rounding(mean[excited], step, mean.size)
    return BinClasses(mean, excited, power & ~excited)


def _measured(periods: Complex, mean: Floats) -> bool:
    return bool(2 * _scatter(periods) > _REFERENCE_NOISE * np.sum(mean**2))


def _scatter(periods: Complex) -> float:
    """Mean square of what differs from period to period, in the signal's unit squared."""
    away = periods[:, 1:] - periods[:, 1:].mean(axis=0)
    return float(np.median(np.sum(np.abs(away) ** 2, axis=1))) / 2


def _above_rounding(amplitudes: Floats, step: float, bins: int) -> float:
    # The amplitude just above the highest step down, where rounding can explain all below it; 0 without one. The search
    # ends where rounding, evenly distributed over the bins, would be.
    falling = np.sort(amplitudes)[::-1]
    below = np.cumsum(falling[::-1] ** 2)[::-1] / 2
    explained = below <= _TRUNCATION * step**2
    relevant = falling > step / np.sqrt(6 * bins)
    cuts = 1 + np.flatnonzero(explained[1:] & relevant[:-1])
    if not cuts.size:
        return 0.0
    return float(falling[cuts[np.argmax(falling[cuts - 1] / falling[cuts])] - 1])


def _step(amplitudes: Floats, gap_db: float) -> float:
    # The amplitude just above the first step down that is high enough; 0 without one.
    falling = np.sort(amplitudes)[::-1]
    high = falling[:-1] >= falling[1:] * 10 ** (gap_db / 20)
    below = np.cumsum(falling[::-1] ** 2)[::-1][1:]
    steps = np.flatnonzero(high & (below <= _DISTORTION_SHARE * np.sum(falling**2)))
    return float(falling[steps[0]]) if steps.size else 0.0
