"""Covariates: measured channels, such as a temperature, that the parameters of a healthy machine depend on."""

from __future__ import annotations

from dataclasses import field
from itertools import pairwise, product

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import BaselineError
from livebode.dataclass import dataclass

_MARGIN = 0.1  # of the learned range, beyond which the influence is unknown
_CONSTANT = 1e-6  # of the mean: a smaller range is rounding
_NOISE = 10.0  # standard deviations of a channel's noise: in 100,000 windows it alone ranges over nine
_ALIKE = 0.99  # correlation from which two covariates cannot be separated
_PARTS = 5  # parts of each run, where there are fewer than three runs to compare
_RUNS_MIN = 3


@dataclass(frozen=True, eq=False)
class Covariates:
    """How the logarithms of stiffness, load, damping and inertia depend on measured channels, linearly.

    Attributes
    ----------
    names
        Of the channels, (covariates,).
    mean, low, high
        Of the learned windows' means, in the channel's unit, (covariates,).
    slope
        Change of each logarithm per unit, (4, covariates).
    covariance
        Of the slopes' errors, (4, covariates, covariates).
    """

    names: tuple[str, ...] = ()
    mean: Floats = field(default_factory=lambda: np.zeros(0))
    low: Floats = field(default_factory=lambda: np.zeros(0))
    high: Floats = field(default_factory=lambda: np.zeros(0))
    slope: Floats = field(default_factory=lambda: np.zeros((4, 0)))
    covariance: Floats = field(default_factory=lambda: np.zeros((4, 0, 0)))

    def __len__(self) -> int:
        return len(self.names)

    @property
    def half_range(self) -> Floats:
        """Half of the learned range, (covariates,)."""
        return np.asarray((self.high - self.low) / 2)

    def shift(self, value: Floats) -> Floats:
        """Expected change of each logarithm at these values, (windows, covariates) in and (windows, 4) out."""
        return np.asarray((value - self.mean) @ self.slope.T)

    def known(self, value: Floats) -> NDArray[np.bool_]:
        """Whether these values, (windows, covariates), are in the learned range, extended by a tenth."""
        margin = 2 * _MARGIN * self.half_range
        return np.asarray(np.all((value >= self.low - margin) & (value <= self.high + margin), axis=1))

    def uncertainty(self) -> Floats:
        """Largest standard deviation of `shift` in the learned range, of each logarithm, (4,)."""
        corners = np.array(list(product(*zip(self.low, self.high)))) - self.mean
        return np.asarray(np.sqrt(np.einsum("pc,jcd,pd->pj", corners, self.covariance, corners).max(axis=0)))


def window_means(data: Floats, begin: NDArray[np.int64], window: int) -> Floats:
    """Mean of the finite samples of each covariate over windows, NaN where there is none, (windows, covariates).

    >>> window_means(np.array([[1.0, 3.0, np.nan, 5.0, np.nan, np.nan]]), np.array([0, 2, 4]), 2).ravel()
    array([ 2.,  5., nan])
    """
    if not len(data):
        return np.zeros((len(begin), 0))
    finite = np.isfinite(data)
    total = np.cumsum(np.pad(np.where(finite, data, 0.0), ((0, 0), (1, 0))), axis=1)
    count = np.cumsum(np.pad(finite, ((0, 0), (1, 0))), axis=1)
    many = count[:, begin + window] - count[:, begin]
    sums = total[:, begin + window] - total[:, begin]
    return np.asarray(np.where(many > 0, sums / np.maximum(many, 1), np.nan).T)


def with_range(names: tuple[str, ...], value: Floats) -> Covariates:
    """Covariates with the range of these values of learned windows, (windows, covariates), and no influence yet.

    The windows are in the order of time, because differences between neighbours are a channel's noise.

    Raises
    ------
    BaselineError
        If one has no value or is constant except for noise, or two are too strongly correlated.
    """
    if not len(value):
        raise BaselineError(
            "covariate-unknown",
            f"no window of steady motion has a value of the covariates {', '.join(names)}",
            "check these channels, or leave them out of [monitoring] covariates",
            channels=list(names),
        )
    low, high = value.min(axis=0), value.max(axis=0)
    # For Gaussian differences; the few steps from run to run hardly change it.
    noise = np.sqrt(np.pi) / 2 * np.abs(np.diff(value, axis=0, append=value[-1:])).mean(axis=0)
    for name, least, most, own in zip(names, low, high, noise):
        rounding = _CONSTANT * max(abs(least), abs(most))
        if most - least <= max(rounding, _NOISE * own):
            span = f"{least:g}" if most - least <= rounding else f"{least:.6g} to {most:.6g}, no more than its noise,"
            raise BaselineError(
                "covariate-constant",
                f"the covariate {name!r} is {span} in all runs, so its influence cannot be learned",
                "add runs at other values, or leave it out of [monitoring] covariates",
                channel=name,
                low=float(least),
                high=float(most),
            )
    alike = np.abs(np.atleast_2d(np.corrcoef(value.T))) - np.eye(len(names))
    if alike.max() > _ALIKE:
        first, second = (names[i] for i in np.unravel_index(int(alike.argmax()), alike.shape))
        raise BaselineError(
            "covariates-correlated",
            f"the covariates {first!r} and {second!r} are too strongly correlated in these runs ({alike.max():.3f})",
            "name one of them in [monitoring] covariates",
            channels=[first, second],
            correlation=float(alike.max()),
        )
    n = len(names)
    return Covariates(names, value.mean(axis=0), low, high, np.zeros((4, n)), np.zeros((4, n, n)))


def parts_of(sizes: list[int]) -> list[NDArray[np.intp]]:
    """Rows of each part of the learned windows that is left out in turn: a run, or a fifth of one.

    Effects of a single run, such as its friction, are common to its windows; so the spread between runs shows how
    well a slope is known. Fewer than three runs are cut into parts, which assumes that they have no such effect.
    """
    edges = np.concatenate([[0], np.cumsum(sizes)])
    runs = [np.arange(first, stop) for first, stop in pairwise(edges)]
    if len(runs) >= _RUNS_MIN:
        return runs
    return [part for run in runs for part in np.array_split(run, _PARTS) if part.size]


def jackknife(estimates: Floats) -> Floats:
    """Covariance of an estimate from its values with one part omitted each (jackknife), (parts, unknowns) in.

    Efron and Stein, Ann. Stat. 9, 1981: (n − 1)/n·Σ(θᵢ − θ̄)(θᵢ − θ̄)ᵀ, biased upwards if at all.
    """
    deviation = estimates - estimates.mean(axis=0)
    return np.asarray((len(deviation) - 1) / len(deviation) * deviation.T @ deviation)
