"""Accuracy of a change as healthy windows show it, beyond that of independent noise."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from livebode.arrays import Floats

_BATCHES = (2, 4, 8)
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
