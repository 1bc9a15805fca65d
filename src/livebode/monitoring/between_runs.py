"""BetweenRuns: the one direction in which healthy runs differ from each other, each by an amount of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, t

from livebode.monitoring.accuracy import STRETCH
from livebode.monitoring.evidence import Evidence

Floats = NDArray[np.float64]

KNOWN = 0.1  # of the smallest change: standard deviation from which on a run's own offset is known
_FALSE = 1e-4  # chance of a direction that is not there
_MATTERS = 0.25  # of the smallest change: runs that differ by less need no allowance
_DOMINANT = 0.5  # of the largest component, in smallest changes: such a direction is not seen beside the offset
_CERTAIN = 0.95


@dataclass(frozen=True, eq=False)
class BetweenRuns:
    """What differs from run to run without a covariate that explains it, such as a belt's stiffness by temperature.

    Attributes
    ----------
    direction
        Of the logarithms of stiffness, load, damping, inertia, (4,); its largest component is one smallest change.
    spread
        Standard deviation of the runs' offsets along it, with what so few runs leave open.
    """

    direction: Floats
    spread: float

    def dominant(self, smallest: Floats) -> NDArray[np.bool_]:
        """Directions that the offset is made of, (4,): a change of one is seen within a run alone."""
        share = np.abs(self.direction / smallest)
        return np.asarray(share >= _DOMINANT * share.max())

    def projected(self, score: Floats, information: Floats, smallest: Floats) -> tuple[Floats, Floats]:
        """Score and information of windows with an offset of any size allowed for in each, (rows, 4), (rows, 4, 4).

        The directions that the offset is made of are left without information.
        """
        along = information @ self.direction
        own = (along @ self.direction)[:, np.newaxis]
        gain = np.divide(along, own, out=np.zeros_like(along), where=own > np.finfo(float).tiny)
        score = score - gain * (score @ self.direction)[:, np.newaxis]
        information = information - gain[:, :, np.newaxis] * along[:, np.newaxis, :]
        seen = ~self.dominant(smallest)
        return score * seen, information * np.outer(seen, seen)


def between_runs(parts: Sequence[Evidence], smallest: Floats) -> BetweenRuns | None:
    """The direction in which these runs differ, if it is beyond chance and matters.

    A run's offset is estimated from all of its windows, with the covariance that its stretches of 24 windows show. What
    the offsets scatter beyond that has a largest principal component, in units of the smallest changes; it counts where
    chance makes it less than once in 10,000 times, and where its standard deviation exceeds a quarter of the smallest
    change: then it would be taken for what healthy stretches have in common, and hide changes in every direction.
    """
    parts = [part for part in parts if len(part) >= STRETCH]
    if len(parts) < 2:
        return None
    offsets, errors = zip(*(_offset(part, smallest) for part in parts))
    rest = np.array(offsets) - np.mean(offsets, axis=0)
    degrees = len(parts) - 1
    size, vectors = np.linalg.eigh(rest.T @ rest / degrees - np.mean(errors, axis=0))
    along = vectors[:, -1] / np.abs(vectors[:, -1]).max()
    noise = along @ np.mean(errors, axis=0) @ along
    chance = chi2.sf(np.sum((rest @ along) ** 2) / noise, degrees)
    spread = np.sqrt(max(np.sum((rest @ along) ** 2) / degrees - noise, 0.0)) / (along @ along)
    if chance > _FALSE or spread < _MATTERS or size[-1] <= 0:
        return None
    few = t.ppf(_CERTAIN, degrees) / t.ppf(_CERTAIN, np.inf)
    return BetweenRuns(along * smallest, float(spread * few))


def _offset(part: Evidence, smallest: Floats) -> tuple[Floats, Floats]:
    """All four directions of a run together and their covariance, in smallest changes, (4,), (4, 4)."""
    information = part.information.sum(axis=0)
    inverse = np.linalg.inv(information)
    offset = inverse @ part.score.sum(axis=0)
    left = part.score - part.information @ offset
    cut = np.arange(STRETCH, len(left) - STRETCH // 2, STRETCH)
    sums = np.array([piece.sum(axis=0) for piece in np.split(left, cut)])
    shown = inverse @ (sums.T @ sums) @ inverse * len(sums) / (len(sums) - 1) if len(sums) > 1 else inverse
    return offset / smallest, shown / np.outer(smallest, smallest)
