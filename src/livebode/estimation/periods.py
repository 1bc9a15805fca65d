"""Whole periods of signals, cut from samples that come in any pieces, and moments of line spectra over periods."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property, lru_cache
from math import ceil, log
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Flags, Floats
from livebode.core import Lines, Stage, StatefulBase
from livebode.dataclass import dataclass
from livebode.kernel import CHANGES, MEANS, PLACE, SCATTER, LineMoments, WeightSums

_JUDGED_PER_S = 10  # times at most; for short periods a verdict in each period is not needed
_TOGETHER = 1 << 15  # samples of a signal in one batch: a few of such signals, and their spectra, stay in the cache


def judged_every(lines: Lines) -> int:
    """Periods from one verdict on errors that repeat to the next."""
    return max(1, round(lines.rate_hz / lines.window / _JUDGED_PER_S))


@dataclass(frozen=True, eq=False)
class Periods:
    """Consecutive whole periods.

    Attributes
    ----------
    signals
        Shape (signals, periods, N).
    schedule
        Shape (periods, N); None where there is none.
    complete
        Whether no sample is missing or left out, shape (periods,).
    stop
        Index behind the last sample of the first period.
    """

    signals: Floats
    schedule: Floats | None
    complete: Flags
    stop: int

    @classmethod
    def of(cls, signals: Floats, schedule: Floats | None, complete: Flags, stop: int) -> Periods:
        """Of samples that begin with a period: `signals` is (signals, samples), `schedule` (samples,)."""
        count = len(complete)
        return cls(
            signals.reshape(len(signals), count, -1),
            None if schedule is None else schedule.reshape(count, -1),
            complete,
            stop,
        )

    @cached_property
    def spectra(self) -> Complex:
        """DFT of each period, shape (signals, periods, bins); of an incomplete one, which is not used, any number."""
        with np.errstate(all="ignore"):
            return np.fft.rfft(self.signals)


class PeriodCutter(StatefulBase):
    """Cuts signals at the multiples of N, and remembers the period that has begun.

    Parameters
    ----------
    window
        N, samples.
    differenced
        Which signals are differenced, shape (signals,).
    """

    _STATE: ClassVar[tuple[str, ...]] = ("_samples", "_position", "_at", "_whole")

    def __init__(self, window: int, differenced: NDArray[np.bool_]) -> None:
        self._window, self._differenced = window, differenced[:, np.newaxis]
        self._lead = int(differenced.any())  # samples before a period that are needed
        self._samples = np.zeros((differenced.size, window + 1))  # with the one before the period
        self._position = np.full(window, np.nan)
        self._at, self._whole = 0, False

    def _begin_at(self, sample: int) -> None:
        """The next sample has this number and does not follow the previous one."""
        self._at = sample % self._window
        self._whole, self._position[:] = False, np.nan

    def _cut(self, data: Floats, schedule: Floats | None, left_out: NDArray[np.int64]) -> Iterator[Periods]:
        """The periods that end in these samples, some at a time.

        Parameters
        ----------
        data, schedule
            Shapes (signals, samples) and (samples,); no schedule: None.
        left_out
            Indices of the samples without which a period does not count.
        """
        window, offset, samples = self._window, self._at, data.shape[1]
        count = (offset + samples) // window
        complete = np.ones(count + 1, dtype=np.bool_)
        complete[0] = self._whole
        if left_out.size:
            complete[(offset + left_out) // window] = False
        together = max(1, _TOGETHER // window)
        for first in range(0, count, together):
            last = min(count, first + together)
            begin, end = first * window - offset, last * window - offset
            signals, position = self._signals(data, begin, end), self._positions(schedule, begin, end)
            yield Periods.of(self._differences(signals), position, complete[first:last], begin + window)
            if last == count:
                self._samples[:, 1:] = signals[:, -window:]
                self._samples[:, 0] = self._samples[:, -1]
                if position is not None:
                    self._position[:] = position[-window:]
        remainder, offset = (samples, offset) if not count else ((offset + samples) % window, 0)
        self._samples[:, offset + 1 : offset + 1 + remainder] = data[:, samples - remainder :]
        if schedule is not None:
            self._position[offset : offset + remainder] = schedule[samples - remainder :]
        self._at, self._whole = offset + remainder, bool(complete[count])

    def _signals(self, data: Floats, begin: int, end: int) -> Floats:
        """Samples from `begin` on, which may be before the data, with the one before them where it is needed."""
        first = begin - self._lead
        if first >= 0:
            return data[:, first:end]
        return np.concatenate([self._samples[:, 1 - self._lead : 1 - begin], data[:, :end]], axis=1)

    def _positions(self, schedule: Floats | None, begin: int, end: int) -> Floats | None:
        if schedule is None or begin >= 0:
            return schedule if schedule is None else schedule[begin:end]
        return np.concatenate([self._position[:-begin], schedule[:end]])

    def _differences(self, signals: Floats) -> Floats:
        """Signals without the sample before them, some of them differenced."""
        return np.where(self._differenced, np.diff(signals), signals[:, 1:]) if self._lead else signals


@dataclass(frozen=True, eq=False)
class Moments:
    """Weighted moments of line spectra, one row for each place in the period or each moment in time.

    Numerator and denominator are those of the estimate, each times conj(reference). The weights are λ^i over the
    windows i, the newest first.

    Attributes
    ----------
    means, scatter
        As those of `LineMoments`, shapes (10, rows, lines) and (4, rows, lines). Real and in one array, so that a
        period is added in one pass.
    weights
        Sums of the weights, each of shape (rows,).
    """

    means: Floats
    scatter: Floats
    weights: WeightSums

    @property
    def pair(self) -> Complex:
        """Means of numerator and denominator, shape (2, rows, lines)."""
        pair = np.empty((2, *self.means.shape[1:]), dtype=np.complex128)
        pair.real, pair.imag = self.means[0:4:2], self.means[1:4:2]
        return pair

    @property
    def repeatability(self) -> Floats:
        """|S_r|²/S_rr: the share of the reference's power that its mean has, shape (rows, lines)."""
        return np.asarray((self.means[4] ** 2 + self.means[5] ** 2) / self.means[6])

    @property
    def power(self) -> Floats:
        """Means of the powers, shape (4, rows, lines)."""
        return self.means[6:]

    def unexplained(self, ratio: Complex) -> Floats:
        """Σλ^i|δnum − ratio·δden|², shape (rows, lines)."""
        numerator, denominator, re, im = self.scatter
        shared = ratio.real * re + ratio.imag * im
        total = numerator - 2 * shared + (ratio.real**2 + ratio.imag**2) * denominator
        return np.asarray(np.maximum(total, 0.0))  # rounding can make it negative


