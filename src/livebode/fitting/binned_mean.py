"""Means of the responses in consecutive spans of time, with bounds: a long run in few rows."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Responses
from livebode.dataclass import dataclass

Starts = NDArray[np.int64]

_DISTORTION_DOF = 4.0  # as in the mean of a run


@dataclass(frozen=True)
class SharedWindows:
    """How much of their noise two responses have in common, each from one window of each of some experiments.

    White noise correlates in two windows of N samples that begin d apart by max(0, 1 − d/N). Two matrices of n
    experiments have n − e of them in common if one is e experiments after the other, each with 1/n of the noise.

    Parameters
    ----------
    window
        Samples of a window.
    span
        Samples from an experiment to the next.
    experiments
        Number of experiments that a response is computed from.

    Examples
    --------
    >>> SharedWindows(400).share(np.array([0, 100, 400])).tolist()
    [1.0, 0.75, 0.0]
    >>> SharedWindows(400, span=800, experiments=2).share(np.array([0, 800, 900])).tolist()
    [1.0, 0.5, 0.375]
    """

    window: int
    span: int = 0
    experiments: int = 1

    @property
    def reach(self) -> int:
        """Samples after which two responses have nothing in common."""
        return self.window + self.span * (self.experiments - 1)

    def share(self, apart: NDArray[np.int64]) -> Floats:
        """Correlation of two responses whose newest samples are so far apart, shape of `apart`."""
        share = np.zeros(apart.shape)
        for later in range(self.experiments):
            common = 1 - np.abs(apart - later * self.span) / self.window
            share += (self.experiments - later) / self.experiments * np.maximum(common, 0.0)
        return share


@dataclass(frozen=True, eq=False)
class BinnedMeans:
    """The mean of the responses in each span of time that has one, in order.

    Attributes
    ----------
    means
        The mean at each line, as `mean_response` defines it, without its test for a drift: the bound covers the mean
        of the plant in that span, not the plant at a random moment. `time_s`, `schedule` and the coherences are means,
        `first` and `sample` the extent, `weight` is the mean weight. A line is valid if a response was valid there.
    count
        Number of the responses in the mean, (rows, lines).
    windows
        Number of windows without overlap with the same information, (rows, lines); below 2 the sigma is that of a
        single response.
    responses
        Number of all responses of the span, (rows,): `count` is lower where some of them were not valid.
    """

    means: Responses
    count: NDArray[np.int64]
    windows: Floats
    responses: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.means)

    @classmethod
    def join(cls, parts: list[BinnedMeans]) -> BinnedMeans:
        """The rows of all parts, at least one."""
        return cls(
            Responses.join([part.means for part in parts]),
            np.concatenate([part.count for part in parts]),
            np.concatenate([part.windows for part in parts]),
            np.concatenate([part.responses for part in parts]),
        )


def binned_means(responses: Responses, bin_s: float, shared: SharedWindows | None = None) -> BinnedMeans:
    """Mean of the responses whose effective time is in the same span of `bin_s` seconds, counted from time 0.

    A response of a machine that was not ready is left out if another one of its span was ready. The bound is from the
    scatter within the span, and from the number of windows without overlap with the same information, as in
    `mean_response`. With fewer than two such windows, sigma is the root mean square of those of the responses.

    Responses that average over periods already (tracking.average) contain each other; their mean has no bound.

    Parameters
    ----------
    responses
        In order of time.
    bin_s
        Length of a span.
    shared
        Which windows the responses have in common; default: each is from one window.

    Examples
    --------
    >>> import livebode
    >>> found = binned_means(livebode.example_responses(), 1.0)
    >>> len(found), int(found.responses.sum())
    (2, 40)
    """
    starts = _starts(responses.time_s, bin_s)
    if not len(starts):
        empty = np.empty((0, len(responses.lines)))
        return BinnedMeans(responses, empty.astype(np.int64), empty, np.empty(0, dtype=np.int64))
    bins = np.repeat(np.arange(len(starts)), np.diff(np.append(starts, len(responses))))
    ready = np.maximum.reduceat(responses.ready, starts)
    used = responses.valid & np.isfinite(responses.value) & (responses.ready | ~ready[bins])[:, np.newaxis]
    weight = np.where(used, np.where(np.isfinite(responses.weight), responses.weight, 1.0), 0.0)
    known = np.where(used, responses.value, 0.0)
    count = np.add.reduceat(used, starts, axis=0, dtype=np.int64)
    sums = np.add.reduceat(weight, starts, axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        value = np.add.reduceat(known * weight, starts, axis=0) / sums
        error = np.where(used, (known - value[bins]) * weight, 0.0)
        scatter = np.add.reduceat(np.abs(error) ** 2, starts, axis=0)
        overlaps = _overlaps(responses, used, starts, bins, shared or SharedWindows(responses.lines.window))
        windows = count**2 / overlaps[0]
        free = (windows - 1) * overlaps[0] / overlaps[1]
        of_scatter = np.sqrt(scatter * count / (windows - 1)) / np.abs(sums)
        single, single_dof = _of_single(responses, used, starts)
    several = windows >= 2
    distortion = _newest_known(np.where(used, responses.distortion, np.nan), starts)
    noise = np.where(several, of_scatter, single)
    sigma, dof = _with_distortion(noise, np.where(several, free, single_dof[:, np.newaxis]), distortion, several)
    means = _reduced(responses, starts, value, used)
    means = replace(
        means, sigma=sigma, dof=dof, distortion=distortion, ready=ready,
        weight=np.where(count > 0, sums / np.maximum(count, 1), complex(np.nan, np.nan)),
    )  # fmt: skip
    return BinnedMeans(means, count, np.where(count > 0, windows, np.nan), np.diff(np.append(starts, len(responses))))


def combined(parts: BinnedMeans, bin_s: float) -> BinnedMeans:
    """Means of longer spans: of the rows, in order of time, that are in the same span of `bin_s` seconds.

    Rows are taken as independent, except for the windows that begin in one and end in the next: with m windows in all,
    each such border increases sigma² by 1/(3·m), the share of white noise. If a row has fewer than two windows, its
    neighbours may have the same noise: with k later rows that share samples with a row, sigma² is multiplied by 1 + 2·k
    (2·|cov(a, b)| is at most var(a) + var(b)), or the sigmas are added, whichever is less.
    """
    starts = _starts(parts.means.time_s, bin_s)
    if len(starts) == len(parts):
        return parts
    rows = np.diff(np.append(starts, len(parts)))[:, np.newaxis]
    means, count = parts.means, parts.count
    used = count > 0
    weight = np.where(used, np.where(used, means.weight, 0.0) * count, 0.0)
    known = np.where(used, means.value, 0.0)
    sums = np.add.reduceat(weight, starts, axis=0)
    windows = np.add.reduceat(np.nan_to_num(parts.windows), starts, axis=0)
    repeats = np.where(np.isfinite(means.distortion), means.distortion, 0.0)
    noise = np.sqrt(np.maximum(np.where(used, means.sigma, 0.0) ** 2 - repeats**2, 0.0))
    with np.errstate(invalid="ignore", divide="ignore"):
        value = np.add.reduceat(known * weight, starts, axis=0) / sums
        variance = (np.abs(weight) * noise) ** 2
        total = np.add.reduceat(variance, starts, axis=0)
        free = total**2 / np.add.reduceat(variance**2 / means.dof[:, np.newaxis], starts, axis=0)
        independent = np.sqrt(total * (1 + (rows - 1) / (3 * windows))) / np.abs(sums)
        shared = np.searchsorted(means.first, means.sample, side="right") - np.arange(len(means)) - 1
        most = np.maximum.reduceat(np.maximum(shared, 0), starts)[:, np.newaxis]
        added = np.add.reduceat(np.abs(weight) * noise, starts, axis=0)
        dependent = np.minimum(added, np.sqrt(total * (1 + 2 * most))) / np.abs(sums)
    short = np.maximum.reduceat(used & (parts.windows < 2), starts, axis=0)
    least = np.minimum.reduceat(np.where(np.isfinite(means.dof), means.dof, np.inf), starts)[:, np.newaxis]
    distortion = _newest_known(means.distortion, starts)
    counts = np.add.reduceat(count, starts, axis=0)
    several = (counts > 0) & ~short
    sigma, dof = _with_distortion(
        np.where(short, dependent, independent), np.where(short, least, np.where(several, free, np.inf)), distortion,
        several,
    )  # fmt: skip
    reduced = _reduced(means, starts, value, used, count)
    reduced = replace(
        reduced, sigma=sigma, dof=dof, distortion=distortion, ready=np.maximum.reduceat(means.ready, starts),
        weight=np.where(counts > 0, sums / np.maximum(counts, 1), complex(np.nan, np.nan)),
    )  # fmt: skip
    total_responses = np.add.reduceat(parts.responses, starts)
    return BinnedMeans(reduced, counts, np.where(counts > 0, windows, np.nan), total_responses)


def _starts(time_s: Floats, bin_s: float) -> Starts:
    """First row of each span."""
    if not len(time_s):
        return np.empty(0, dtype=np.int64)
    number = np.floor(time_s / bin_s)
    return np.concatenate([[0], np.flatnonzero(np.diff(number)) + 1]).astype(np.int64)


def _overlaps(
    responses: Responses, used: NDArray[np.bool_], starts: Starts, bins: NDArray[Any], shared: SharedWindows
) -> Floats:
    """Σᵢⱼ of the correlations of the pairs of responses of each span, and of their squares, (2, spans, lines)."""
    sample = responses.sample
    total = np.stack([used.astype(np.float64)] * 2)
    for lag in range(1, len(responses)):
        apart = sample[lag:] - sample[:-lag]
        if not (apart < shared.reach).any():
            break
        share = np.where(bins[lag:] == bins[:-lag], shared.share(apart), 0.0)
        both = used[lag:] & used[:-lag]
        total[0, lag:] += 2 * share[:, np.newaxis] * both
        total[1, lag:] += 2 * share[:, np.newaxis] ** 2 * both
    return np.asarray(np.add.reduceat(total, starts, axis=1))


def _of_single(responses: Responses, used: NDArray[np.bool_], starts: Starts) -> tuple[Floats, Floats]:
    """Root mean square of the sigmas without distortion, and the least degrees of freedom of the responses."""
    repeats = np.where(np.isfinite(responses.distortion), responses.distortion, 0.0)
    known = used & np.isfinite(responses.sigma)
    variance = np.where(known, np.maximum(responses.sigma**2 - repeats**2, 0.0), 0.0)
    number = np.add.reduceat(known, starts, axis=0, dtype=np.int64)
    least = np.where(known.any(axis=1) & np.isfinite(responses.dof), responses.dof, np.inf)
    return np.sqrt(np.add.reduceat(variance, starts, axis=0) / number), np.minimum.reduceat(least, starts)


def _with_distortion(
    noise: Floats, dof: Floats, distortion: Floats, several: NDArray[np.bool_]
) -> tuple[Floats, Floats]:
    """Sigma, and the least degrees of freedom over the lines."""
    added = np.where(np.isfinite(distortion), distortion, 0.0)
    sigma = np.hypot(noise, added)
    with np.errstate(invalid="ignore", divide="ignore"):
        free = np.where(several & (added > 0), sigma**4 / (noise**4 / dof + added**4 / _DISTORTION_DOF), dof)
    free = np.where(np.isfinite(sigma) & np.isfinite(free), free, np.inf).min(axis=1, initial=np.inf)
    return sigma, np.where(np.isfinite(free), free, np.nan)


def _newest_known(values: Floats, starts: Starts) -> Floats:
    """The last finite value of each span at each line; NaN without one."""
    row = np.where(np.isfinite(values), np.arange(len(values))[:, np.newaxis], -1)
    newest = np.maximum.reduceat(row, starts, axis=0)
    newest_values = np.take_along_axis(values, np.maximum(newest, 0), axis=0)
    return np.where(newest >= 0, newest_values, np.nan)


def _reduced(
    rows: Responses,
    starts: Starts,
    value: NDArray[Any],
    used: NDArray[np.bool_],
    count: NDArray[np.int64] | None = None,
) -> Responses:
    """Responses with these values, and with the extent and the means of the other columns."""
    each = np.ones_like(used, dtype=np.int64) if count is None else count

    def mean(values: Floats) -> Floats:
        known = np.where(used & np.isfinite(values), each, 0)
        with np.errstate(invalid="ignore", divide="ignore"):
            sums = np.add.reduceat(np.where(known > 0, values, 0.0) * known, starts, axis=0)
            return np.asarray(sums / np.add.reduceat(known, starts, axis=0))

    valid = np.maximum.reduceat(used, starts, axis=0)
    share = np.maximum(each.max(axis=1), 1).astype(np.float64)
    placed = np.isfinite(rows.schedule)
    with np.errstate(invalid="ignore", divide="ignore"):
        time_s = np.add.reduceat(rows.time_s * share, starts) / np.add.reduceat(share, starts)
        schedule = np.add.reduceat(np.where(placed, rows.schedule, 0.0) * share, starts)
        schedule /= np.add.reduceat(np.where(placed, share, 0.0), starts)
    return replace(
        rows[starts],
        value=np.where(valid, value, complex(np.nan, np.nan)),
        coherence=mean(rows.coherence),
        input_coherence=mean(rows.input_coherence),
        valid=valid,
        first=np.minimum.reduceat(rows.first, starts),
        sample=np.maximum.reduceat(rows.sample, starts),
        time_s=time_s,
        schedule=schedule,
        variation=np.full(valid.shape, np.nan),  # the scatter within the span contains it
    )
