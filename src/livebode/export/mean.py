"""The mean of a run: one response from many windows that share samples."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from livebode.nouns import InputError, Lines, Response, Responses

Floats = NDArray[np.float64]


def mean(parts: Iterable[Responses]) -> Response:
    """The mean of the valid responses with a known sigma, line by line, all alike.

    They are not weighted by 1/sigma²: sigma is an estimate that scatters and lags behind, so that windows which have
    just become noisy would keep the weight of quiet ones, and the mean's sigma would be far too small.

    Windows that overlap share noise, so its sigma is not sigma/√n. Of two windows of N samples that start d samples
    apart, the errors of white noise correlate as max(0, 1 − d/N). For n responses that gives

        sigma² = Σᵢⱼ σᵢ·σⱼ·max(0, 1 − dᵢⱼ/N) / n²,

    and since that correlation is how two boxes overlap, the sum is Σₜ C(t)²/N with C(t) the sum of σᵢ over the
    windows that hold sample t. The errors of a Hann window correlate less, so that sigma is too high then;
    next to a lightly damped resonance it is too high as those of the responses are. Where the noise grew it is
    somewhat too low (docs/export.md has the figures).

    It is a mean over everything that the machine did. Where the response changes (an axis in motion, a belt that
    loosens), it is biased for each moment, and `sigma`, which speaks of noise alone, does not show it.

    Parameters
    ----------
    parts
        Responses in order, such as `Run.batches()`; they are read once, and no more of them kept than a window holds.

    Returns
    -------
    Response
        `dof` is the mean of those of the responses that went in, a careful choice: their sigmas stem from more periods
        together. `coherence` is NaN, it does not follow from those of single windows. `time_s` and `schedule` are
        means, `first` and `sample` the extent. A line is valid where a response went in.

    Raises
    ------
    InputError
        If the responses are themselves averages over periods, or none is valid with a known sigma.
    """
    sums: _Sums | None = None
    for part in parts:
        sums = sums or _Sums(part)
        sums.add(part)
    if sums is None or not sums.rows:
        raise InputError(
            "no response has a valid line and a known sigma; track more periods, or take one response with --at TIME"
        )
    return sums.response()


class _Sums:
    """Sums over responses, each of shape (lines,)."""

    def __init__(self, like: Responses) -> None:
        self.like, n = like, len(like.lines)
        self.count, self.value = np.zeros(n), np.zeros(n, dtype=np.complex128)
        self.overlap = _Overlap(like.lines)
        self.rows, self.moment, self.dof = 0, 0.0, 0.0
        self.schedule, self.scheduled = 0.0, 0
        self.first, self.sample = np.iinfo(np.int64).max, 0

    def add(self, part: Responses) -> None:
        _refuse_averages(part)
        used: NDArray[np.bool_] = part.valid & np.isfinite(part.value) & np.isfinite(part.sigma)
        rows = np.asarray(used.any(axis=1))
        if not rows.any():
            return
        used, part = used[rows], part[rows]
        self.count += used.sum(axis=0)
        self.value += np.where(used, part.value, 0).sum(axis=0)
        self.overlap.add(part.first, np.where(used, part.sigma, 0.0))
        self.rows += len(part)
        self.moment += part.time_s.sum()
        self.dof += part.dof.sum()
        known = np.isfinite(part.schedule)
        self.schedule += part.schedule[known].sum()
        self.scheduled += int(known.sum())
        self.first = min(self.first, int(part.first[0]))
        self.sample = int(part.sample[-1])

    def response(self) -> Response:
        valid = self.count > 0
        nothing = np.full(len(valid), np.nan)
        value, sigma = nothing.astype(np.complex128), nothing.copy()
        value[valid] = self.value[valid] / self.count[valid]
        sigma[valid] = np.sqrt(self.overlap.total()[valid]) / self.count[valid]
        return Response(
            lines=self.like.lines,
            value=value,
            sigma=sigma,
            dof=self.dof / self.rows,
            coherence=nothing,
            valid=valid,
            first=int(self.first),
            sample=self.sample,
            time_s=self.moment / self.rows,
            schedule=self.schedule / self.scheduled if self.scheduled else float("nan"),
            quantity=self.like.quantity,
            unit=self.like.unit,
        )


class _Overlap:
    """Σₜ C(t)²/N, C(t) the sum of σ of the windows that hold sample t, as windows go by in order."""

    def __init__(self, lines: Lines) -> None:
        self._window = lines.window
        self._first = np.empty(0, dtype=np.int64)
        self._scatter = np.empty((0, len(lines)))
        self._done: int | None = None
        self._sum = np.zeros(len(lines))

    def add(self, first: NDArray[np.int64], scatter: Floats) -> None:
        self._first = np.concatenate([self._first, first])
        self._scatter = np.concatenate([self._scatter, scatter])
        self._advance(int(self._first[-1]))  # no window to come begins before that

    def total(self) -> Floats:
        self._advance(int(self._first[-1]) + self._window)
        return self._sum

    def _advance(self, until: int) -> None:
        start = int(self._first[0]) if self._done is None else self._done
        edges = np.concatenate([self._first, self._first + self._window]).clip(start, until)
        order = np.argsort(edges, kind="stable")
        covering = np.cumsum(np.concatenate([self._scatter, -self._scatter])[order], axis=0)[:-1]
        self._sum += (covering**2 * np.diff(edges[order])[:, np.newaxis]).sum(axis=0) / self._window
        self._done = until
        open_still = self._first + self._window > until
        self._first, self._scatter = self._first[open_still], self._scatter[open_still]


def _refuse_averages(part: Responses) -> None:
    if np.any(part.sample - part.first >= part.lines.window):
        raise InputError(
            "the responses are averages over periods already, whose mean would count the same samples many times; "
            "take one of them with --at TIME, or track again without averaging"
        )