class PeriodMoments(StatefulBase):
    """Running Moments: windows one period apart are one series, so that every hop has its own history.

    Means and centred second moments are updated by deviations (West 1979), since sums of squares would lose the
    scatter to rounding at a high signal-to-noise ratio.

    Parameters
    ----------
    places
        Windows in one period.
    lines
        Lines in one row.
    forgetting
        λ per period, 0 < λ ≤ 1; 1 remembers every period equally.

    Attributes
    ----------
    weights
        Sums of the forgetting weights.
    """

    _stage = Stage("period-moments", 2)
    _STATE = ("_count", "_means", "_scatter", "_change", "_moment")

    def __init__(self, places: int, lines: int, forgetting: float) -> None:
        self.weights = weights_of(forgetting)
        self._count = np.zeros(places, dtype=np.int64)
        self._means = np.zeros((MEANS, places, lines))
        self._scatter = np.zeros((SCATTER, places, lines))
        self._change = np.zeros((CHANGES, places, lines))
        self._moment = np.zeros((PLACE, places))

    @property
    def arrays(self) -> LineMoments:
        """The state, which the functions of the kernel change in place."""
        return LineMoments(self._count, self._means, self._scatter, self._change, self._moment)

    @property
    def now(self) -> Moments:
        """The moments at every place in the period."""
        return Moments(self._means, self._scatter, self.weights.after(self._count))

    def forget(self) -> None:
        """Return to the state before the first window."""
        for part in self.arrays:
            part[:] = 0


class Weights:
    """Sums of the forgetting weights over c windows, i < c, as `WeightSums` has them.

    Attributes
    ----------
    forgetting
        λ.
    table
        The sums over 0, 1, 2 … windows, as many as change them, shape (6, any).
    """

    def __init__(self, forgetting: float) -> None:
        self.forgetting = forgetting
        # Number of windows above which the weight of another one is below rounding.
        enough = 0 if forgetting == 1 else min(ceil(log(1e-17) / log(forgetting)), 1 << 20)
        powers = np.cumprod(np.full((3, enough), forgetting ** np.array([[1.0], [2.0], [3.0]])), axis=1)
        one, two, three = np.concatenate([np.zeros((3, 1)), np.ones((3, 1)), 1 + np.cumsum(powers, axis=1)], axis=1)
        age = np.arange(enough + 1.0)
        ages, squares, ages_two, squares_two = (
            np.concatenate([np.zeros(2), np.cumsum(age[1:] ** n * weights)]) for weights in powers[:2] for n in (1, 2)
        )
        mean_age = ages / np.maximum(one, 1.0)
        spread = squares - mean_age * ages
        spread_two = squares_two - 2 * mean_age * ages_two + mean_age * mean_age * two
        self.table = np.stack([one, two, three, ages, spread, spread_two])

    def after(self, count: NDArray[np.int64]) -> WeightSums:
        """The sums over so many windows, shape of `count`."""
        return WeightSums.after(count, self.forgetting, self.table)


weights_of = lru_cache(maxsize=4)(Weights)
