"""Averages over competing models: as values of one model, with a covariance that contains the choice."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.dataclass import dataclass
from livebode.fitting.competitors import Competition, Competitor
from livebode.fitting.extended import MODE, ExtendedModel
from livebode.fitting.family import FamilyMember
from livebode.fitting.physical import DELAY, PhysicalModel

_SHARE = 0.03  # least weight of all models with an effect, from which the average over all has it


@dataclass(frozen=True, eq=False)
class Average:
    """Values of one model about which competitors are distributed.

    Attributes
    ----------
    model, values, covariance
        The model, its values, and the mean square of the competitors' differences from them, each by its weight and
        with its own covariance.
    free
        Names of the parameters that the best model fits; others have the value that is specified, or what they are in
        the average.
    """

    model: PhysicalModel
    values: Floats
    covariance: Floats
    free: frozenset[str]


def average(of: Competition) -> Average:
    """Over all competitors, in one model that has every effect of notable weight: what the lines rule out is not in it,
    and what they do not show is.

    All have a place in the family, zero for what they lack, and nearly linear responses between them: the mean of their
    values is a model that fits as they do.
    """
    effects = {e for e in of.family.effects if of.share(e) >= _SHARE} | of.every[0].of.member.effects
    return _about(of, _mean(of, of.every), effects, of.every[0].of.free)


def named_average(of: Competition) -> Average:
    """In the best model and the frictions of the others: what else the best one lacks is in the covariance only.

    Its own parameters are the mean over all competitors. Frictions and effects are the mean over those that differ from
    the best one in friction only, moved as its covariance moves them with its own parameters: so it fits the lines.
    """
    family, best = of.family, of.every[0]
    effects, frictions = best.of.member.effects, set(family.base.frictions)
    mean = _mean(of, [c for c in of.every if c.of.member.effects - frictions == effects - frictions])
    own = np.array([name in family.base.names and name not in {DELAY, *frictions} for name in family.names])
    moved, others = np.flatnonzero(best.of.free & own), np.flatnonzero(best.of.free & ~own)
    step = _mean(of, of.every)[moved] - mean[moved]
    mean[others] += _regression(best.covariance, others, moved) @ step
    mean[moved] += step
    free = best.of.free
    return _about(of, _bounded(of, mean), effects | {e for e in frictions if of.share(e) > 0}, free)


def _regression(covariance: Floats, of: NDArray[np.intp], by: NDArray[np.intp]) -> Floats:
    """Change of the expected values of some parameters by each of others, (of, by)."""
    sigma = np.sqrt(np.diag(covariance))
    sigma = np.where(sigma > 0, sigma, 1.0)
    matrix = covariance / np.outer(sigma, sigma)
    slope = matrix[np.ix_(of, by)] @ np.linalg.pinv(matrix[np.ix_(by, by)], hermitian=True)
    return np.asarray(slope * np.divide.outer(sigma[of], sigma[by]))


def specified(of: Competition) -> Average:
    """Of the specified model itself: the covariance shows where all others are."""
    first = of.first
    return _about(of, first.values.copy(), first.member.effects, first.free)


def _about(of: Competition, mean: Floats, effects: Collection[str], free: NDArray[np.bool_]) -> Average:
    """These values, and the covariance of all competitors about them, in the model that has these effects."""
    family = of.family
    extras = tuple(e for e in family.extras if e in effects)
    unnamed = tuple(e for e in extras if e not in of.every[0].of.member.effects)
    model = ExtendedModel(family.base, extras, family.top_hz, unnamed) if extras else family.base
    means, matrices = (np.array([getattr(c, name) for c in of.every]) for name in ("mean", "covariance"))
    apart = means - mean
    if MODE in family.effects:  # frequency and damping of a mode that a model lacks are not apart
        there = np.array([MODE in c.of.member.effects for c in of.every])
        for name in ("mode", "mode_damping"):
            apart[:, family.index(name)] *= there
    matrix = np.einsum("m,mij->ij", of.weight, matrices) + np.einsum("m,mi,mj->ij", of.weight, apart, apart)
    moved = family.free(FamilyMember(frozenset(effects), damped=True))
    for name, value in family.specified.items():
        if not moved[family.index(name)]:
            mean[family.index(name)] = value
    columns = [family.index(name) for name in model.names]
    matrix = np.where(np.outer(moved, moved), matrix, 0.0)[np.ix_(columns, columns)]
    return Average(model, mean[columns], matrix, frozenset(n for n, is_free in zip(family.names, free) if is_free))


def _mean(of: Competition, centre: Sequence[Competitor]) -> Floats:
    """Mean of the values within their bounds; of frequency and damping of a further mode over those that have it."""
    family = of.family
    weight = np.array([w for c, w in zip(of.every, of.weight) if any(c is one for one in centre)] or [1.0])
    each = np.repeat(weight[:, np.newaxis], len(family.names), axis=1)
    there = np.array([MODE in c.of.member.effects for c in centre])
    for name in ("mode", "mode_damping") if there.any() else ():
        each[:, family.index(name)] *= there
    mean = np.sum(each * np.array([c.mean for c in centre]), axis=0) / each.sum(axis=0)
    return _bounded(of, mean)


def _bounded(of: Competition, values: Floats) -> Floats:
    low, high = (np.array([getattr(p, end) for p in of.family.model.parameters]) for end in ("low", "high"))
    return np.asarray(values.clip(low, high))


def positive(matrix: Floats) -> Floats:
    """The positive semidefinite part of a symmetric matrix, in units in which its diagonal is one."""
    scale = np.sqrt(np.abs(np.diag(matrix)))
    scale = np.where(scale > 0, scale, 1.0)
    values, vectors = np.linalg.eigh(matrix / np.outer(scale, scale))
    return np.asarray((vectors * values.clip(0)) @ vectors.T * np.outer(scale, scale))
