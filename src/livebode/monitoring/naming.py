"""Identifies a change: of all single changes, everywhere or at one place, the one that best explains the windows."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats
from livebode.core import INTERVAL_FACTOR
from livebode.dataclass import dataclass
from livebode.monitoring.accuracy import ChangeAccuracy
from livebode.monitoring.sensitivity import DIRECTIONS, FAR, LocalChange

# Standard deviations of a place, and the grid of its centre, as shares of the learned travel.
_WIDTHS = np.array([0.015, 0.026, 0.045])
_GRID = 0.004
_STIFFNESS = DIRECTIONS.index("stiffness")
_FIRM = [DIRECTIONS.index(name) for name in ("stiffness", "load", "inertia")]  # damping doubles easily
_EXPLAINED = 0.9  # of all evidence: a single change of ten percent of stiffness or double damping explains 0.93 … 0.99
_SHAPE = 0.3  # of a place's depth, which depends on its assumed shape


@dataclass(frozen=True)
class NamedChange:
    """A change of one parameter, everywhere or at a place.

    Attributes
    ----------
    direction
        Number in `DIRECTIONS`.
    amount, bound
        Of the logarithm, and the half-width of its 95 % bound.
    place
        Place of the change, None for a change of the whole travel.
    evidence
        Log-likelihood ratio of the windows with this change to no change, nats.
    """

    direction: int
    amount: float
    bound: float
    evidence: float
    place: LocalChange | None = None

    def share(self, position_m: Floats) -> Floats:
        """Share of the change at these positions, 0 … 1."""
        return np.ones(position_m.shape) if self.place is None else self.place.share(position_m)


@dataclass(frozen=True, eq=False)
class ScoredWindows:
    """Windows since a change seems to have begun: score (rows, 4), information (rows, 4, 4), position (rows,)."""

    score: Floats
    information: Floats
    position_m: Floats

    def without(self, known: list[int]) -> ScoredWindows:
        """These windows with changes of any size in these directions allowed for."""
        if not known:
            return self
        if len(known) == 1:  # the usual case, without small linear algebra
            (j,) = known
            own = self.information[:, :, j] * (1 / self.information[:, j, j])[:, np.newaxis]
            score = self.score - own * self.score[:, j, np.newaxis]
            information = self.information - own[:, :, np.newaxis] * self.information[:, np.newaxis, j]
        else:
            inverse = np.linalg.inv(self.information[:, known][:, :, known])
            gain = self.information[:, :, known] @ inverse
            score = self.score - np.einsum("rjk,rk->rj", gain, self.score[:, known])
            information = self.information - gain @ self.information[:, known]
        for i in known:
            score[:, i], information[:, i], information[:, :, i] = 0.0, 0.0, 0.0
        return ScoredWindows(score, information, self.position_m)


def candidates(segment: ScoredWindows, known: ChangeAccuracy, way_m: float, local: bool = True) -> list[NamedChange]:
    """Every single change, the likeliest first; the `known` accuracy of the healthy machine widens the bounds.

    `way_m` is the learned travel; with `local`, places of a few hundredths of it are searched too.
    """
    score = segment.score.sum(axis=0)
    information = np.einsum("rjj->j", segment.information)
    changes = [
        NamedChange(
            j, score[j] / information[j], bound(known, j, float(information[j])), score[j] ** 2 / (2 * information[j])
        )
        for j in range(len(DIRECTIONS))
        if information[j] > 0
    ]
    if local and way_m > 0 and information[_STIFFNESS] > 0:
        changes.append(_place(segment, known, way_m))
    return sorted(changes, key=lambda change: -change.evidence)


def bound(known: ChangeAccuracy, direction: int, information: float) -> float:
    """Half-width of the 95 % bound, from windows with this total information."""
    noise = np.sqrt(known.inflation[direction] / information)
    return float(INTERVAL_FACTOR * np.hypot(noise, known.scatter[direction]))


def _place(segment: ScoredWindows, known: ChangeAccuracy, way_m: float) -> NamedChange:
    """The likeliest bell-shaped place of changed stiffness."""
    x, widths = segment.position_m, _WIDTHS * way_m
    centres = np.arange(x.min(), x.max() + _GRID * way_m, _GRID * way_m)
    bell = np.exp(-((x[:, np.newaxis, np.newaxis] - centres[:, np.newaxis]) ** 2) / (2 * widths**2))
    score = np.einsum("r,rcw->cw", segment.score[:, _STIFFNESS], bell)
    information = np.einsum("r,rcw->cw", segment.information[:, _STIFFNESS, _STIFFNESS], bell**2)
    with np.errstate(divide="ignore", invalid="ignore"):
        evidence = np.where(information > 0, score**2 / (2 * information), 0.0)
    c, w = np.unravel_index(int(np.argmax(evidence)), evidence.shape)
    amount = float(score[c, w] / information[c, w])
    return NamedChange(
        _STIFFNESS,
        amount,
        float(np.hypot(bound(known, _STIFFNESS, float(information[c, w])), _SHAPE * amount)),
        # One of many places, chosen by the data: the likelihood is reduced by the effect of this choice.
        float(evidence[c, w] - np.log(max(np.ptp(x) / widths[0], 1.0) * len(widths))),
        LocalChange(float(centres[c]), float(widths[w])),
    )


def far(segment: ScoredWindows, best: NamedChange, known: ChangeAccuracy) -> list[NamedChange]:
    """All directions at once, where the machine is far from the baseline and no single change explains it; else none.

    A large change of one direction is nonlinear, so that a linear model confuses it with others and explains none.
    """
    score, information = segment.score.sum(axis=0), segment.information.sum(axis=0)
    amount = np.linalg.lstsq(information, score, rcond=None)[0]
    if np.abs(amount[_FIRM]).max() < FAR or best.evidence > _EXPLAINED * float(score @ amount) / 2:
        return []
    own = np.diagonal(information)
    return [
        NamedChange(j, float(amount[j]), bound(known, j, float(own[j])), float(own[j] * amount[j] ** 2 / 2))
        for j in _FIRM
    ]


def lead(segment: ScoredWindows, best: NamedChange, rival: NamedChange, free: ChangeAccuracy) -> float:
    """Log-likelihood ratio of the windows between two changes, nats, with the uncertainty of the model allowed for.

    Two directions are separated by the part of one that remains with the other free; the accuracy of that part on a
    healthy machine is in `free`.
    """
    ahead, b, r = best.evidence - rival.evidence, best.direction, rival.direction
    if best.place is not None or rival.place is not None:
        return ahead
    information = segment.information.sum(axis=0)
    left = information[b, b] - information[b, r] ** 2 / information[r, r]
    return float(ahead / (free.inflation[b] + left * free.scatter[b] ** 2))


def begin_of(segment: ScoredWindows, change: NamedChange) -> int:
    """Row from which the windows best support the change: its likeliest beginning."""
    amount = change.amount * change.share(segment.position_m)
    score, information = segment.score[:, change.direction], segment.information[:, change.direction, change.direction]
    gain = amount * score - amount**2 * information / 2
    return int(np.argmax(np.cumsum(gain[::-1])[::-1]))
