"""Whether a machine changes during a record: by a trend, settling, a step or periodically, beyond the noise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Flags, Floats
from livebode.core import Lines, Response, Responses, Stage, StatefulBase, has_moved, with_extremes
from livebode.dataclass import dataclass
from livebode.fitting.time_course import (
    FALSE_ALARM,
    GROUPS_MIN,
    Component,
    Course,
    GroupSeries,
    components_of,
    log_chances,
)
from livebode.fitting.window_groups import WindowGroups

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
    remembered
        Share of the record, at its end, that the mean with this change remembers.
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
    remembered: float
    noise_share: Floats
    rms: Floats
    away: Complex

    @classmethod
    def unknown(cls, value: Complex, remembered: float = 1.0) -> Drift:
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
            remembered=remembered,
            noise_share=np.ones(n),
            rms=zeros,
            away=np.zeros((_MOMENTS, n), dtype=np.complex128),
        )

    def add(self, series: GroupSeries) -> None:
        """Fit the components, or a straight line, at the lines of a series."""
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
        share = last - self.remembered * (last - share[2:])
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

    def noise(self, measured: Floats) -> Floats:
        """The noise of a mean whose `measured` standard deviation contains the change: that about its course, (lines,).

        It is unchanged without a significant change.
        """
        if not self.significant:
            return measured
        return np.asarray(np.fmin(measured, self.mean_sigma / np.sqrt(self.remembered)))

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

    _stage = Stage("drift-test", 3)
    _STATE = ("_groups", "_schedule", "_begin", "_average", "_value", "_weight", "_share")

    def __init__(self, lines: Lines) -> None:
        self._window, self._rate_hz, n = lines.window, lines.rate_hz, len(lines)
        self._groups = WindowGroups(n)
        self._schedule = np.full(2, np.nan)  # smallest and largest
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
        chosen = single[self._groups.apart(part.first[single], part.sample[single])]
        if not chosen.size:
            return
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
        self._schedule = with_extremes(self._schedule, schedule)
        self._groups.add(time_s, value, weight)

    def result(self) -> Drift:
        """The test on all responses up to now."""
        if has_moved(self._schedule):
            return Drift.unknown(self._groups.mean())
        windows = max(self._groups.windows, 1)
        return drift_of(self._groups, min(1.0, 1 / self._share / windows) if self._share < 1 else 1.0)

    @property
    def _identity(self) -> str:
        return f"{self._window}"


def drift_of(
    groups: WindowGroups, remembered: float, tested: Callable[[GroupSeries], GroupSeries] = lambda series: series
) -> Drift:
    """The test on these windows.

    Parameters
    ----------
    groups
        The windows.
    remembered
        Share of the record, at its end, that the mean remembers.
    tested
        The same values as linear combinations whose noise is independent.
    """
    value = groups.mean()
    series, begin_s, length_s = groups.series()
    series = [each for each in series if len(each.share) >= GROUPS_MIN]
    found = Drift.unknown(value, remembered)
    if not series:
        return found
    components = components_of([tested(each) for each in series])
    lines = np.zeros(len(value), dtype=np.bool_)
    for each in series if components else ():
        lines[each.at] = log_chances(each, components) < np.log(FALSE_ALARM / 2 / len(value))
    found = replace(found, tested=True, significant=bool(components), lines=lines, components=tuple(components))
    found = replace(found, begin_s=begin_s, length_s=length_s)
    for each in series:
        found.add(each)
    return found
