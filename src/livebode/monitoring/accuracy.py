"""Accuracy of changes, and the smallest change that would be found in a time."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from livebode.arrays import Floats
from livebode.core import normal_quantile
from livebode.dataclass import dataclass

_BATCHES = (2, 4, 8)  # windows: slow disturbances show in the means of the longer ones only
STRETCH = 24  # windows, over which the deviations from the baseline are estimated
_APART = 4.0  # a change is at least this many scatters
_OFF = 1.5  # scatters are at least this many standard deviations of the baseline's own error: three are then allowed


@dataclass(frozen=True, eq=False)
class ChangeAccuracy:
    """Accuracy of a change of each component, as healthy windows show it, each of shape (components,).

    Attributes
    ----------
    inflation
        Variance of the mean over neighbouring windows, relative to that of independent windows; at least 1.
    scatter
        Standard deviation of an apparent change over stretches of healthy motion: effects of speed, direction and
        friction that the baseline does not contain, and the error of the baseline itself.
    smallest
        Smallest change of the logarithm that raises an alarm.
    """

    inflation: Floats
    scatter: Floats
    smallest: Floats

    @cached_property
    def allowed(self) -> Floats:
        """Permitted distance of a healthy machine from the model."""
        return 2 * self.scatter

    def at_least(self, other: ChangeAccuracy) -> ChangeAccuracy:
        """The coarser of both in each component."""
        pairs = ((getattr(self, name), getattr(other, name)) for name in self.__dataclass_fields__)
        return ChangeAccuracy(*(np.maximum(own, others) for own, others in pairs))

    def widened(self, by: Floats | float) -> ChangeAccuracy:
        """With a further error of the baseline of this standard deviation, (components,)."""
        scatter = np.hypot(self.scatter, by)
        return ChangeAccuracy(self.inflation, scatter, np.maximum(self.smallest, _APART * scatter))


def accuracy(score: Floats, information: Floats, smallest: Floats, off: Floats | float = 0.0) -> ChangeAccuracy:
    """From healthy windows in order, shape (windows, components) each; `smallest` as specified, (components,).

    `off` is the standard deviation of the baseline's own error over a stretch, (components,).
    """
    inflation = np.ones(smallest.shape)
    for size in _BATCHES:
        sums, total = _batched(score, size), _batched(information, size)
        inflation = np.maximum(inflation, _mean(sums**2) / np.maximum(_mean(total), 1e-300))
    sums, total = _batched(score, STRETCH), _batched(information, STRETCH)
    known = total > 0
    excess = np.where(known, (sums / np.where(known, total, 1.0)) ** 2 - 1 / np.where(known, total, np.inf), 0.0)
    scatter = np.hypot(np.sqrt(np.maximum(_mean(excess), 0.0)), _OFF * off)
    return ChangeAccuracy(inflation, scatter, np.maximum(smallest, _APART * scatter))


def scatter_error(information: Floats) -> Floats:
    """Largest scatter that so many healthy windows may have although they show none, (components,).

    One standard deviation of the estimate: a stretch with the information J shows the square of its scatter with an
    error of √2/J.
    """
    total = _batched(information, STRETCH)
    return np.asarray((2 * _mean(1 / np.maximum(total, 1e-300) ** 2) / max(len(total), 1)) ** 0.25)


def _mean(rows: Floats) -> Floats:
    return np.asarray(rows.mean(axis=0) if len(rows) else np.zeros(rows.shape[1]))


def _batched(rows: Floats, size: int) -> Floats:
    whole = len(rows) // size * size
    return np.asarray(rows[:whole].reshape(-1, size, rows.shape[1]).sum(axis=1))


WINDOWS = 600
"""Windows within which a change must show: a change is named as the likeliest one after so many."""
FOUND = 0.95
"""Probability with which the chart of a change reaches the threshold."""

_COARSER = 2.0  # than what the learned runs, or an alarm, allow: from there on a component is not monitored


def detectable(information: Floats, accuracy: ChangeAccuracy, threshold: float) -> Floats:
    """Change of each logarithm that raises an alarm with a probability of 95 %, (components,); infinite without any.

    A chart sums g·(s − I·m), with g = smallest − allowed and m = (smallest + allowed)/2. After windows with the
    information J = ΣI under a change δ, the sum is normal, with the mean g·J·(δ − m) and the variance g²·J; it exceeds
    the threshold h with 95 % if δ = m + h/(g·J) + 1.64/√J. A change is reported from the smallest one on.

    Parameters
    ----------
    information
        Total of the windows, (components,).
    accuracy
        Of the healthy machine.
    threshold
        Of the charts.
    """
    gain, middle, quantile = _chart(accuracy)
    with np.errstate(divide="ignore", invalid="ignore"):
        known = information / accuracy.inflation
        change = middle + threshold / (gain * known) + quantile / np.sqrt(known)
    return np.where(known > 0, np.maximum(change, accuracy.smallest), np.inf)


def information_for(change: Floats, accuracy: ChangeAccuracy, threshold: float) -> Floats:
    """Total information from which on `detectable` is at most this change, (components,)."""
    gain, middle, quantile = _chart(accuracy)
    beyond = change - middle
    root = (quantile + np.sqrt(quantile**2 + 4 * beyond * threshold / gain)) / (2 * beyond)
    return np.asarray(root**2 * accuracy.inflation)


def information_needed(learned: Floats, accuracy: ChangeAccuracy, threshold: float) -> Floats:
    """Information in `WINDOWS` windows below which a component is not monitored, (components,).

    With it, a change is found that is twice the smallest one, or twice what windows as learned allow to find.

    Parameters
    ----------
    learned
        Mean information of a learned window, (components,).
    accuracy, threshold
        As for `detectable`.
    """
    finest = detectable(WINDOWS * learned, accuracy, threshold)
    known = np.isfinite(finest)
    change = np.where(known, _COARSER * finest, 1.0)
    return np.where(known, information_for(change, accuracy, threshold), np.inf)


def _chart(accuracy: ChangeAccuracy) -> tuple[Floats, Floats, float]:
    gain, middle = accuracy.smallest - accuracy.allowed, (accuracy.smallest + accuracy.allowed) / 2
    return gain, middle, normal_quantile(FOUND)
