"""The mean of many responses, with its bounds from their scatter."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import Response, Responses, SignalError, with_distortion
from livebode.fitting.drift import Drift, DriftTest

_FIRST_VERDICT = 3  # windows that may be valid before the first verdict: three periods, of which two are complete


class LineVerdicts:
    """At each line the newest known distortion, and whether its invalid time outweighs its valid time."""

    def __init__(self, window: int, lines: int) -> None:
        self._window, self._stop = window, 0
        self.distortion = np.full(lines, np.nan)
        self._valid, self._against = np.zeros(lines), np.zeros(lines)  # in samples

    def add(self, used: NDArray[np.bool_], part: Responses) -> None:
        """Process the next responses, with their valid lines, (rows, lines)."""
        if not len(part):
            return
        against = np.isinf(part.distortion)
        step = np.diff(part.sample + 1, prepend=self._stop or int(part.sample[0]) + 1 - self._window)
        step, self._stop = np.minimum(step, self._window), int(part.sample[-1]) + 1
        self._valid += step @ used
        self._against += step @ against
        known = against | (used & ~np.isnan(part.distortion))
        newest = len(known) - 1 - np.argmax(known[::-1], axis=0)
        of_part = np.take_along_axis(part.distortion, newest[np.newaxis], 0)[0]
        self.distortion = np.where(known.any(axis=0), of_part, self.distortion)

    @property
    def against(self) -> NDArray[np.bool_]:
        """Lines that are invalid in a mean, (lines,)."""
        late = self._valid <= self._against + _FIRST_VERDICT * self._window
        return np.asarray(np.isinf(self.distortion) & late)


_DISTORTION_DOF = 4.0  # of detection lines for a distortion: four, if they are all on one side of a line


def mean_response(responses: Responses | Iterable[Responses]) -> Responses:
    """Mean of the valid responses at each line as a batch of one: the ratio of the averages.

    A response Gᵢ = Yᵢ/Uᵢ carries the noise of Uᵢ, and a mean of quotients is biased by it: with ρ = |U|²/σ_u² by
    e^(−ρ)·(G − G'), where G' = −1/F is the estimate from feedback alone. So each has the `weight` wᵢ = Uᵢ/Wᵢ,

        Ĝ = Σ Gᵢ·wᵢ / Σ wᵢ = Σ Yᵢ/Wᵢ / Σ Uᵢ/Wᵢ,

    which is eq. (2) of Nevaranta 2016 over all windows, with eᵢ = (Gᵢ − Ĝ)·wᵢ / mean(w) the error of one. Responses
    without a weight (other quantities than the plant) have equal weights, with that bias.

    Windows that overlap share noise. Of two windows of N samples that start d apart the errors of white noise correlate
    as ρ = max(0, 1 − d/N), so that n responses are equivalent to m = n² / Σᵢⱼ ρᵢⱼ windows without overlap, and

        sigma² = Σᵢ |eᵢ|² / n / (m − 1),

    without bias, also if the noise increases or decreases. The scatter of windows that overlap contains more
    information than that of m windows: sigma has (m − 1)·Σᵢⱼ ρᵢⱼ / Σᵢⱼ ρᵢⱼ² degrees of freedom, by the first
    two moments of a quadratic form (F. E. Satterthwaite, Biometrics Bull. 2, 1946); m − 1 without overlap. With fewer
    than two such windows sigma is the least known one of the responses.

    The sigmas of single responses scatter and lag, so that weights of 1/sigma² would prefer windows that have just
    become noisy. For the same reason the bound of the mean is not computed from them. Errors that repeat do not average
    out: the newest known `distortion` of each line is added to sigma² without reduction.

    An infinite `distortion` marks a line as invalid. Where the newest known one is infinite, the line is invalid in the
    mean, unless it was valid for longer than invalid for that reason, as in motion, where errors that repeat are not
    known. The three windows before the first verdict are ignored.

    A machine that changes is averaged. If its change is significant (`DriftTest`), sigma² = noise² + distortion² +
    variation²: `variation` is not reduced by averaging, so that sigma covers the response at a random moment of the
    record, and the noise is the scatter about the course of the response.

    Responses that average over periods already contain each other: of these the newest valid one is returned, with the
    drift in its sigma.

    Bias: of a periodic change with fewer than two groups of windows a period only the scatter is in sigma. With a Hann
    window the errors correlate less, and sigma is too high.

    Parameters
    ----------
    responses
        In order, as one or in parts such as `Run.batches()`; parts are read once, and at most one window of
        them is retained.

    Returns
    -------
    Responses
        `coherence`, `input_coherence`, `time_s` and `schedule` are means over the responses used, `first` and
        `sample` their extent, `dof` the least over the lines.

    Raises
    ------
    SignalError
        If no line is ever valid, or each was found invalid.
    """
    mean = RunningMean()
    for part in [responses] if isinstance(responses, Responses) else responses:
        mean.add(part)
    return mean.response()


class RunningMean:
    """`mean_response` of responses in parts, in order.

    Attributes
    ----------
    rows
        Number of responses used, those with a valid line.
    averages
        Whether they average over periods already, so that the newest one is returned.
    drift
        The test of the responses for a drift.
    """

    def __init__(self) -> None:
        self.rows, self.averages = 0, False
        self._newest: Responses | None = None
        self._verdict: LineVerdicts | None = None

    def _begin(self, like: Responses) -> None:
        n = len(like.lines)
        self._pair = _Pair(n)
        self._overlap = _Overlap(like.lines.window, n)
        self.drift = DriftTest(like.lines)
        self._least, self._dof = np.full(n, np.inf), 0.0
        self._coherence, self._input_coherence = _Mean(n), _Mean(n)
        self._moment, self._schedule, self._scheduled = 0.0, 0.0, 0
        self._first = np.iinfo(np.int64).max

    def add(self, part: Responses) -> None:
        """Process the next responses."""
        used = part.valid & np.isfinite(part.value)
        if self._verdict is None:
            self._verdict = LineVerdicts(part.lines.window, len(part.lines))
        self._verdict.add(used, part)
        rows = np.asarray(used.any(axis=1))
        if not rows.any():
            return
        used, part = used[rows], part[rows]
        if self._newest is None:
            self._begin(part)
        self._newest = part[-1:]
        self.averages |= bool(np.any(part.sample - part.first >= part.lines.window))
        weight = np.where(np.isfinite(part.weight), part.weight, 1.0)
        self._pair.add(used, part.value * weight, weight)
        self._overlap.add(part.sample + 1, used.astype(np.float64))
        self.drift.add(part)
        known = used & np.isfinite(part.sigma)
        self._least = np.minimum(self._least, np.where(known, part.sigma, np.inf).min(axis=0))
        self._dof = float(np.max(part.dof, initial=self._dof, where=known.any(axis=1)))
        self._coherence.add(used, part.coherence)
        self._input_coherence.add(used, part.input_coherence)
        self.rows += len(part)
        self._moment += part.time_s.sum()
        placed = np.isfinite(part.schedule)
        self._schedule += part.schedule[placed].sum()
        self._scheduled += int(placed.sum())
        self._first = min(self._first, int(part.first[0]))

    def response(self) -> Responses:
        """The present mean; SignalError where no line was ever valid, or each was found invalid."""
        average = self._average()
        return with_drift(average, self.drift.result()) if self.averages else average

    def _average(self) -> Responses:
        """The same, without the drift where the responses average already."""
        newest, verdict = self._newest, self._verdict
        if newest is None or verdict is None:
            raise SignalError("no-valid-response", "none of the responses is valid at any line", "track more periods")
        known = newest.valid[0] if self.averages else self._pair.count > 0
        valid = known & ~verdict.against
        if not valid.any():
            raise SignalError(
                "no-valid-response",
                "no line is valid: errors that repeat with the excitation (distortion, mains hum, sensor steps) "
                "are too large at each",
                "see the run's events for the reason at each line",
            )
        return _without(newest, ~valid) if self.averages else self._mean_of_all(newest, verdict.distortion, valid)

    def without_distortion(self) -> tuple[Response, Complex]:
        """The present mean with the sigma and the degrees of freedom of its noise alone, and its weight, (lines,).

        Sigma is NaN at a line with fewer than two windows.
        """
        response = self._average()[0]
        if self.averages:
            return replace(response, sigma=response.noise), response.weight
        scatter, windows, free = self._scatter(response.valid)
        several = windows >= 2
        dof = float(np.min(free, where=several, initial=np.inf))
        return replace(response, sigma=np.where(several, scatter, np.nan), dof=dof), self._pair.denominator

    def _scatter(self, valid: NDArray[np.bool_]) -> tuple[Floats, Floats, Floats]:
        """Standard deviation of the mean by the scatter of the responses, the number of windows without overlap, and
        the degrees of freedom."""
        pair, shared = self._pair, self._overlap
        count = np.where(valid, pair.count, np.nan)
        with np.errstate(invalid="ignore", divide="ignore"):
            windows = count**2 / shared.sums[0]
            scatter = np.sqrt(pair.unexplained() / count / (windows - 1)) / np.abs(pair.denominator)
            return scatter, windows, (windows - 1) * shared.sums[0] / shared.sums[1]

    def _mean_of_all(self, newest: Responses, distortion: Floats, valid: NDArray[np.bool_]) -> Responses:
        scatter, windows, free = self._scatter(valid)
        with np.errstate(invalid="ignore", divide="ignore"):
            value = self._pair.numerator / self._pair.denominator
        several = windows >= 2
        single = np.where(np.isfinite(self._least), self._least, np.nan)
        added = np.where(np.isfinite(distortion) & valid, distortion, 0.0)
        drift = self.drift.result()
        scatter = scatter * np.sqrt(drift.noise_share)
        variation = drift.variation(np.hypot(scatter, added))
        together = np.sqrt(scatter**2 + added**2 + np.nan_to_num(variation) ** 2)
        dof = free[several].min() if several.any() else self._dof or np.nan
        if several.any() and added.any():
            with np.errstate(invalid="ignore", divide="ignore"):
                of_line = together**4 / (scatter**4 / dof + added**4 / _DISTORTION_DOF)
            dof = min(dof, float(np.min(of_line, where=several & np.isfinite(of_line), initial=np.inf)))
        return Responses(
            lines=newest.lines,
            value=np.where(valid, value, complex(np.nan, np.nan))[np.newaxis],
            sigma=np.where(several, together, single)[np.newaxis],
            dof=np.array([dof]),
            coherence=self._coherence.value[np.newaxis],
            valid=valid[np.newaxis],
            first=np.array([self._first]),
            sample=newest.sample,
            time_s=np.array([self._moment / self.rows]),
            schedule=np.array([self._schedule / self._scheduled if self._scheduled else np.nan]),
            quantity=newest.quantity,
            unit=newest.unit,
            estimator=newest.estimator,
            input_coherence=self._input_coherence.value[np.newaxis],
            distortion=np.where(valid & np.isfinite(distortion), distortion, np.nan)[np.newaxis],
            variation=np.where(valid & several, variation, np.nan)[np.newaxis],
        )


def with_drift(average: Responses, drift: Drift) -> Responses:
    """An average over periods whose sigma contains the change of the machine meanwhile, as the test found it.

    The scatter of its periods contains the change. A variation that the average has already is replaced, if there was
    a test: this has seen the whole record.
    """
    if not drift.tested:
        return average
    apart = np.nan_to_num(average.variation) > 0
    noise = np.where(apart | ~average.valid, average.noise, drift.noise(average.noise[0]))
    repeated = with_distortion(noise, average.distortion)
    variation = np.where(average.valid, drift.variation(repeated[0]), np.nan)
    return replace(average, sigma=np.where(average.valid, np.hypot(repeated, variation), np.nan), variation=variation)


def _without(response: Responses, lines: NDArray[np.bool_]) -> Responses:
    """The responses with these lines invalid."""
    nothing = complex(np.nan, np.nan)
    return replace(
        response,
        value=np.where(lines, nothing, response.value),
        sigma=np.where(lines, np.nan, response.sigma),
        weight=np.where(lines, nothing, response.weight),
        valid=response.valid & ~lines,
    )


class _Mean:
    """Mean of the known values at each line."""

    def __init__(self, lines: int) -> None:
        self._count, self._sum = np.zeros(lines), np.zeros(lines)

    def add(self, used: NDArray[np.bool_], values: Floats) -> None:
        known = used & np.isfinite(values)
        self._count += known.sum(axis=0)
        self._sum += np.where(known, values, 0.0).sum(axis=0)

    @property
    def value(self) -> Floats:
        with np.errstate(invalid="ignore"):
            return np.asarray(self._sum / self._count)


class _Pair:
    """Means of numerator and denominator at each line, and their scatter (as `PeriodMoments`)."""

    def __init__(self, lines: int) -> None:
        self.count = np.zeros(lines)
        self.numerator, self.denominator, self._product = np.zeros((3, lines), dtype=np.complex128)
        self._scatter = np.zeros((2, lines))

    def add(self, used: NDArray[np.bool_], numerator: Complex, denominator: Complex) -> None:
        count = used.sum(axis=0)
        several = np.maximum(count, 1)
        mean = [np.where(used, x, 0).sum(axis=0) / several for x in (numerator, denominator)]
        apart = [np.where(used, x - m, 0) for x, m in zip((numerator, denominator), mean)]
        step = [m - before for m, before in zip(mean, (self.numerator, self.denominator))]
        share = count / np.maximum(self.count + count, 1)
        moved = self.count * share
        for i in (0, 1):
            self._scatter[i] += (np.abs(apart[i]) ** 2).sum(axis=0) + np.abs(step[i]) ** 2 * moved
        self._product += (apart[0] * apart[1].conj()).sum(axis=0) + step[0] * step[1].conj() * moved
        self.numerator, self.denominator = self.numerator + step[0] * share, self.denominator + step[1] * share
        self.count += count

    def unexplained(self) -> Floats:
        """Σ|δnum − Ĝ·δden|²."""
        ratio = self.numerator / self.denominator
        shared = 2 * (ratio.conj() * self._product).real
        return np.asarray(np.maximum(self._scatter[0] - shared + np.abs(ratio) ** 2 * self._scatter[1], 0.0))


_TOGETHER = 1 << 12  # windows, so that the sums of the squares of their places are exact to rounding


class _Overlap:
    """Sums over all pairs of windows, which are added in order, of what their noise has in common.

    Attributes
    ----------
    sums
        Σᵢⱼ ρᵢⱼ and Σᵢⱼ ρᵢⱼ² with ρᵢⱼ = max(0, 1 − dᵢⱼ/N), (2, lines).
    """

    def __init__(self, window: int, lines: int) -> None:
        self._window = window
        self._stop = np.empty(0, dtype=np.int64)  # of the windows that later ones may overlap
        self._used = np.empty((0, lines))
        self.sums = np.zeros((2, lines))

    def add(self, stop: NDArray[np.int64], used: Floats) -> None:
        for begin in range(0, len(stop), _TOGETHER):
            self._add(stop[begin : begin + _TOGETHER], used[begin : begin + _TOGETHER])

    def _add(self, stop: NDArray[np.int64], used: Floats) -> None:
        before = len(self._stop)
        self._stop, self._used = np.concatenate([self._stop, stop]), np.concatenate([self._used, used])
        place = (self._stop - self._stop[0])[:, np.newaxis].astype(np.float64)
        upto = np.cumsum(self._used * np.stack([np.ones_like(place), place, place**2]), axis=1)
        upto = np.concatenate([np.zeros_like(upto[:, :1]), upto], axis=1)
        # Of each new window, over the earlier ones that overlap it, with a + place their samples in common.
        first = np.searchsorted(self._stop, stop - self._window, side="right")
        count, places, squares = upto[:, before : before + len(stop)] - upto[:, first]
        a = self._window - place[before:]
        shared = (a * count + places) / self._window, (a**2 * count + 2 * a * places + squares) / self._window**2
        self.sums += [(used * (1 + 2 * each)).sum(axis=0) for each in shared]
        still = self._stop > self._stop[-1] - self._window
        self._stop, self._used = self._stop[still], self._used[still]
