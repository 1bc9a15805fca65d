"""BetweenRuns: the direction in which healthy runs differ from each other, each by its own amount."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import f_exceeded, normal_quantile, t_quantile
from livebode.monitoring.accuracy import STRETCH
from livebode.monitoring.evidence import Evidence

KNOWN = 0.1  # of the smallest change: standard deviation from which on a run's own offset is known
_FALSE = 1e-4  # probability of a false direction
_MATTERS = 0.25  # of the smallest change: runs that differ by less need no allowance
_DOMINANT = 0.5  # of the largest component, in smallest changes: such a direction cannot be separated from the offset
_CERTAIN = 0.95
_RUNS_MIN, _WITHIN_MIN = 3, 10  # runs, and degrees of freedom of their stretches, from which on they are compared


@dataclass(frozen=True, eq=False)
class BetweenRuns:
    """Difference from run to run without a covariate that explains it, such as a belt's stiffness by temperature.

    Attributes
    ----------
    direction
        Of the logarithms of stiffness, load, damping, inertia, (4,); its largest component is one smallest change.
    spread
        Standard deviation of the runs' offsets along it, with the uncertainty of an estimate from so few runs.
    """

    direction: Floats
    spread: float

    def dominant(self, smallest: Floats) -> NDArray[np.bool_]:
        """Directions with a large share of the offset, (4,): a change of one is detected only within a run."""
        share = np.abs(self.direction / smallest)
        return np.asarray(share >= _DOMINANT * share.max())

    def projected(self, score: Floats, information: Floats, smallest: Floats) -> tuple[Floats, Floats]:
        """Score and information of windows with an offset of any size allowed for in each, (rows, 4), (rows, 4, 4).

        The dominant directions have no information afterwards.
        """
        along = information @ self.direction
        own = (along @ self.direction)[:, np.newaxis]
        gain = np.divide(along, own, out=np.zeros_like(along), where=own > np.finfo(float).tiny)
        score = score - gain * (score @ self.direction)[:, np.newaxis]
        information = information - gain[:, :, np.newaxis] * along[:, np.newaxis, :]
        seen = ~self.dominant(smallest)
        return score * seen, information * np.outer(seen, seen)


def between_runs(parts: Sequence[Evidence], smallest: Floats) -> BetweenRuns | None:
    """The direction in which these runs differ, if it is significant and large enough to matter.

    A run's offset is estimated from all of its windows. The pooled scatter of stretches of 24 windows within runs is
    the noise; the scatter of the offsets beyond it has a largest principal component, in units of the smallest changes.
    It is used if its probability by chance is below 1e-4, and if its standard deviation exceeds a quarter of the
    smallest change: otherwise it would count as scatter of healthy stretches, and hide changes in every direction.
    With fewer than three runs, or fewer than ten degrees of freedom of the stretches, there is no direction.
    """
    parts = [part for part in parts if len(part) >= STRETCH]
    if len(parts) < _RUNS_MIN:
        return None
    offsets, stretches = zip(*(_offset(part, smallest) for part in parts))
    degrees, within = len(parts) - 1, sum(len(stretch) - 1 for stretch in stretches)
    if within < _WITHIN_MIN:
        return None
    windows = np.array([len(part) for part in parts])
    offset, scattered = np.array(offsets), np.concatenate(stretches)
    deviation, noise = offset - offset.mean(axis=0), scattered.T @ scattered / within
    size, vectors = np.linalg.eigh(deviation.T @ deviation / degrees - noise * np.mean(1 / windows))
    along = vectors[:, -1] / np.abs(vectors[:, -1]).max()
    weighted = (offset - np.average(offset, axis=0, weights=windows)) @ along
    ratio = float(windows @ weighted**2 / np.sum((scattered @ along) ** 2))
    variance = np.sum((deviation @ along) ** 2) / degrees - along @ noise @ along * np.mean(1 / windows)
    spread = np.sqrt(max(variance, 0.0)) / (along @ along)
    if chance(ratio, degrees, within) > _FALSE or spread < _MATTERS or size[-1] <= 0:
        return None
    few = t_quantile(_CERTAIN, degrees) / normal_quantile(_CERTAIN)
    return BetweenRuns(along * smallest, float(spread * few))


def chance(ratio: float, between: int, within: int) -> float:
    """Upper bound of the chance that some direction of four scatters so much more between runs than within.

    `ratio` is of the sums of squares, with these degrees of freedom. The direction was chosen by the data, so its ratio
    is at most the largest root of the two Wishart matrices; and Wilks' Λ is at most 1/(1 + that root). Λ's distribution
    by Rao, Bull. Int. Stat. Inst. 33, 1951.
    """
    p = 4
    root = np.sqrt(((p * between) ** 2 - 4) / (p**2 + between**2 - 5))
    first = p * between
    second = (within - (p - between + 1) / 2) * root - first / 2 + 1
    return f_exceeded(((1 + ratio) ** (1 / root) - 1) * second / first, first, second)


def _offset(part: Evidence, smallest: Floats) -> tuple[Floats, Floats]:
    """Offset of a run in all four directions, (4,), and scatter of its stretches, (stretches, 4), in smallest changes.

    The latter as of a single window: a mean over n windows has 1/n of that covariance.
    """
    information = part.information.sum(axis=0)
    inverse = np.linalg.inv(information)
    offset = inverse @ part.score.sum(axis=0)
    left = part.score - part.information @ offset
    cut = np.arange(STRETCH, len(left) - STRETCH // 2, STRETCH)
    scale = [len(left) / np.sqrt(len(piece)) for piece in np.split(left, cut)]
    sums = np.array([piece.sum(axis=0) for piece in np.split(left, cut)])
    return offset / smallest, sums @ inverse * np.array(scale)[:, np.newaxis] / smallest
