"""Verdicts on lines from the mean over periods: distortion, by detection lines; mains hum; sensor steps."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from math import gcd

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Flags, Floats
from livebode.core import Lines, QuantityKind, f_quantile
from livebode.dataclass import dataclass
from livebode.estimation.detection import Groups, Interpolation
from livebode.estimation.hum import Neighbours, mains_of
from livebode.estimation.periods import Moments, judged_every
from livebode.estimation.products import divided, power, times
from livebode.estimation.spectra import after
from livebode.estimation.tracker_settings import Settings
from livebode.kernel import (
    REASONS,
    PeriodSpectra,
    PeriodState,
    PeriodVerdicts,
    RepeatingPlan,
    RepeatingSettings,
    Tones,
    judge_periods,
)
from livebode.language import Message

_INSIDE_MIN = 2  # smallest number of detection lines between the outermost lines for an estimate in the band
_OUTSIDE = 6  # more of them on each side
_COHERENT = 3.0
"""Effect of a nonlinearity on a line of typical amplitude, relative to its effect on a detection line.

A nonlinearity changes the gain at the lines (the describing function) and spreads the rest over the bins that it
reaches. Of a sign of Gaussian velocity the gain has 2/π of the power, and the rest is spread over a band twice as wide:
about 2 for a flat velocity (`python -m studies.repeating`). By Bussgang's theorem (1952) the change is proportional to
the line's own amplitude in the signal that is distorted, and the rest is not: a line that is stronger in the output
than the rms of the lines, as at a resonance, changes more in the same proportion. Friction acts on the velocity, so a
position or an acceleration is judged as a velocity.
"""
_TO_VELOCITY: dict[QuantityKind | None, int] = {"position": 1, "acceleration": -1}
"""Differences from an output to a velocity; outputs of other kinds are judged as they are."""
_STEPS_MARGIN = 3.0  # ratio to uniform rounding that the steps of a sensor may have at a few bins
_POWERLESS = 1e-4
_SMOOTH = 5  # detection lines over which the noise is averaged before it is compared with
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
        bins = np.asarray(lines.bins)
        self.bins = reached(lines)
        self.interpolation = Interpolation(bins, self.bins)
        self.groups = Groups(bins, self.bins)
        self.dof = float(self.groups.dof.min())

    def repeats(
        self, moments: Moments, pair: Complex, lines: slice, beside: slice, instrument: bool, steps: Floats
    ) -> Repeats:
        """What repeats without being a linear response.

        Parameters
        ----------
        moments, pair
            Moments at the lines and at `bins`, and their means of numerator and denominator, shape (2, rows, bins).
        lines, beside
            The places of the lines and of `bins` in these.
        instrument
            Whether the reference is the excitation, so that a bin at which it has power is excited.
        steps
            Possible variance of the sensor steps, shape (rows, lines). They do not change the gain, because the other
            lines act as dither, so the factor of three does not apply to them.
        """
        numerator, denominator = pair
        ratio = divided(numerator[:, lines], denominator[:, lines])
        model = self.interpolation.at(ratio)
        mean = power(numerator[:, beside] - times(model, denominator[:, beside]))
        scatter = replace(moments, scatter=moments.scatter[:, :, beside]).unexplained(model)
        noise = scatter / moments.weights.unbiased[:, np.newaxis] * moments.weights.of_mean[:, np.newaxis]
        if instrument:
            reference = moments.power[0]
            excited = reference[:, beside] > _POWERLESS * _mean(reference[:, lines])
            mean = np.where(excited, np.nan, mean)
        as_output = self.groups.at(mean - noise)
        as_input = self.groups.at((mean - noise) / power(model)) * power(ratio)
        repeating = np.maximum(np.fmax(as_output, as_input), 0.0) + 0.0  # which zero a maximum is, is not specified
        strength = power(numerator[:, lines])
        stronger = np.maximum(strength / _mean(strength), 1.0)
        coherent = (_COHERENT**2 * stronger - 1) * np.maximum(repeating - _STEPS_MARGIN * steps, 0.0)
        known = np.isfinite(mean) & np.isfinite(noise)
        over = _over_noise(mean, noise, known)
        variance = _share(over)[:, np.newaxis] * (repeating + coherent)
        return Repeats(variance, over, np.count_nonzero(known, axis=1), moments.weights.dof)


@dataclass(frozen=True, eq=False)
class Repeats:
    """Result of `Distortion`, one row for each mean over periods.

    Attributes
    ----------
    variance
        Shape (rows, lines).
    over_noise
        Power that repeats over that of the noise beside it, mean over the detection lines that are known, (rows,).
    known, dof
        Number of these, and degrees of freedom of the noise at one of them, (rows,).
    """

    variance: Floats
    over_noise: Floats
    known: NDArray[np.int64]
    dof: Floats


def _mean(rows: Floats) -> Floats:
    return np.asarray(np.ascontiguousarray(rows).mean(axis=1, keepdims=True))


def _over_noise(mean: Floats, noise: Floats, known: NDArray[np.bool_]) -> Floats:
    """Power that repeats over that of the noise beside it, mean over the detection lines that are known, (rows,)."""
    smooth = _summed(np.where(known, noise, 0.0)) / _summed(known.astype(np.float64))
    ratio = np.divide(mean, smooth, out=np.full(mean.shape, np.inf), where=smooth > 0)
    if known.all():
        return np.asarray(ratio.mean(axis=1))
    return np.array([row[detected].mean() if detected.any() else 0.0 for row, detected in zip(ratio, known)])


def _summed(rows: Floats) -> Floats:
    """Sum over five neighbouring detection lines, fewer at the ends."""
    padded = np.pad(rows, ((0, 0), (_SMOOTH // 2, _SMOOTH // 2)))
    shifted = (padded[:, offset : offset + rows.shape[1]] for offset in range(_SMOOTH))
    return np.asarray(sum(shifted, start=np.zeros_like(rows)))


def _share(over_noise: Floats) -> Floats:
    """Significance of the repeating part: the square of its share of the total power, 0 … 1.

    Squared, so that noise that repeats by chance widens a bound by at most a few percent.
    """
    return np.where(over_noise > 0, np.fmax(0.0, 1 - 1 / over_noise) ** 2, 0.0)


@lru_cache(maxsize=1024)
def by_chance(known: int, dof: float) -> float:
    """What noise alone exceeds over itself with a probability of 1e-4: a quantile of the F distribution.

    Of as many detection lines as the noise is averaged over; the mean over more of them exceeds it less often.
    """
    independent = 2 * min(known, _SMOOTH)
    return f_quantile(_CHANCE, independent, independent * dof)


Reason = tuple[Message, dict[str, float]]

KINDS = ("distorted", "hum", "steps")
DISTORTED, HUM = KINDS.index("distorted"), KINDS.index("hum")


@dataclass(frozen=True, eq=False)
class Verdict:
    """Verdicts on the lines after a period.

    Attributes
    ----------
    distortion
        Of numerator/denominator, shape (lines,); NaN where it is not known.
    against
        Whether a line is invalid for each of the `KINDS`, shape (kinds, lines).
    """

    distortion: Floats
    against: Flags

    @classmethod
    def nothing(cls, lines: int) -> Verdict:
        """Before the first one, and where the machine moves."""
        return cls(np.full(lines, np.nan), np.zeros((REASONS, lines), dtype=np.bool_))


def reason(
    verdicts: PeriodVerdicts,
    period: int,
    kind: int,
    line: int,
    f: float,
    output: QuantityKind | None,
    to_output: Floats,
) -> Reason:
    """Why the line with this number and frequency is invalid since a period: for a message, and its details."""
    if KINDS[kind] == "steps":
        counts = float(verdicts.steps[period, line])
        message = Message(
            "the output moves only {steps:.2g} steps of its sensor at {line_hz:g} Hz: increase the excitation",
            steps=counts,
            line_hz=f,
        )
        if output == "other":
            message = Message("{few}; if the output is a velocity, declare it in source.kinds", few=message)
        return message, {"steps": counts}
    judged, denominators = verdicts.pair[period]
    share = float(verdicts.distortion[period + 1, line] / np.abs(judged[line] / denominators[line]))
    outputs = np.abs(judged) * to_output
    level_db = float(20 * np.log10(share * outputs[line] / np.sqrt(np.mean(outputs**2))))
    message = Message(
        "distortion may be {percent:.0f}% of the response at {line_hz:g} Hz, {level_db:.1f} dB relative to the output "
        "at a line (friction, backlash or sensor steps; increase the excitation, or move the axis)",
        percent=100 * share,
        line_hz=f,
        level_db=level_db,
    )
    if output in (None, "other"):
        message = Message("{few}; if the output is a position, declare it in source.kinds", few=message)
    return message, {"share": share, "level_db": level_db}


class Judge:
    """Judges the lines by the moments of whole periods.

    Attributes
    ----------
    bins
        The lines, and the bins beside them at which distortion is seen.
    signals
        Output, denominator and reference among the signals.
    of_step
        What a step of the output's sensor is at the lines; the steps of a velocity are those of its position.
    to_output
        Amplitude of the output over that of the signal that is judged, which is the velocity where it is known.
    after
        Factors of the spectra of `signals` at `bins`, shape (3, bins); None where all are 1. A position or an
        acceleration becomes a velocity.
    judged_every
        Periods from one verdict to the next.
    """

    def __init__(
        self,
        lines: Lines,
        signals: tuple[int, int, int],
        instrument: bool,
        hann: bool,
        differenced: Flags,
        advanced: NDArray[np.int64],
        output: QuantityKind | None,
    ) -> None:
        self.mains = mains_of(lines)
        self.distortion = Distortion(lines) if reached(lines).size > 0 and not hann else None
        beside = self.distortion.bins if self.distortion else np.zeros(0, dtype=np.int64)
        self.bins = np.concatenate([np.asarray(lines.bins), beside])
        self.window, self.lines, self.signals, self.instrument = lines.window, len(lines), signals, instrument
        self.after = None
        differences = _TO_VELOCITY.get(output, 0)
        if differenced.any() or advanced.any() or differences:
            self.after = np.ascontiguousarray(after(self.bins, lines.window, differenced, advanced)[list(signals)])
            self.after[0] *= (1 - np.exp(-2j * np.pi * self.bins / lines.window)) ** differences
        difference = np.abs(1 - 1 / lines.z)
        self.to_output = difference**-differences
        self.of_step = difference if output in ("velocity", "position", None) else 1 / self.to_output
        self.judged_every = judged_every(lines)
        self._plan = self._plan_of(len(differenced))

    def _plan_of(self, signals: int) -> RepeatingPlan:
        mains, nowhere = self.mains, np.zeros(0, dtype=np.int64)
        beside = np.zeros((2, self.lines, 4), dtype=np.int64)
        bins: tuple[NDArray[np.int64], NDArray[np.int64], Floats] = nowhere, nowhere, np.zeros(0)
        groups = beside, np.zeros(beside.shape, dtype=np.bool_), np.zeros(self.lines)
        if self.distortion is not None:
            between, means = self.distortion.interpolation, self.distortion.groups
            bins = between.left, between.right, between.share
            groups = means.places, means.member, means.position
        return RepeatingPlan(
            RepeatingSettings(
                self.window,
                signals,
                self.signals,
                self.bins,
                self.after,
                self.instrument,
                self.of_step,
                self.judged_every,
                mains.bins,
                mains.lines,
                (_tones(mains.free[0]), _tones(mains.free[1])),
                _tones(mains.excited),
                *bins,
                *groups,
            )
        )

    def process(self, state: PeriodState, periods: PeriodSpectra) -> tuple[PeriodVerdicts, float, float]:
        """The verdicts after each of some periods, and `largest` and `step` of the state after them."""
        return judge_periods(self._plan, state, periods)


def _tones(beside: Neighbours) -> Tones:
    return Tones(beside.tones, beside.beside, beside.usable, beside.known, beside.enough, beside.times)


def judge_of(settings: Settings, kind: QuantityKind | None) -> Judge:
    """The Judge for these settings and an output of this kind; several trackers of the same lines have the same one."""
    instrument = settings.method.reference == "excitation"
    differenced, advanced = settings.differenced_roles, settings.advanced_ticks
    return _judge(settings.lines, settings.signals, instrument, settings.hann, differenced, advanced, kind)


@lru_cache(maxsize=64)
def _judge(
    lines: Lines,
    signals: tuple[int, int, int],
    instrument: bool,
    hann: bool,
    differenced: tuple[bool, ...],
    advanced: tuple[int, ...],
    output: QuantityKind | None,
) -> Judge:
    return Judge(lines, signals, instrument, hann, np.array(differenced), np.array(advanced), output)
