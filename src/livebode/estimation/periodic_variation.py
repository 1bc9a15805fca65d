"""Whether the response varies periodically, as of a load that turns: the spectrum of the windows' errors over time."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Complex, Floats, Integers
from livebode.core import Event, Lines, Stage, StatefulBase, added, has_moved, log_sum_exceeded, with_extremes
from livebode.estimation.lasting_change import FALSE_ALARM, window_errors
from livebode.estimation.products import scaled
from livebode.language import Message

_WINDOWS = 128  # of one spectrum; the next one has half of them
_HALF = _WINDOWS // 2
_REFERENCE = 8  # windows before the first spectrum
_LOWEST = 4  # bin: below, a drift is not told from a period
_BESIDE = 3  # bins to the next ones that a period does not reach through the Hann window
_PROMINENT = 3.0  # times the evidence beside a period, which a step or a drift does not reach
_LIMIT = 12.0  # of the evidence of one line: a period is in several
_TESTS = 100  # of a run of ten minutes and windows of 0.1 s
_NAMED_MAX = 8


class PeriodicVariation(StatefulBase):
    """Looks for a period in the errors of windows at equal distances, at all lines together.

    A response that varies as 1 + a·cos(2πft) has errors at f and at −f; a disturbance that is added to the signals,
    such as hum, has them at one. So the evidence of a line is the smaller power of both over the noise, the median of
    all frequencies. The sum over the lines, of which none counts more than twelve, is at most a Gamma variable for
    noise. `FALSE_ALARM` is divided by the numbers of tests and frequencies (Bonferroni). Frequencies above half
    of the windows' rate appear as far from a multiple of it.

    Parameters
    ----------
    lines
        Lines of the responses.
    distance
        Samples from one window to the next. After others the search begins again.
    events
        Where an event is added, once for a frequency.
    """

    _stage = Stage("periodic-variation", 1)
    _STATE = ("_count", "_next", "_reference", "_errors", "_named_hz", "_schedule")

    def __init__(self, lines: Lines, distance: int, events: list[Event]) -> None:
        self._lines, self._distance, self._events = lines, distance, events
        self._named_hz = np.full(_NAMED_MAX, np.nan)
        self._schedule = np.full(2, np.nan)
        self._errors = np.zeros((_WINDOWS, len(lines)), dtype=np.complex128)
        self._next = -1
        self._begin()

    def _begin(self) -> None:
        self._count = -_REFERENCE
        self._reference = np.zeros((2, len(self._lines)), dtype=np.complex128)

    def process(self, pair: Complex, time_s: Floats, schedule: Floats, sample: Integers) -> None:
        """Process the next windows: numerator and denominator, (2, windows, lines), with their moments."""
        apart = np.diff(sample, prepend=self._next - self._distance if self._next >= 0 else sample[0] - self._distance)
        begins = np.flatnonzero(apart != self._distance)
        for first, stop in zip([0, *begins.tolist()], [*begins.tolist(), len(sample)]):
            if first in begins:
                self._begin()
            self._process(pair[:, first:stop], time_s[first:stop], schedule[first:stop], sample[first:stop])
        self._next = int(sample[-1]) + self._distance

    def _process(self, pair: Complex, time_s: Floats, schedule: Floats, sample: Integers) -> None:
        done = 0
        while done < len(sample):
            needed = -self._count if self._count < 0 else _WINDOWS - self._count
            now = slice(done, min(len(sample), done + needed))
            done = now.stop
            self._schedule = with_extremes(self._schedule, schedule[now])
            if self._count < 0:
                self._reference = added(self._reference, pair[:, now])
            else:
                errors = window_errors(scaled(self._reference, 1 / _REFERENCE), pair[:, now])
                self._errors[self._count : self._count + len(errors)] = errors
            self._count += now.stop - now.start
            if self._count == _WINDOWS:
                if not has_moved(self._schedule):
                    self._test(int(sample[done - 1]), float(time_s[done - 1]))
                self._errors[:_HALF] = self._errors[_HALF:]
                self._count = _HALF

    def _test(self, sample: int, time_s: float) -> None:
        number = np.arange(_WINDOWS)
        taper = 0.5 - 0.5 * np.cos(2 * np.pi * (number + 0.5) / _WINDOWS)
        slope = (number - number.mean())[:, np.newaxis]
        errors = self._errors - self._errors.mean(axis=0)
        errors -= slope * (slope * errors).sum(axis=0) / np.sum(slope**2)
        both = np.fft.fft(errors * taper[:, np.newaxis], axis=0)
        bins = np.arange(_LOWEST, _HALF - _BESIDE)
        power = both.real**2 + both.imag**2
        with np.errstate(all="ignore"):
            power = power * np.log(2) / np.median(power, axis=0)
        least = np.where(np.isfinite(power), np.minimum(power, power[-number]), 0.0)
        evidence = np.minimum(least, _LIMIT).sum(axis=1)
        limit = np.log(FALSE_ALARM / _TESTS / len(bins))
        chance = log_sum_exceeded(len(self._lines), evidence[bins])
        beside = np.maximum(evidence[bins - _BESIDE], evidence[bins + _BESIDE])
        certain = (chance < limit) & (evidence[bins] > _PROMINENT * beside)
        peak = (evidence[bins] >= evidence[bins - 1]) & (evidence[bins] >= evidence[bins + 1])
        for k in bins[certain & peak]:
            self._report(sample, time_s, int(k), np.abs(both[k]) + np.abs(both[-k]), float(taper.sum()))

    def _report(self, sample: int, time_s: float, k: int, sizes: Floats, scale: float) -> None:
        rate_hz = self._lines.rate_hz / self._distance
        resolution_hz = rate_hz / _WINDOWS
        frequency_hz = k * resolution_hz
        known = np.isfinite(self._named_hz)
        if known.all() or np.any(np.abs(self._named_hz[known] - frequency_hz) < 2 * resolution_hz):
            return
        self._named_hz[np.count_nonzero(known)] = frequency_hz
        share = sizes / scale / np.sinc(frequency_hz * self._lines.window / self._lines.rate_hz)
        with np.errstate(all="ignore"):
            share = np.nan_to_num(share / np.abs(self._reference[0] / self._reference[1]), posinf=0.0)
        line = int(np.argmax(share))
        message = Message(
            "the response varies periodically with {variation_hz:.3g} ± {resolution_hz:.2g} Hz (or that beside a "
            "multiple of {rate_hz:.4g} Hz), most at {line_hz:g} Hz: by ± {percent:.2g} %, as with a load that turns, "
            "or cogging",
            variation_hz=frequency_hz,
            resolution_hz=resolution_hz,
            rate_hz=rate_hz,
            line_hz=float(self._lines.frequency_hz[line]),
            percent=100 * float(share[line]),
        )
        self._events.append(Event("periodic-variation", sample, time_s, message))
