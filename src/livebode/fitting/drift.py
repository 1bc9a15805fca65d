"""Whether a machine changes during a record: by a trend, settling, a step or periodically, beyond the noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Flags, Floats
from livebode.core import Lines, Response, Responses, Stage, StatefulBase, added, has_moved, with_extremes
from livebode.dataclass import dataclass
from livebode.fitting.time_course import FALSE_ALARM, GROUPS_MIN, Component, Course, GroupSeries, components_of

_VALUES_MAX, _GROUPS = 1 << 16, (64, 512)  # when all groups are full, neighbours are added: memory does not grow
_MOMENTS = 128  # of the record at which the course is evaluated
_WITHIN = 1 - np.exp(-1), 1 - np.exp(-4)  # probability of noise within sigma, and within two


@dataclass(frozen=True, eq=False)
class Drift:
    """How the response changes over a record; shapes (lines,).

    Attributes
    ----------
    tested, significant
        Whether there were enough windows without motion, and whether the machine changes: all lines together, at
        `FALSE_ALARM`.
    lines
        Lines whose own change is significant.
    value
        Mean over the record.
    components
        What the change consists of, the clearest first.
    begin_s, length_s
        Begin and length of the record.
    begin, end
        Response at both ends of the record; the mean without a change, NaN where it is not known.
    change, sigma
        Largest change of the response between two moments of the record and its standard deviation, unit of the
        response; of a change that is not significant that of a straight line.
    mean_sigma, begin_sigma, end_sigma
        Standard deviations of the mean and of both ends by noise.
    noise_share
        Share of the noise in the variance of the windows about their mean.
    rms
        Standard deviation of the response over the record; 0 where no change is significant.
    away
        Response at moments of the record less its mean, (moments, lines); 0 where noise explains it.
    """

    tested: bool
    significant: bool
    lines: Flags
    value: Complex
    components: tuple[Component, ...]
    begin_s: float
    length_s: float
    begin: Complex
    end: Complex
    change: Complex
    sigma: Floats
    mean_sigma: Floats
    begin_sigma: Floats
    end_sigma: Floats
    noise_share: Floats
    rms: Floats
    away: Complex

    @classmethod
    def unknown(cls, value: Complex) -> Drift:
        """Nothing but the mean is known yet."""
        n = len(value)
        nothing, zeros = np.full(n, complex(np.nan, np.nan)), np.zeros(n)
        return cls(
            tested=False,
            significant=False,
            lines=np.zeros(n, dtype=np.bool_),
            value=value,
            components=(),
            begin_s=0.0,
            length_s=0.0,
            begin=nothing.copy(),
            end=nothing.copy(),
            change=nothing,
            sigma=np.full(n, np.nan),
            mean_sigma=np.full(n, np.nan),
            begin_sigma=np.full(n, np.nan),
            end_sigma=np.full(n, np.nan),
            noise_share=np.ones(n),
            rms=zeros,
            away=np.zeros((_MOMENTS, n), dtype=np.complex128),
        )

    def add(self, series: GroupSeries, remembered: float) -> None:
        """Fit the components, or a straight line, at the lines of a series; of averages, as long as they remember."""
        at = series.at
        course = Course.of(series, self.components or [Component("trend", 1)])
        first, last = _extent(series.share)
        share = first + (last - first) * np.concatenate([[0.0, 1.0], _spread(_MOMENTS)])
        functions, value = course.functions(share), course.value(share)
        low, high = _farthest(value, share)
        between = functions[high] - functions[low]
        every = np.arange(len(at))
        self.change[at] = value[high, every] - value[low, every]
        self.sigma[at] = np.sqrt(course.noise * course.variance(between))
        self.mean_sigma[at] = np.sqrt(course.noise / series.count.sum())
        if not self.components:
            self.begin[at] = self.end[at] = self.value[at]
            self.begin_sigma[at] = self.end_sigma[at] = self.mean_sigma[at]
            return
        self.begin[at], self.end[at] = value[0], value[1]
        self.begin_sigma[at], self.end_sigma[at] = np.sqrt(course.variance(functions[:2])[:, np.newaxis] * course.noise)
        share = last - remembered * (last - share[2:])
        functions, value = course.functions(share), course.value(share)
        # The error of the fit is not a change of the machine.
        power = np.mean(np.abs(value - value.mean(axis=0)) ** 2, axis=0)
        by_noise = course.noise * float(np.mean(course.variance(functions - functions.mean(axis=0))))
        real = np.maximum(power - by_noise, 0.0)
        with np.errstate(invalid="ignore", divide="ignore"):
            certain = np.where(real > 0, np.sqrt(1 - (by_noise / power) ** 2), 0.0)
        self.away[:, at] = (value - value.mean(axis=0)) * certain
        self.rms[at] = np.sqrt(real)
        self.noise_share[at] = np.minimum(course.noise / course.scatter, 1.0)

    def variation(self, noise: Floats) -> Floats:
        """What the change adds to the standard deviation `noise` of a mean, so that both cover together, (lines,).

        The least sigma that covers the response at a random moment of the record as often as noise: 63 % of the
        moments within sigma, and 98 % within two. It is at least `rms`, by up to a fifth where the change is even or
        periodic, and more where it is short. 0 unless `significant`; NaN if it was not tested.
        """
        if not self.tested:
            return np.full(len(self.value), np.nan)
        added = np.zeros(len(self.value))
        for i in np.flatnonzero(self.rms > 0):
            own = noise[i] if np.isfinite(noise[i]) else 0.0
            distance = np.sort(np.abs(self.away[:, i, np.newaxis] + own * _CIRCULAR).ravel())
            one, two = (distance[min(int(p * distance.size), distance.size - 1)] for p in _WITHIN)
            added[i] = np.sqrt(max(max(one, two / 2) ** 2 - own**2, self.rms[i] ** 2))
        return added


def _circular() -> Complex:
    """Values of a circular complex normal variable of variance 1, evenly over its probability, (values,)."""
    rings, angles = 16, 6
    radius = np.sqrt(-np.log1p(-(np.arange(rings) + 0.5) / rings))
    turn = np.arange(angles) / angles + _spread(rings)[:, np.newaxis]
    return np.asarray((radius[:, np.newaxis] * np.exp(2j * np.pi * turn)).ravel())


def _spread(count: int) -> Floats:
    """Evenly spread numbers between 0 and 1, at no multiple of a period."""
    return np.asarray((np.arange(count) + 0.5) * (np.sqrt(5) - 1) / 2 % 1)


_CIRCULAR = _circular()


def _extent(share: Floats) -> tuple[float, float]:
    """The part of the record that these moments represent."""
    half = (share[-1] - share[0]) / (len(share) - 1) / 2
    return max(float(share[0] - half), 0.0), min(float(share[-1] + half), 1.0)


def _farthest(value: Complex, share: Floats) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Numbers of the two moments between which each line changes most, the earlier first, (lines,); by two sweeps."""
    every = np.arange(value.shape[1])
    one = np.argmax(np.abs(value - value[0]), axis=0)
    other = np.argmax(np.abs(value - value[one, every]), axis=0)
    later = share[one] > share[other]
    return np.where(later, other, one), np.where(later, one, other)


