"""How the response varies over a record: as a trend, settling, a step or periodic, where noise does not explain it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import log_sum_exceeded
from livebode.dataclass import dataclass

FALSE_ALARM = 0.005
"""Probability that a record of a machine that does not change is reported, all lines and kinds together."""
GROUPS_MIN = 6  # with fewer moments, a trend and its scatter have too few degrees of freedom
_FURTHER = 0.1  # probability of a component too much, once a change is certain
_COMPONENTS_MAX = 6
_ROUNDING = 1e-9  # of a response
_TAUS = (0.03, 0.06, 0.12, 0.25, 0.5, 1.0)  # time constants that are tried, of the record
_BESIDE = np.array([2, 3, 4, 5, 6])  # cycles per record beside a periodic variation with which it is compared
_REFINED = 33

Kind = Literal["trend", "settling", "step", "periodic"]


@dataclass(frozen=True)
class Component:
    """A function of time that all lines share, each with its own complex factor.

    Attributes
    ----------
    kind
        "trend", "settling", "step" or "periodic".
    place
        Degree of a trend; time constant, time of the step, or period, each as a share of the record.
    """

    kind: Kind
    place: float

    def functions(self, share: Floats) -> Floats:
        """At these shares of the record, (functions, moments): powers, exponential, step, or cosine and sine."""
        if self.kind == "trend":
            x = 2 * share - 1
            return np.array([x, (3 * x**2 - 1) / 2, (5 * x**3 - 3 * x) / 2][: int(self.place)])
        if self.kind == "settling":
            return np.exp(-share / self.place)[np.newaxis]
        if self.kind == "step":
            return (share > self.place)[np.newaxis].astype(np.float64)
        angle = 2 * np.pi * share / self.place
        return np.array([np.cos(angle), np.sin(angle)])


@dataclass(frozen=True, eq=False)
class GroupSeries:
    """The response at lines that have values at the same moments.

    Attributes
    ----------
    at
        Numbers of the lines.
    share, count
        Moments as shares of the record, ascending, and number of windows in the value there, (moments,).
    value
        Mean response at each moment, (moments, lines).
    """

    at: NDArray[np.intp]
    share: Floats
    count: Floats
    value: Complex


class _Remainder:
    """What chosen components leave of a series; rows are weighted, so that white noise has equal power in all."""

    def __init__(self, of: GroupSeries) -> None:
        self.share, self.at, self._weight = of.share, of.at, np.sqrt(of.count)
        self._basis = np.empty((len(of.share), 0))
        self._left = of.value * self._weight[:, np.newaxis]
        self._floor = _ROUNDING**2 * np.sum(np.abs(self._left) ** 2, axis=0)
        self._remove(self._weight[:, np.newaxis])

    @property
    def free(self) -> int:
        return self._basis.shape[0] - self._basis.shape[1]

    def remove(self, component: Component) -> None:
        self._remove((component.functions(self.share) * self._weight).T)

    def _remove(self, functions: Floats) -> None:
        basis = np.concatenate([self._basis, functions], axis=1)
        self._basis = np.linalg.qr(basis)[0]
        self._left = self._left - self._basis @ (self._basis.T @ self._left)

    def power(self) -> Floats:
        """Of what is left, (lines,)."""
        return np.asarray(np.sum(np.abs(self._left) ** 2, axis=0) + self._floor)

    def log_chances(self, functions: Floats) -> tuple[Floats, Floats]:
        """ln of the probability of each candidate by noise, and the power that it explains, (candidates, lines).

        `functions` is (functions, candidates, moments). The noise may grow or fade in the record: the variance of a
        factor is also computed from the squares of the residuals where its function is large (H. White, Econometrica
        48, 1980), with as many degrees of freedom as it has moments there, and the larger probability counts.
        """
        squares, kinds = np.abs(self._left) ** 2, len(functions)
        explained = np.zeros((functions.shape[1], self._left.shape[1]))
        noise, profile = explained.copy(), np.zeros(functions.shape[1:])
        orthonormal: list[Floats] = []
        for each in functions * self._weight:
            unit = self._unit(each, orthonormal)
            orthonormal.append(unit)
            factor, fourth = unit @ self._left, np.sum(unit**4, axis=1, keepdims=True)
            explained += np.abs(factor) ** 2
            around = (
                unit**2 @ squares - 2 * (factor.conj() * (unit**3 @ self._left)).real + fourth * np.abs(factor) ** 2
            )
            noise += np.maximum(around, 0.0) / kinds / np.maximum(1 - fourth, 0.1)
            profile += unit**2 / kinds
        free = self.free - kinds
        rounding = _ROUNDING**2 * self.power()
        chance = _log_chance(explained, np.maximum(self.power() - explained, rounding), kinds, free)
        around_free = np.minimum(1 / np.maximum(np.sum(profile**2, axis=1, keepdims=True), 1 / free) - 1, free)
        local = _log_chance(explained, np.maximum(noise * around_free, rounding), kinds, np.maximum(around_free, 0.5))
        return np.maximum(chance, local), explained

    def _unit(self, each: Floats, before: Sequence[Floats]) -> Floats:
        """Orthogonal to the basis and to these, of length 1, (candidates, moments); 0 where nothing is left."""
        length = np.linalg.norm(each, axis=1, keepdims=True)
        for _ in (0, 1):  # twice is enough for orthogonality to rounding
            each = each - (each @ self._basis) @ self._basis.T
            for other in before:
                each = each - np.sum(each * other, axis=1, keepdims=True) * other
        size = np.linalg.norm(each, axis=1, keepdims=True)
        return np.asarray(np.where(size > 1e-6 * length, each / np.where(size > 0, size, 1.0), 0.0))


def _log_chance(explained: Floats, left: Floats, functions: int, free: Floats | float) -> Floats:
    """ln of the probability that F(2·functions, 2·free) is as large, for at most three functions."""
    total = explained + left
    some = total > 0  # a response of zero changes by nothing
    x = np.divide(explained, total, out=np.zeros_like(total), where=some).clip(0.0, 1.0)
    rest = np.divide(left, total, out=np.ones_like(total), where=some)
    terms = [np.ones_like(x), free * x, free * (free + 1) / 2 * x**2][:functions]
    return np.asarray(free * np.log(rest) + np.log(np.sum(terms, axis=0)))


def _families(share: Floats) -> Iterator[tuple[float, list[Component]]]:
    """Components that are tried, in families with their part of the false alarms."""
    yield 0.25, [Component("trend", 1)]
    yield 0.125, [Component("trend", 3)]
    # What settles within a group is seen in one of them only, and its beginning is not known.
    yield 0.125, [Component("settling", tau) for tau in _TAUS if tau * len(share) >= 1]
    yield 0.25, [Component("step", float(x)) for x in (share[1:-2] + share[2:-1]) / 2]
    cycles = np.arange(2, len(share) + 1) / 2
    yield 0.25, [Component("periodic", float(1 / c)) for c in cycles if c <= len(share) / 2]


def components_of(series: Sequence[GroupSeries]) -> list[Component]:
    """The components that noise does not explain, the clearest first.

    Each step tries all families on what the components before leave. A candidate explains power at each line, of which
    the ratio to what remains is F without a change. Its probabilities are combined over the lines by Fisher's method,
    and the smallest by Bonferroni; both are divided among the candidates. Once there is a change, a further component
    needs less evidence: it gives the change its form. A periodic one is also compared with the
    power at its neighbours, because the noise of windows one after the other is not quite white.
    """
    left = [_Remainder(each) for each in series if len(each.share) >= GROUPS_MIN]
    lines = sum(len(each.at) for each in left)
    chosen: list[Component] = []
    if not left:
        return chosen
    longest = max(left, key=lambda each: len(each.share)).share
    while len(chosen) < _COMPONENTS_MAX and (best := _best(left, longest, lines, first=not chosen)):
        chosen.append(best)
        for each in left:
            each.remove(best)
    return chosen


def log_chances(series: GroupSeries, components: Sequence[Component]) -> Floats:
    """ln of the probability by noise of what the components explain at each line, (lines,)."""
    left = _Remainder(series)
    before = left.power()
    for component in components:
        left.remove(component)
    functions = sum(len(component.functions(series.share)) for component in components)
    power = left.power()
    # More functions than three are tested as three, which is too careful by little.
    return _log_chance(np.maximum(before - power, 0.0), power, min(functions, 3), max(left.free, 1))


def _best(left: Sequence[_Remainder], longest: Floats, lines: int, *, first: bool) -> Component | None:
    best, rarest = None, 0.0
    for part, candidates in _families(longest):
        scores = _scores(left, candidates) if candidates else None
        if scores is None:
            continue
        score = np.concatenate(scores, axis=1)
        chance = np.minimum(log_sum_exceeded(lines, score.sum(axis=1)), np.log(lines) - score.max(axis=1))
        chance += np.log(2 * len(candidates) / part / (FALSE_ALARM if first else _FURTHER))
        place = int(np.argmin(chance))
        if chance[place] < rarest:
            best, rarest = candidates[place], float(chance[place])
    return best if best is None else _refined(left, best, len(longest))


def _scores(left: Sequence[_Remainder], candidates: list[Component]) -> list[Floats] | None:
    """−ln of the probability of each candidate at each line, (candidates, lines) for each remainder."""
    scores = []
    for each in left:
        functions = np.stack([c.functions(each.share) for c in candidates], axis=1)
        # What explains most of the moments explains their noise, too.
        if 2 * (each.free - len(functions)) < len(each.share):
            return None
        chance, explained = each.log_chances(functions)
        if candidates[0].kind == "periodic" and len(candidates) > _REFINED:
            chance = np.maximum(chance, _beside(explained))
        scores.append(-chance)
    return scores


def _beside(explained: Floats) -> Floats:
    """ln of the probability of each frequency by the power at its neighbours; candidates are half a cycle apart."""
    places = np.arange(len(explained))[:, np.newaxis] + 2 * np.concatenate([-_BESIDE, _BESIDE])
    there = (places >= 0) & (places < len(explained))
    power = np.where(there[..., np.newaxis], explained[places.clip(0, len(explained) - 1)], 0.0).sum(axis=1)
    count = np.maximum(there.sum(axis=1), 1)[:, np.newaxis]
    x = explained / np.maximum(explained + power, np.finfo(float).tiny)
    return np.asarray(2 * count * np.log1p(-np.minimum(x, 1 - 1e-15)) + np.log1p(2 * count * x))


def _refined(left: Sequence[_Remainder], component: Component, moments: int) -> Component:
    """With the frequency or time constant at which it explains most, between the neighbours of the tried one."""
    if component.kind == "periodic":
        cycles = 1 / component.place + np.linspace(-0.5, 0.5, _REFINED)
        places = 1 / cycles[(cycles >= 0.75) & (cycles <= moments / 2)]
    elif component.kind == "settling":
        places = np.maximum(component.place * 2 ** np.linspace(-1, 1, _REFINED), 1 / moments)
    else:
        return component
    tried = [Component(component.kind, float(place)) for place in places]
    remaining = np.zeros(len(tried))
    for each in left:
        explained = each.log_chances(np.stack([c.functions(each.share) for c in tried], axis=1))[1]
        power = each.power()
        remaining += np.log(np.maximum(1 - explained / power, _ROUNDING)).sum(axis=1)
    return tried[int(np.argmin(remaining))]


@dataclass(frozen=True, eq=False)
class Course:
    """Fit of components to a series, by least squares.

    Attributes
    ----------
    factors
        Of the constant and of each function, (functions, lines).
    covariance
        Of the factors, for a variance of 1 in a window, (functions, functions).
    noise, scatter
        Variance of a window about the course and about the mean, (lines,).
    """

    components: tuple[Component, ...]
    factors: Complex
    covariance: Floats
    noise: Floats
    scatter: Floats

    @classmethod
    def of(cls, series: GroupSeries, components: Sequence[Component]) -> Course:
        functions = _functions(components, series.share) * np.sqrt(series.count)
        q, r = np.linalg.qr(functions.T)
        inverse = np.linalg.pinv(r)
        weighted = series.value * np.sqrt(series.count)[:, np.newaxis]
        rotated = q.T @ weighted
        floor = _ROUNDING**2 * np.sum(np.abs(weighted) ** 2, axis=0)
        left = np.sum(np.abs(weighted - q @ rotated) ** 2, axis=0) + floor
        mean = (series.count @ series.value) / series.count.sum()
        about = np.sum(series.count[:, np.newaxis] * np.abs(series.value - mean) ** 2, axis=0) + floor
        moments = len(series.share)
        return cls(
            tuple(components),
            inverse @ rotated,
            inverse @ inverse.T,
            left / max(moments - len(functions), 1),
            about / (moments - 1),
        )

    def value(self, share: Floats) -> Complex:
        """(moments, lines)."""
        return np.asarray(_functions(self.components, share).T @ self.factors)

    def variance(self, weights: Floats) -> Floats:
        """Of a sum of functions at moments with these factors, as `functions`, in windows' variances, (…)."""
        return np.asarray(np.einsum("...i,ij,...j->...", weights, self.covariance, weights))

    def functions(self, share: Floats) -> Floats:
        """(moments, functions)."""
        return _functions(self.components, share).T


def _functions(components: Sequence[Component], share: Floats) -> Floats:
    return np.concatenate([np.ones((1, len(share))), *(c.functions(share) for c in components)])
