"""Distortion of a machine in motion: what repeats at detection lines, beyond noise and the change of the machine."""

from __future__ import annotations

from math import gcd
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Flags, Floats
from livebode.core import Lines, Stage, StatefulBase, meets_mains
from livebode.dataclass import dataclass
from livebode.estimation.detection import Interpolation
from livebode.estimation.products import divided, magnitude, power, scaled, times

_OUTSIDE = _BESIDE = 4  # detection lines outside of the lines, and of each side of a line
_ON_BIN = 0.1  # bins: hum this close to a bin repeats with the excitation
_LINES_BESIDE = 4  # of each side of a detection line, whose skirts are counted
_FORGETTING = 0.9  # of one pair of periods to the next: about ten pairs are remembered
_STEADY = 0.03  # of the travel of two periods: with a larger change from one to the other the motion itself leaks
_SKIRTS = 2.0  # times the mean of the two predictions: half of an amplitude is not predicted near a resonance
_CHANCE = 2.5  # standard deviations of what noise alone repeats
_SMOOTH = 2  # detection lines on each side that are judged together
_COHERENT = 2.2
"""Effect on a line of typical amplitude, relative to that on the worst of the detection lines beside it.

For 63 % of the lines of 100 simulated axes with reversing friction the ratio is up to 1.0, with play too 1.4, and for
96 % up to 2.2 and 4.3, within twice the bound. `python -m studies.motion_distortion` prints the coverage.
"""
_DISTORTED = 0.5  # of |G|: from where on the value is not that of a linear machine
_PAUSED = 0.25  # of the largest power of the reference
_EXCITED = 1e-4  # of the power at the lines: a bin with more is not a detection line


