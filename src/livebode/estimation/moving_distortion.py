"""Distortion of a machine in motion: what repeats at detection lines, beyond noise and the change of the machine."""

from __future__ import annotations

from itertools import pairwise
from math import gcd
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Flags, Floats
from livebode.core import Lines, Stage, StatefulBase, meets_mains
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
_REMEMBERED = 3  # periods before the newest one
_MEANS = 7
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


class PeriodsAtBins(NamedTuple):
    """Consecutive periods: spectra at `MovingDistortion.at`, (periods, bins), and means of the schedule, (periods,).

    `numerator` is the output, or what a model leaves of it; `output` is the output in both cases.
    """

    numerator: Complex
    output: Complex
    denominator: Complex
    reference: Complex
    position: Floats


class DistortionRows(NamedTuple):
    """Verdicts after each of some periods.

    Attributes
    ----------
    distortion, share
        Of numerator/denominator, and of |G|, shape (periods, lines); NaN before the first verdict.
    invalid
        Lines whose distortion is significant and more than half of |G|, shape (periods, lines).
    speed
        Change of the schedule from period to period, shape (periods,).
    """

    distortion: Floats
    share: Floats
    invalid: Flags
    speed: Floats

    @classmethod
    def joined(cls, parts: list[DistortionRows]) -> DistortionRows:
        return cls._make(map(np.concatenate, zip(*parts)))


