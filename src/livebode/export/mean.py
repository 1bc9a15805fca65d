"""The mean of a run: one response from many windows that share samples."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from livebode.nouns import InputError, Lines, Response, Responses

Floats = NDArray[np.float64]
Weights = Literal["sigma", "equal"]

DOF_MIN = 4.0
"""Fewest degrees of freedom behind a sigma that weights: with d of them 1/sigma² scatters by 1/√(d − 2) of itself."""


def mean(parts: Iterable[Responses], *, weights: Weights = "sigma") -> Response:
    """The mean of the valid responses, line by line, weighted by 1/sigma² or all alike.

    With 1/sigma² only responses whose sigma has at least `DOF_MIN` degrees of freedom go in: a sigma from one or
    two periods is at times far too small, and its weight would decide the mean. Even so weights that are estimates
    cost: where the noise does not change, equal weights have the smaller error, and bounds that hold more nearly
    what they promise. Where it changes, sigma lags behind by its memory; windows that have just become noisy keep
    the weight of quiet ones, and the mean's sigma is far too small. Equal weights suffer less. docs/export.md has
    the figures.

    Windows that overlap share noise, so its sigma is not 1/√(Σ 1/σᵢ²). Of two windows of N samples that start d samples
    apart, the errors of white noise correlate as max(0, 1 − d/N). With weights wᵢ that gives

        sigma² = Σᵢⱼ wᵢ·σᵢ·wⱼ·σⱼ·max(0, 1 − dᵢⱼ/N) / (Σᵢ wᵢ)²,

    and since that correlation is how two boxes overlap, the sum is Σₜ C(t)²/N with C(t) the sum of wᵢ·σᵢ over the
    windows that hold sample t. The errors of a Hann window correlate less, so that sigma is too high then;
    next to a lightly damped resonance it is too high as those of the responses are.

    It is a mean over everything that the machine did. Where the response changes (an axis in motion, a belt that
    loosens), it is biased for each moment, and `sigma`, which speaks of noise alone, does not show it.

    Parameters
    ----------
    parts
        Responses in order, such as `Run.batches()`; they are read once, and no more of them kept than a window holds.
    weights
        "sigma" for 1/sigma², "equal" for all alike.

    Returns
    -------
    Response
        `dof` is the mean of those of the responses that went in, a careful choice: their sigmas stem from more periods
        together. `coherence` is NaN, it does not follow from those of single windows. `time_s` and `schedule` are
        means, `first` and `sample` the extent. A line is valid where a response went in.

    Raises
    ------
    InputError
        If the responses are themselves averages over periods, or none is valid with a known sigma (of `DOF_MIN`,
        where it weights).
    """
    sums: _Sums | None = None
    for part in parts:
        sums = sums or _Sums(part, weights)
        sums.add(part)
    if sums is None or not sums.rows:
        wanted = f"sigma of {DOF_MIN:g} degrees of freedom" if weights == "sigma" else "known sigma"
        raise InputError(
            f"no response has a valid line and a {wanted}, so none can be weighted; track more periods, or with a "
            "longer memory (--forgetting), or take one response with --at TIME"
        )
    return sums.response()


class _Sums:
    """Weighted sums over responses, each of shape (lines,)."""

    def __init__(self, like: Responses, weights: Weights) -> None:
        self.like, self.weights, n = like, weights, len(like.lines)
        self.weight, self.weighted = np.zeros(n), np.zeros(n, dtype=np.complex128)
        self.overlap = _Overlap(like.lines)
        self.rows, self.moment, self.dof = 0, 0.0, 0.0
        self.schedule, self.scheduled = 0.0, 0
        self.first, self.sample = np.iinfo(np.int64).max, 0

    def add(self, part: Responses) -> None:
        _refuse_averages(part)
        # sigma of a simulation without noise may be 0; no double is better than its rounding.
        sigma = np.maximum(part.sigma, np.finfo(float).eps * np.abs(part.value))
        used: NDArray[np.bool_] = part.valid & np.isfinite(part.value) & np.isfinite(sigma) & (sigma > 0)
        if self.weights == "sigma":
            used = used & (part.dof >= DOF_MIN)[:, np.newaxis]
        rows = np.asarray(used.any(axis=1))
        if not rows.any():
            return
        used, sigma, part = used[rows], np.where(used, sigma, 1.0)[rows], _rows(part, rows)
        weight = np.where(used, sigma**-2.0 if self.weights == "sigma" else 1.0, 0.0)
        self.weight += weight.sum(axis=0)
        self.weighted += np.where(used, part.value * weight, 0).sum(axis=0)
        self.overlap.add(part.first, weight * sigma)
        self.rows += len(part)
        self.moment += part.time_s.sum()
        self.dof += part.dof.sum()
        known = np.isfinite(part.schedule)
        self.schedule += part.schedule[known].sum()
        self.scheduled += int(known.sum())
        self.first = min(self.first, int(part.first[0]))
        self.sample = int(part.sample[-1])

    def response(self) -> Response:
        valid = self.weight > 0
        nothing = np.full(len(valid), np.nan)
        value, sigma = nothing.astype(np.complex128), nothing.copy()
        value[valid] = self.weighted[valid] / self.weight[valid]
        sigma[valid] = np.sqrt(self.overlap.total()[valid]) / self.weight[valid]
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
    """Σₜ C(t)²/N, C(t) the sum of wσ of the windows that hold sample t, as windows go by in order."""

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


def _rows(part: Responses, rows: NDArray[np.bool_]) -> Responses:
    names = ("value", "sigma", "dof", "coherence", "valid", "first", "sample", "time_s", "schedule")
    return replace(part, **{name: getattr(part, name)[rows] for name in names})