class DriftTest(StatefulBase):
    """Tests responses, in order, for a change of the machine.

    Windows that do not overlap are averaged in groups of equal length, 64 to 512 of them. `components_of` chooses the
    functions of time that noise does not explain, and each line has its own factors of them.

    Responses that average over periods are turned back into the windows that they gained. Of averages Gᵢ with the mean
    times tᵢ of their windows, a window that has its centre at c and the share s of the average's weight gives
    t₂ = t₁ + s·(c − t₁) and G₂ = G₁ + s·(G − G₁), so that s and G follow; the power of the input is taken as constant.

    Parameters
    ----------
    lines
        Lines of the responses.

    Notes
    -----
    Where the schedule varies by more than a thousandth of its largest value, nothing is tested, because the response
    may depend on it. A periodic change is seen from two groups a period on. Slow noise, longer than a group, can be
    taken for a change.
    """

    _stage = Stage("drift-test", 2)
    _STATE = (
        "_windows",
        "_free",
        "_level",
        "_schedule",
        "_times_s",
        "_pairs",
        "_begin",
        "_average",
        "_value",
        "_weight",
        "_share",
    )

    def __init__(self, lines: Lines) -> None:
        self._window, self._rate_hz, n = lines.window, lines.rate_hz, len(lines)
        self._windows, self._free, self._level = 0, 0, 0
        self._schedule = np.full(2, np.nan)  # smallest and largest
        most = int(np.clip(_VALUES_MAX // max(n, 1), *_GROUPS))
        self._groups = 1 << most.bit_length() - 1
        self._times_s = np.zeros((1, self._groups, n))  # sums over the valid windows
        self._pairs = np.zeros((3, self._groups, n), dtype=np.complex128)  # number, sums of numerator and denominator

        self._begin = np.full(3, np.nan)  # first and newest sample, and time, of the first window
        self._average = np.full(2, np.nan)  # time and schedule of the newest average
        self._value = np.full(n, complex(np.nan, np.nan))  # of that
        self._weight = np.ones(n, dtype=np.complex128)  # of the first window
        self._share = 1.0  # of the newest window in that

    def add(self, part: Responses) -> None:
        """Process the next responses."""
        single = part.sample - part.first < self._window
        if self._share == 1:
            self._add_windows(part, np.flatnonzero(single))
        gained = ~single & (part.first == self._begin[0])
        if gained.any():
            self._add_gained(part[gained])

    def _add_windows(self, part: Responses, single: NDArray[np.intp]) -> None:
        """Add those of the responses `single`, each of one window, that do not overlap."""
        first, after = part.first[single], part.sample[single] + 1
        index, following = int(np.searchsorted(first, self._free)), np.searchsorted(first, after).tolist()
        places: list[int] = []
        while index < len(following):
            places.append(index)
            index = following[index]
        if places:
            self._free = int(after[places[-1]])
            chosen = single[places]
            valid, weight = part.valid[chosen], part.weight[chosen]
            if np.isnan(self._begin[0]) and (some := valid.any(axis=1)).any():
                self._begin_with(part[int(chosen[np.argmax(some)])])
            weight = np.where(np.isfinite(weight), weight, 1.0)
            value = np.where(valid, part.value[chosen], np.nan)
            self._add(part.time_s[chosen], part.schedule[chosen], value, weight)

    def _begin_with(self, window: Response) -> None:
        self._begin = np.array([window.first, window.sample, window.time_s])
        self._average = np.array([window.time_s, window.schedule])
        self._value = np.where(window.valid, window.value, np.nan)
        self._weight = np.where(np.isfinite(window.weight), window.weight, 1.0)

    def _add_gained(self, averages: Responses) -> None:
        """Add the windows that these averages gained, all at one place in the period."""
        moments, values = [], []
        for average in averages:
            centre_s = self._begin[2] + (average.sample - self._begin[1]) / self._rate_hz
            now = np.array([average.time_s, average.schedule])
            share = (now[0] - self._average[0]) / (centre_s - self._average[0])
            if share <= 0:  # a window that was excluded
                continue
            value = np.where(average.valid, average.value, np.nan)
            moments.append(self._average + (now - self._average) / share)
            values.append(self._value + (value - self._value) / share)
            self._average, self._value, self._share = now, value, float(share)
        if values:
            time_s, schedule = np.array(moments).T
            self._add(time_s, schedule, np.array(values), np.tile(self._weight, (len(values), 1)))

    def _add(self, time_s: Floats, schedule: Floats, value: Complex, weight: Complex | Floats) -> None:
        """Add windows; `value` is NaN where it is invalid, shape (windows, lines)."""
        self._schedule = with_extremes(self._schedule, schedule)
        used = np.isfinite(value)
        times_s = np.where(used, time_s[:, np.newaxis], 0.0)
        pairs = np.where(used, np.stack([np.ones_like(value), value * weight, weight + 0j]), 0)
        done = 0
        while done < len(value):
            if self._windows >> self._level == self._groups:
                self._merge()
            group = self._windows >> self._level
            stop = min(done + ((group + 1) << self._level) - self._windows, len(value))
            self._times_s[:, group] = added(self._times_s[:, group], times_s[np.newaxis, done:stop])
            self._pairs[:, group] = added(self._pairs[:, group], pairs[:, done:stop])
            self._windows += stop - done
            done = stop

    def _merge(self) -> None:
        for sums in (self._times_s, self._pairs):
            half = sums[:, ::2] + sums[:, 1::2]
            sums[:, : self._groups // 2] = half
            sums[:, self._groups // 2 :] = 0
        self._level += 1

    def result(self) -> Drift:
        """The test on all responses up to now."""
        n = self._pairs.shape[2]
        with np.errstate(invalid="ignore", divide="ignore"):
            value = self._pairs[1].sum(axis=0) / self._pairs[2].sum(axis=0)
        moved = has_moved(self._schedule)
        series, begin_s, length_s = self._series()
        long_enough = [each for each in series if len(each.share) >= GROUPS_MIN]
        if moved or not long_enough:
            return Drift.unknown(value)
        components, own = components_of(long_enough)
        remembered = min(1.0, 1 / self._share / max(self._windows, 1)) if self._share < 1 else 1.0
        found = Drift.unknown(value)
        own = np.concatenate([own, np.zeros(n - len(own))])
        lines = (own < np.log(FALSE_ALARM / 2 / n)) & bool(components)
        found = replace(found, tested=True, significant=bool(components), lines=lines, components=tuple(components))
        found = replace(found, begin_s=begin_s, length_s=length_s)
        for each in long_enough:
            found.add(each, remembered)
        return found

    def _series(self) -> tuple[list[GroupSeries], float, float]:
        """The lines by the groups in which they have windows; begin and length of the record."""
        used = self._pairs[0].real > 0
        if not used.any():
            return [], 0.0, 0.0
        patterns, of = np.unique(used, axis=1, return_inverse=True)
        with np.errstate(invalid="ignore", divide="ignore"):
            time_s, value = self._times_s[0] / self._pairs[0].real, self._pairs[1] / self._pairs[2]
        first_s, last_s, number = np.nanmin(time_s), np.nanmax(time_s), int(used.any(axis=1).sum())
        # The groups are centred on their windows; the record is one group longer.
        half_s = float(last_s - first_s) / max(number - 1, 1) / 2
        begin_s, length_s = float(first_s) - half_s, float(last_s - first_s) + 2 * half_s
        series = []
        for number, pattern in enumerate(patterns.T):
            at = np.flatnonzero(of.ravel() == number)
            rows = np.flatnonzero(pattern)
            if rows.size and length_s > 0:
                share = (time_s[rows, at[0]] - begin_s) / length_s
                series.append(GroupSeries(at, share, self._pairs[0][rows, at[0]].real, value[np.ix_(rows, at)]))
        return series, begin_s, length_s

    @property
    def _identity(self) -> str:
        return f"{self._window}"