def free_bins(lines: Lines) -> NDArray[np.int64]:
    """Bins without excitation that even or odd products of the lines reach, ascending.

    Empty where none is between the lines. Multiples of the mains are left out.
    """
    bins, unit = np.asarray(lines.bins), gcd(*lines.bins)
    first, last = bins[0] - _OUTSIDE * unit, bins[-1] + _OUTSIDE * unit
    every = np.arange(max(unit, first), min(last, (lines.window - 1) // 2) + 1, unit)
    between = (every > bins[0]) & (every < bins[-1])
    free = ~np.isin(every, bins) & ~meets_mains(every, lines.resolution_hz, near_bins=_ON_BIN)
    free &= ~between | np.isin(every, lines.quiet)
    return every[free] if np.any(free & between) else np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class PeriodAtBins:
    """Spectra of one period at `MovingDistortion.at`, and the mean of the schedule in it.

    `numerator` is the output, or what a model leaves of it; `output` is the output in both cases.
    """

    numerator: Complex
    output: Complex
    denominator: Complex
    reference: Complex
    position: float


class MovingDistortion(StatefulBase):
    """Distortion of numerator/denominator at the lines while the schedule moves steadily.

    R = Y − Ĝ·U at the detection lines, even and odd ones, contains in each period noise, distortion, and the skirts
    that the change of the machine within the period leaves around the lines. The real part of R(p)·conj(R(p − 1)), less
    the imaginary one, contains no noise on average, and nothing that has another phase in each period, such as cogging.
    The skirts repeat, too. To first order they are Σ dG_k·U_k·c(q − k) at bin q with the change dG_k of the response
    from period to period, and c the spectrum of a ramp over the window (J. Lataire, E. Louarroudi, R. Pintelon,
    "Detecting a time-varying behavior in frequency response function measurements", IEEE Trans. Instrum. Meas. 61(8),
    2012). A resonance filters them as it filters the input, an antiresonance does not: the mean of the two predictions
    is used. What repeats beyond twice that is distortion.

    Its effect on a line is taken from the worst of four detection lines on each side, as it is and divided by |Ĝ|:
    friction and play are uniform in the torque. A line that is stronger in the output than the rms of the lines
    changes more, by Bussgang's theorem.

    Periods in which the speed changes by more than 3 %, or next to one, are not used: the verdict remains. Of periods
    shorter than 0.1 s the mean over some is used.

    Parameters
    ----------
    lines
        The lines.
    instrument
        Whether the reference is the excitation, so that a bin at which it has power is excited.

    Attributes
    ----------
    at
        The bins at which spectra are needed: the lines, then the detection lines; none where distortion is not seen.
    distortion
        Of numerator/denominator, shape (lines,); NaN before the first verdict.
    share
        Of |G|, shape (lines,).
    invalid
        Lines whose distortion is significant and more than half of |G|, shape (lines,).
    """

    _stage = Stage("moving-distortion", 1)
    _STATE = (
        "_residual", "_ratio", "_plant", "_input", "_skirts", "_position", "_count", "_even", "_most",
        "_repeats", "_power", "_explained", "_weights", "distortion", "share", "invalid",
    )  # fmt: skip

    def __init__(self, lines: Lines, *, instrument: bool) -> None:
        bins, free = np.asarray(lines.bins), free_bins(lines)
        self.at = np.concatenate([bins, free]) if free.size else free
        self._instrument, self._lines, self._free = instrument, slice(0, bins.size), slice(bins.size, None)
        self._interpolation = Interpolation(bins, free)
        self._beside, self._kernel = _skirts_of(bins, free, lines.window)
        self._near = np.array([_nearest(free, line) for line in bins]) if free.size else np.zeros((bins.size, 0), int)
        self._residual, self._skirts = np.zeros((3, free.size), complex), np.zeros((2, 2, free.size), complex)
        self._ratio, self._plant, self._input = (np.zeros((3, bins.size), complex) for _ in range(3))
        self._position, self._count, self._even, self._most = np.zeros(3), 0, False, 0.0
        self._repeats, self._explained = np.zeros(free.size, complex), np.zeros((2, free.size), complex)
        self._power, self._weights = np.zeros(free.size), np.zeros(2)
        self.distortion, self.share = np.full((2, bins.size), np.nan)
        self.invalid = np.zeros(bins.size, dtype=np.bool_)

    @property
    def speed(self) -> float:
        """Change of the schedule from period to period."""
        return float(self._position[2] - self._position[0]) / 2

    def end_stretch(self) -> None:
        """The next period does not follow the previous one."""
        self._count, self._even = 0, False

    def process(self, period: PeriodAtBins) -> bool:
        """Add a period, and return whether there is a new verdict."""
        with np.errstate(all="ignore"):
            return self._process(period)

    def _process(self, period: PeriodAtBins) -> bool:
        excitation = power(period.reference)
        level = float(excitation[self._lines].mean())
        self._most = max(self._most, level) if np.isfinite(level) else self._most
        if not level > _PAUSED * self._most:
            self.end_stretch()
            return False
        self._remember(period, excitation[self._free] > _EXCITED * level)
        if self._count < 3:
            return False
        skirts, was_even = self._skirts_of_middle(), self._even
        travel, bend = self._position[2] - self._position[0], np.diff(self._position, 2)[0]
        self._even = bool(abs(bend) < _STEADY * abs(travel))
        self._skirts = np.stack([self._skirts[1], skirts])
        if not (self._even and was_even):
            return False
        self._add_pair()
        self._judge()
        return True

    def _remember(self, period: PeriodAtBins, excited: Flags) -> None:
        """Shift the newest three periods."""
        denominator = period.denominator[self._lines]
        ratio = divided(period.numerator[self._lines], denominator)
        model = times(self._interpolation.at(ratio), period.denominator[self._free])
        residual = period.numerator[self._free] - model
        if self._instrument:
            residual = np.where(excited, np.nan, residual)
        plant = divided(period.output[self._lines], denominator)
        now = (self._residual, residual), (self._ratio, ratio), (self._plant, plant), (self._input, denominator)
        for past, newest in now:
            past[:-1], past[-1] = past[1:].copy(), newest
        self._position = np.append(self._position[1:], period.position)
        self._count = min(self._count + 1, 3)

    def _skirts_of_middle(self) -> Complex:
        """Skirts in the middle one of the three periods, of an output and of an input that change, (2, bins)."""
        change = times(scaled(self._ratio[2] - self._ratio[0], 0.5), self._input[1])
        inside = divided(change, self._plant[1])
        of_output, of_input = (times(self._kernel, x[self._beside]).sum(axis=1) for x in (change, inside))
        return np.stack([of_output, times(self._interpolation.at(self._plant[1]), of_input)])

    def _add_pair(self) -> None:
        """Add the older two of the three periods."""
        older, newer = self._residual[:2]
        self._weights = self._weights * (_FORGETTING, _FORGETTING**2) + 1
        share = 1 / self._weights[0]
        _average(self._repeats, times(newer, older.conj()), share)
        _average(self._explained, times(self._skirts[1], self._skirts[0].conj()), share)
        _average(self._power, (power(newer) + power(older)) / 2, share)

    def _judge(self) -> None:
        skirts = magnitude(self._explained).mean(axis=0)
        beyond = self._repeats.real - np.abs(self._repeats.imag) - _SKIRTS * skirts
        share = np.nan_to_num(beyond / self._power)
        chance = _CHANCE * np.sqrt(self._weights[1] / 2) / self._weights[0]  # of one detection line
        smooth = _mean_beside(share)
        significant = np.maximum(_above(share, chance), _above(smooth, chance / np.sqrt(2 * _SMOOTH + 1)))
        amplitude = significant * np.sqrt(np.fmax(magnitude(self._repeats) - _SKIRTS * skirts, 0.0))
        plant, strength = magnitude(self._plant[1]), power(times(self._plant[1], self._input[1]))
        model = magnitude(self._interpolation.at(self._plant[1]))
        as_input = np.fmax(plant[:, np.newaxis] / model[self._near], 1.0)
        stronger = np.sqrt(np.maximum(strength / strength.mean(), 1.0))
        worst = (amplitude[self._near] * as_input).max(axis=1)
        self.distortion = _COHERENT * stronger * worst / magnitude(self._input[1])
        self.share = self.distortion / plant
        self.invalid = (self.share > _DISTORTED) & (significant[self._near].max(axis=1) >= 1)


def _skirts_of(bins: NDArray[np.int64], free: NDArray[np.int64], window: int) -> tuple[NDArray[np.int64], Complex]:
    """The lines beside each detection line, and the spectrum of a ramp from −½ to ½ at its distance, (bins, lines)."""
    above = np.searchsorted(bins, free)[:, np.newaxis] + np.arange(-_LINES_BESIDE, _LINES_BESIDE)
    inside = (above >= 0) & (above < bins.size)
    beside = above.clip(0, bins.size - 1)
    angle = 2 * np.pi * (free[:, np.newaxis] - bins[beside]) / window
    # Σ n·z^n over a whole number of turns is N/(z − 1), and a constant leaks nowhere.
    return beside, np.where(inside, 1 / (window * (np.exp(-1j * angle) - 1)), 0)


def _average(mean: NDArray[Any], now: NDArray[Any], share: float) -> None:
    """Add values to a mean, in place, where they are finite."""
    for of_mean, value in ((mean.real, now.real), (mean.imag, now.imag)) if mean.dtype.kind == "c" else ((mean, now),):
        of_mean += np.where(np.isfinite(now), (value - of_mean) * share, 0.0)


def _nearest(free: NDArray[np.int64], line: int) -> NDArray[np.int64]:
    """Places of the detection lines beside a line; at the ends some come twice."""
    above = int(np.searchsorted(free, line))
    places = np.arange(max(above - _BESIDE, 0), min(above + _BESIDE, free.size))
    return np.resize(places, 2 * _BESIDE)


def _mean_beside(share: Floats) -> Floats:
    """Mean over five neighbouring detection lines, fewer at the ends."""
    total = np.cumsum(np.concatenate([[0.0], share]))
    first = np.maximum(np.arange(share.size) - _SMOOTH, 0)
    last = np.minimum(np.arange(share.size) + _SMOOTH + 1, share.size)
    return np.asarray((total[last] - total[first]) / (last - first))


def _above(share: Floats, chance: float) -> Floats:
    """How much of what chance does not explain: 0 … 1."""
    return np.clip(2 * (share - chance) / max(1 - chance, 0.2), 0.0, 1.0)
