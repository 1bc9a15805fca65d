"""The NumPy twin of the verdicts on lines: the readable definition of what `Judge.process` computes in C.

Period by period, with the same operations in the same order for each line, so C must agree with it to the bit (except
for the sign and payload of NaN). `Distortion` and `Mains` have the definitions of their parts.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.estimation.hum import GONE, GONE_PERIODS, PERIODS, PERIODS_FIRST, STEADY
from livebode.estimation.periods import Moments, weights_of
from livebode.estimation.products import divided, magnitude, power, scaled, times
from livebode.estimation.verdicts import HUM, KINDS, Judge
from livebode.kernel import (
    ADDED,
    FORGOTTEN,
    JUDGED,
    NEWS,
    NEWS_GONE,
    NEWS_INVALID,
    LineMoments,
    PeriodSpectra,
    PeriodState,
    PeriodVerdicts,
)
from tests.twins.lines import add_windows

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]
Flags = NDArray[np.bool_]

_PERIODS_MIN = 2
_OTHER = 0.1  # of the excitation's power: from where on a period does not repeat the ones before
_EXCITED = 1e-12
_DISTORTED = 0.5  # of |G|: from where on the value is not that of a linear machine
_STEPS = 0.5  # amplitude in steps of the sensor below which a line may not be seen at all


def process(judge: Judge, state: PeriodState, periods: PeriodSpectra) -> tuple[PeriodVerdicts, float, float]:
    """The verdicts after each of some periods, and `largest` and `step` of the state after them."""
    twin = _Twin(judge, state, periods)
    with np.errstate(all="ignore"):
        for period in range(len(periods.usable)):
            twin.process(period)
    found = twin.found
    np.any(found.against, axis=1, out=found.invalid)
    return found, twin.largest, twin.step


class _Twin:
    def __init__(self, judge: Judge, state: PeriodState, periods: PeriodSpectra) -> None:
        self._judge, self._state, self._in = judge, state, periods
        self._lines, self._beside = slice(0, judge.lines), slice(judge.lines, None)
        self.largest, self.step = state.largest, state.step
        self.found = PeriodVerdicts.empty(len(periods.usable), judge.lines)
        self.found.distortion[0], self.found.against[0] = periods.distortion, periods.against
        self.found.happened[:], self.found.news[:] = 0, 0

    def process(self, period: int) -> None:
        found = self.found
        found.distortion[period + 1], found.against[period + 1] = found.distortion[period], found.against[period]
        if self._in.moves[period]:
            self._forget(period)
            found.distortion[period + 1], found.against[period + 1] = np.nan, False
        elif self._in.usable[period]:
            three = self._spectra(period)
            level = power(three[2, self._lines]).max()
            self.largest = float(np.fmax(self.largest, level))
            if level <= _EXCITED * self.largest:
                self._pause(period)
            else:
                self._excite(period, three)

    def _spectra(self, period: int) -> Complex:
        """Output, denominator and reference at the bins, shape (3, bins)."""
        three: Complex = self._in.spectra[list(self._judge.signals), period][:, self._judge.bins]
        return three if self._judge.after is None else times(three, self._judge.after)

    def _output(self, period: int) -> Complex:
        return np.asarray(self._in.spectra[self._judge.signals[0], period, self._judge.mains.bins])

    def _forget(self, period: int) -> None:
        for part in (self._state.windows, self._state.means, self._state.scatter, self._state.output):
            part[:] = 0
        self.found.happened[period] |= FORGOTTEN

    def _pause(self, period: int) -> None:
        """A period without excitation, after which it may begin at another phase."""
        self._forget(period)
        gone = _take_silence(self._state, *self._judge.mains.alone(power(self._output(period))))
        told = self._state.told[HUM]
        self.found.against[period + 1, HUM] &= ~gone
        self.found.news[period, HUM][gone & told] = NEWS_GONE
        self.found.happened[period] |= NEWS * (gone & told).any()
        told[gone] = False

    def _excite(self, period: int, three: Complex) -> None:
        windows = self._state.windows
        _end_silence(self._state)
        if self._judge.instrument and windows[0] and self._is_another(three[2, self._lines]):
            self._forget(period)
        now = self._added(three)
        self._state.output[:] += scaled(self._output(period) - self._state.output, 1 / windows[0])
        self._search_step(period)
        self.found.happened[period] |= ADDED
        if windows[0] >= _PERIODS_MIN and (windows[0] - _PERIODS_MIN) % self._judge.judged_every == 0:
            self._judged(period, now)

    def _is_another(self, reference: Complex) -> bool:
        """Whether the excitation, at the lines, is not that of the mean."""
        mean = (self._state.means[4] + 1j * self._state.means[5])[0, self._lines]
        return bool(power(reference - mean).sum() > _OTHER * power(mean).sum())

    def _added(self, three: Complex) -> Moments:
        """The moments with this period, one row."""
        s, weights = self._state, weights_of(1.0)
        powers = np.zeros((4, 1, three.shape[1]))
        powers[:2, 0] = power(three[2]), power(three[0])
        moments = LineMoments(s.windows, s.means, s.scatter, np.zeros(0), np.zeros((3, 1)))
        yes = np.ones(1, dtype=np.bool_)
        found = add_windows(moments, 1.0, weights.table, 0, three[:, np.newaxis], powers, yes)
        return Moments(found.means, found.scatter, weights.after(found.windows))

    def _search_step(self, period: int) -> None:
        # Where the first period shows no step, few others do: the search takes as long as the rest of a period.
        count = int(self._state.windows[0])
        if count == 1 or (self.step == 0 and count & (count - 1) == 0):
            self.step = self._in.step_of(period)

    def _judged(self, period: int, moments: Moments) -> None:
        judge, pair = self._judge, moments.pair
        numerator = pair[0, :, self._lines]
        steps = self.step * judge.of_step
        of_steps = judge.window * steps**2 / 12
        distortion, against = self._distortion(period, moments, pair, of_steps)
        counts = 2 * magnitude(numerator[0]) / judge.window / steps
        # Noise larger than the steps carries any amplitude over them.
        quiet = moments.scatter[0, 0, self._lines] / moments.weights.unbiased < of_steps
        hum = (self._state.hum > 0) | judge.mains.seen(power(self._state.output)[np.newaxis])[0]
        found = self.found
        found.distortion[period + 1] = distortion
        found.against[period + 1] = against, hum, (counts < _STEPS) & quiet
        found.pair[period], found.steps[period] = pair[:, 0, self._lines], counts
        new = found.against[period + 1] & ~self._state.told
        self._state.told[new] = True
        found.news[period][new] = NEWS_INVALID
        found.happened[period] |= JUDGED | NEWS * new.any()

    def _distortion(self, period: int, moments: Moments, pair: Complex, of_steps: Floats) -> tuple[Floats, Flags]:
        """Distortion at the lines, and where it is too large."""
        judge, (numerator, denominator) = self._judge, pair[:, :, self._lines]
        if judge.distortion is None:
            return np.full(judge.lines, np.nan), np.zeros(judge.lines, dtype=np.bool_)
        repeats = judge.distortion.repeats(
            moments, pair, self._lines, self._beside, judge.instrument, of_steps[np.newaxis]
        )
        distortion = (np.sqrt(repeats.variance) / magnitude(denominator))[0]
        against = np.asarray(distortion > _DISTORTED * magnitude(divided(numerator, denominator))[0])
        # A mean that was restarted has little significance; the previous verdict applies.
        if against.any():
            chance = self._in.by_chance(int(repeats.known[0]), float(repeats.dof[0]))
            if not repeats.over_noise[0] > chance:
                against &= self.found.against[period, KINDS.index("distorted")]
        return distortion, against


def _take_silence(s: PeriodState, power: Floats, is_prominent: Flags) -> Flags:
    """A period without excitation: the power at each line, and whether it is that of a tone.

    Returns the lines whose hum is withdrawn, shape (lines,).
    """
    s.silent_power[:-1] = s.silent_power[1:]
    s.silent_power[-1] = np.where(is_prominent, power, np.nan)
    s.counts[0] += 1
    if s.counts[0] >= PERIODS:
        _find(s, PERIODS)
    s.low[:] = np.where((power < GONE * s.hum) & ~is_prominent, s.low + 1, 0.0)
    gone = s.low >= GONE_PERIODS
    s.hum[gone] = 0.0
    return np.asarray(gone)


def _end_silence(s: PeriodState) -> None:
    """A period with excitation."""
    silent, excited = s.counts
    if not excited and PERIODS_FIRST <= silent < PERIODS:
        _find(s, int(silent))
    s.counts[:] = 0, 1
    s.silent_power[:] = np.nan


def _find(s: PeriodState, periods: int) -> None:
    """Hum is what is a tone in all of the newest periods, and does not decay over them."""
    part, third = s.silent_power[-periods:], periods // 3
    first, last = sum(part[:third]) / third, sum(part[-third:]) / third
    steady = np.isfinite(part).all(axis=0) & (last >= STEADY * first)
    s.hum[:] = np.where(steady & (s.hum == 0), last, s.hum)
