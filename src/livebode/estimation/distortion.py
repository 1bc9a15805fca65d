"""Distortion at the lines, estimated from the repeating part of the signals at detection lines."""

from __future__ import annotations

from math import gcd

import numpy as np
import scipy  # its parts are loaded when they are first used
from numpy.typing import NDArray

from livebode.core import Lines
from livebode.estimation.bounds import power
from livebode.estimation.detection import Groups, Interpolation
from livebode.estimation.moments import Moments

Floats = NDArray[np.float64]

_INSIDE_MIN = 2  # smallest number of detection lines between the outermost lines for an estimate in the band
_OUTSIDE = 6  # more of them on each side
_COHERENT = 3.0
"""Effect of a nonlinearity on a line of typical amplitude, relative to its effect on a detection line.

A nonlinearity changes the gain at the lines (the describing function) and spreads the rest over the bins that it
reaches. Of a sign of Gaussian velocity the gain has 2/π of the power, and the rest is spread over a band twice as wide:
about 2 for a flat velocity (`python -m studies.repeating`). By Bussgang's theorem (1952) the change is proportional to
the line's own amplitude in the signal that is distorted, and the rest is not: a line that is stronger in the output
than the rms of the lines, as at a resonance, changes more in the same proportion.
"""
_STEPS_MARGIN = 3.0  # ratio to uniform rounding that the steps of a sensor may have at a few bins
_POWERLESS = 1e-4
_SMOOTH = np.ones(5)  # detection lines over which the noise is averaged before it is compared with
_CHANCE = 1e-4  # of noise alone to be significant in one verdict


def reached(lines: Lines) -> NDArray[np.int64]:
    """Bins without excitation on which distortion of these lines falls as it does on the lines, ascending.

    Sums and differences of excited bins are multiples of their common divisor; of odd multiples an odd nonlinearity
    reaches the odd ones, and an even one the even ones, where no line is. Empty where too few are between the lines.
    """
    bins = np.asarray(lines.bins)
    unit = gcd(*lines.bins)
    odd = bool(np.all(bins // unit % 2 == 1))
    every = np.arange(unit, (lines.window + 1) // 2, 2 * unit if odd else unit)
    free = np.setdiff1d(every, bins)
    inside = free[(free > bins[0]) & (free < bins[-1])]
    inside = np.intersect1d(inside, np.asarray(lines.quiet, dtype=np.int64))
    if inside.size < _INSIDE_MIN:
        return np.zeros(0, dtype=np.int64)
    below, above = free[free < bins[0]][-_OUTSIDE:], free[free > bins[-1]][:_OUTSIDE]
    return np.concatenate([below, inside, above]).astype(np.int64)


class Distortion:
    """Variance that distortion adds to numerator − Ĝ·denominator at the lines.

    The residual of the mean over all periods, less the share of the noise, at the detection lines on which distortion
    falls. It is interpolated over frequency twice, as it is and divided by |Ĝ|, and the larger result is used: sensor
    steps are uniform in the output, friction is uniform in the torque. The effect on a line is taken as three times
    that amplitude, and more at a line that is stronger in the output than the others.

    Parameters
    ----------
    lines
        The lines, of which `reached` must not be empty.
    """

    def __init__(self, lines: Lines) -> None:
        at = np.asarray(lines.bins)
        self.bins = reached(lines)
        self._interpolation = Interpolation(at, self.bins)
        self._groups = Groups(at, self.bins)
        self.dof = float(self._groups.dof.min())

    def variance(
        self, moments: Moments, lines: slice, beside: slice, instrument: bool, steps: Floats
    ) -> tuple[Floats, bool]:
        """Shape (lines,), and whether what repeats is significant, from Moments of one row at the lines and at `bins`.

        `steps` (lines,) is the possible variance of the sensor steps. They do not change the gain, because the other
        lines act as dither, so the factor of three does not apply to them.
        """
        numerator, denominator = moments.pair[:, 0]
        ratio = numerator[lines] / denominator[lines]
        everywhere = np.concatenate([ratio, self._interpolation.at(ratio)])
        model = everywhere[len(ratio) :]
        mean = power(numerator[beside] - model * denominator[beside])
        scatter = moments.unexplained(_placed(everywhere, lines, beside))[0, beside]
        noise = scatter / moments.unbiased[0] * moments.of_mean[0]
        if instrument:
            reference = moments.power[0, 0]
            mean = np.where(reference[beside] > _POWERLESS * reference[lines].mean(), np.nan, mean)
        gain = power(model)
        as_output = self._groups.at((mean - noise)[np.newaxis])[0]
        as_input = self._groups.at(((mean - noise) / gain)[np.newaxis])[0] * power(ratio)
        found = np.maximum(np.fmax(as_output, as_input), 0.0)
        strength = power(numerator[lines])
        stronger = np.maximum(strength / strength.mean(), 1.0)
        coherent = (_COHERENT**2 * stronger - 1) * np.maximum(found - _STEPS_MARGIN * steps, 0.0)
        known = np.isfinite(mean) & np.isfinite(noise)
        over = _over_noise(mean, noise, known)
        return np.asarray(_share(over) * (found + coherent)), over > _by_chance(int(known.sum()), float(moments.dof[0]))


def _placed(everywhere: NDArray[np.complex128], lines: slice, beside: slice) -> NDArray[np.complex128]:
    placed = np.zeros((1, beside.stop), dtype=np.complex128)
    placed[0, lines], placed[0, beside] = everywhere[: lines.stop], everywhere[lines.stop :]
    return placed


def _over_noise(mean: Floats, noise: Floats, known: NDArray[np.bool_]) -> float:
    """Power that repeats over that of the noise beside it, mean over the detection lines that are known."""
    if not known.any():
        return 0.0
    smooth = np.convolve(np.where(known, noise, 0.0), _SMOOTH, "same") / np.convolve(known * 1.0, _SMOOTH, "same")
    return float(np.divide(mean, smooth, out=np.full(mean.shape, np.inf), where=smooth > 0)[known].mean())


def _share(over_noise: float) -> float:
    """Significance of the repeating part: the square of its share of the total power, 0 … 1.

    Squared, so that noise that repeats by chance widens a bound by at most a few percent.
    """
    return max(0.0, 1 - 1 / over_noise) ** 2 if over_noise > 0 else 0.0


def _by_chance(known: int, dof: float) -> float:
    """What noise alone exceeds over itself with a probability of 1e-4: a quantile of the F distribution.

    Of as many detection lines as the noise is averaged over; the mean over more of them exceeds it less often.
    """
    independent = 2 * min(known, _SMOOTH.size)
    return float(scipy.special.fdtri(independent, independent * dof, 1 - _CHANCE))