class _Past(NamedTuple):
    """Periods, the newest last: residual (periods, bins), responses and input (periods, lines), schedule (periods,)."""

    residual: Complex
    ratio: Complex
    plant: Complex
    input: Complex
    position: Floats


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
    """

    _stage = Stage("moving-distortion", 1)
    _STATE = ("_mean", "_weights", "_most")

    def __init__(self, lines: Lines, *, instrument: bool) -> None:
        bins, free = np.asarray(lines.bins), free_bins(lines)
        self.at = np.concatenate([bins, free]) if free.size else free
        self._instrument, self._lines, self._free = instrument, slice(0, bins.size), slice(bins.size, None)
        self._interpolation = Interpolation(bins, free)
        self._beside, self._kernel = _skirts_of(bins, free, lines.window)
        self._near = np.array([_nearest(free, line) for line in bins]) if free.size else np.zeros((bins.size, 0), int)
        self._mean, self._weights, self._most = np.zeros((_MEANS, free.size)), np.zeros(2), 0.0
        empty = [np.zeros((0, many), dtype=np.complex128) for many in (free.size, *[bins.size] * 3)]
        self._nothing = _Past._make((*empty, np.zeros(0)))
        self._past, nothing = self._nothing, np.full((1, bins.size), np.nan)
        self._row = DistortionRows(nothing, nothing, np.zeros((1, bins.size), dtype=np.bool_), np.zeros(1))

    def _state(self) -> dict[str, Any]:
        past = {f"past_{name}": value for name, value in self._past._asdict().items()}
        return super()._state() | past | {f"row_{name}": value for name, value in self._row._asdict().items()}

    def _load(self, state: dict[str, Any]) -> None:
        super()._load(state)
        self._past = _Past._make(state[f"past_{name}"] for name in _Past._fields)
        self._row = DistortionRows._make(state[f"row_{name}"] for name in DistortionRows._fields)

    @property
    def now(self) -> DistortionRows:
        """The newest verdict, one row."""
        return self._row

    def end_stretch(self) -> None:
        """The next period does not follow the previous one."""
        self._past = self._nothing

    def process(self, periods: PeriodsAtBins, usable: Flags) -> DistortionRows:
        """Verdicts after each of some periods; those that are not usable, (periods,), interrupt the others."""
        with np.errstate(all="ignore"):
            level = np.ascontiguousarray(power(periods.reference)[:, self._lines]).mean(axis=1)
            known = np.where(usable & np.isfinite(level), level, 0.0)
            most = np.maximum.accumulate(np.append(self._most, known))[1:]
            self._most = float(most[-1]) if most.size else self._most
            excited, parts = usable & (level > _PAUSED * most), []
            edges = [0, *(np.flatnonzero(np.diff(excited)) + 1).tolist(), excited.size]
            for first, last in pairwise(edges):
                if last > first and excited[first]:
                    parts.append(self._stretch(PeriodsAtBins._make(x[first:last] for x in periods), level[first:last]))
                elif last > first:
                    self.end_stretch()
                    parts.append(DistortionRows._make(np.repeat(x, last - first, axis=0) for x in self._row))
        return DistortionRows.joined(parts)

    def _stretch(self, periods: PeriodsAtBins, level: Floats) -> DistortionRows:
        """Verdicts after each of consecutive periods that follow the remembered ones."""
        before = len(self._past.position)
        whole = _Past._make(map(np.concatenate, zip(self._past, self._read(periods, level))))
        self._past = _Past._make(x[-_REMEMBERED:] for x in whole)
        pairs = np.zeros(0, dtype=np.int64)
        if len(whole.position) > _REMEMBERED:
            travel, bend = whole.position[2:] - whole.position[:-2], np.diff(whole.position, 2)
            even = np.abs(bend) < _STEADY * np.abs(travel)  # of the middle ones
            pairs = _REMEMBERED + np.flatnonzero(even[1:] & even[:-1])  # the newest period of four
            pairs = pairs[pairs >= before]
        parts = [self._row]
        if pairs.size:
            parts.append(self._judge(whole, pairs))
            self._row = DistortionRows._make(x[-1:] for x in parts[1])
        newest = np.searchsorted(pairs, before + np.arange(len(periods.position)), side="right")
        return DistortionRows._make(x[newest] for x in DistortionRows.joined(parts))

    def _read(self, periods: PeriodsAtBins, level: Floats) -> _Past:
        denominator = periods.denominator[:, self._lines]
        ratio = divided(periods.numerator[:, self._lines], denominator)
        model = times(self._interpolation.at(ratio), periods.denominator[:, self._free])
        residual = periods.numerator[:, self._free] - model
        if self._instrument:
            excited = power(periods.reference[:, self._free]) > _EXCITED * level[:, np.newaxis]
            residual = np.where(excited, np.nan, residual)
        return _Past(
            residual, ratio, divided(periods.output[:, self._lines], denominator), denominator, periods.position
        )

    def _skirts(self, past: _Past) -> tuple[Complex, Complex]:
        """Skirts in all periods but the outer ones, of an output and of an input that change, (periods, bins)."""
        plant = past.plant[1:-1]
        change = times(scaled(past.ratio[2:] - past.ratio[:-2], 0.5), past.input[1:-1])
        output, input_ = (times(self._kernel, x[:, self._beside]).sum(axis=2) for x in (change, divided(change, plant)))
        return output, times(self._interpolation.at(plant), input_)

    def _judge(self, past: _Past, pairs: NDArray[np.int64]) -> DistortionRows:
        """Verdicts after the pairs of periods before these, of four each of which this is the newest."""
        older, newer, middle = past.residual[pairs - 2], past.residual[pairs - 1], pairs - 2
        skirts = [times(x[middle], x[middle - 1].conj()) for x in self._skirts(past)]
        now = _parts([times(newer, older.conj()), *skirts], (power(newer) + power(older)) / 2)
        mean, weights = self._means(now)
        explained = (np.sqrt(mean[:, 2] ** 2 + mean[:, 3] ** 2) + np.sqrt(mean[:, 4] ** 2 + mean[:, 5] ** 2)) / 2
        beyond = mean[:, 0] - np.abs(mean[:, 1]) - _SKIRTS * explained
        share = np.nan_to_num(beyond / mean[:, 6])
        chance = (_CHANCE * np.sqrt(weights[:, 1] / 2) / weights[:, 0])[:, np.newaxis]  # of one detection line
        beside = _above(_mean_beside(share), chance / np.sqrt(2 * _SMOOTH + 1))
        significant = np.maximum(_above(share, chance), beside)
        repeats = np.sqrt(mean[:, 0] ** 2 + mean[:, 1] ** 2)
        amplitude = significant * np.sqrt(np.fmax(repeats - _SKIRTS * explained, 0.0))
        return self._at_lines(past.plant[pairs - 1], past.input[pairs - 1], amplitude, significant)._replace(
            speed=(past.position[pairs] - past.position[pairs - 2]) / 2
        )

    def _means(self, now: Floats) -> tuple[Floats, Floats]:
        """Means after each pair, (pairs, parts, bins), and Σλ^i and Σλ^2i, (pairs, 2)."""
        found, weights = np.empty_like(now), np.empty((len(now), 2))
        for pair, values in enumerate(now):
            self._weights = weights[pair] = self._weights * (_FORGETTING, _FORGETTING**2) + 1
            step = np.where(np.isfinite(values), values - self._mean, 0.0)
            self._mean = found[pair] = self._mean + step / self._weights[0]
        return found, weights

    def _at_lines(self, plant: Complex, input_: Complex, amplitude: Floats, significant: Floats) -> DistortionRows:
        size, strength = magnitude(plant), power(times(plant, input_))
        model = magnitude(self._interpolation.at(plant))
        as_input = np.fmax(size[:, :, np.newaxis] / model[:, self._near], 1.0)
        stronger = np.sqrt(np.maximum(strength / strength.mean(axis=1, keepdims=True), 1.0))
        worst = (amplitude[:, self._near] * as_input).max(axis=2)
        distortion = _COHERENT * stronger * worst / magnitude(input_)
        share = distortion / size
        invalid = (share > _DISTORTED) & (significant[:, self._near].max(axis=2) >= 1)
        return DistortionRows(distortion, share, invalid, np.zeros(len(share)))


def _parts(products: list[Complex], of_both: Floats) -> Floats:
    """Real and imaginary parts of products, and a power: shape (pairs, parts, bins)."""
    return np.stack([*(part for x in products for part in (x.real, x.imag)), of_both], axis=1)


def _skirts_of(bins: NDArray[np.int64], free: NDArray[np.int64], window: int) -> tuple[NDArray[np.int64], Complex]:
    """The lines beside each detection line, and the spectrum of a ramp from −½ to ½ at its distance, (bins, lines)."""
    above = np.searchsorted(bins, free)[:, np.newaxis] + np.arange(-_LINES_BESIDE, _LINES_BESIDE)
    inside = (above >= 0) & (above < bins.size)
    beside = above.clip(0, bins.size - 1)
    angle = 2 * np.pi * (free[:, np.newaxis] - bins[beside]) / window
    # Σ n·z^n over a whole number of turns is N/(z − 1), and a constant leaks nowhere.
    return beside, np.where(inside, 1 / (window * (np.exp(-1j * angle) - 1)), 0)


def _nearest(free: NDArray[np.int64], line: int) -> NDArray[np.int64]:
    """Places of the detection lines beside a line; at the ends some come twice."""
    above = int(np.searchsorted(free, line))
    places = np.arange(max(above - _BESIDE, 0), min(above + _BESIDE, free.size))
    return np.resize(places, 2 * _BESIDE)


def _mean_beside(share: Floats) -> Floats:
    """Mean over five neighbouring detection lines, fewer at the ends, shape of `share`, (pairs, bins)."""
    many = share.shape[1]
    total = np.cumsum(np.concatenate([np.zeros((len(share), 1)), share], axis=1), axis=1)
    first = np.maximum(np.arange(many) - _SMOOTH, 0)
    last = np.minimum(np.arange(many) + _SMOOTH + 1, many)
    return np.asarray((total[:, last] - total[:, first]) / (last - first))


def _above(share: Floats, chance: Floats) -> Floats:
    """How much of what chance does not explain: 0 … 1."""
    return np.clip(2 * (share - chance) / np.maximum(1 - chance, 0.2), 0.0, 1.0)
