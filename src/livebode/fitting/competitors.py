"""Competing models for one response: all that the lines cannot tell apart, and the average of their parameters."""

from __future__ import annotations

from collections.abc import Iterator, Set
from math import erf, exp, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.dataclass import dataclass
from livebode.fitting.extended import BEYOND, COUPLING, LAG, MODE, RESIDUAL
from livebode.fitting.family import NEAR_NYQUIST, Family, FamilyMember, FittedMember
from livebode.fitting.physical import DELAY
from livebode.fitting.problem import MeasuredRows, Problem
from livebode.fitting.rows import FittedRows, line_weights

WINDOW = 7.0
"""Difference of cost up to which a model takes part in the search and in the average: a weight of 3 % of the best."""

_LEVELS, _PARENTS = 6, 6
# Required decreases of −2·ln(likelihood). A machine with friction has it at motor and load: they have one price.
_FRICTION_PRICE = 6.0
_PRICE = {DELAY: 4.0, LAG: 5.0, RESIDUAL: 5.0, MODE: 2.0, COUPLING: 4.0}
_HELD_PRICE = 6.0  # of a mode above the lines whose frequency is held
_DAMPING_PRICE = 4.0  # of a mode whose damping is free
_APART = 0.15  # of a frequency of the model itself: a nearer further mode would change the model's own mode
_MODES, _MODES_TRIED = 40, 2
_LOWER = 1.0  # of −2·ln(likelihood): a difference that is no rounding of the search
_LOWEST, _HIGHEST = 0.7, BEYOND  # of the lowest and of the highest line, where a further mode is looked for
_DAMPINGS = (0.02, 0.1)
_EARLIEST_TICKS = 2.0  # two signals of one tick may be logged so far apart, in either order
_LAG_S = 1e-4  # start
_UNCERTAIN = 0.5  # of a logarithm: a parameter that the lines do not show


Start = tuple[FamilyMember, Floats, float]
"""A model with start values and a start of ε."""


@dataclass(frozen=True, eq=False)
class Competitor:
    """A member of the family with its distribution: mean and covariance of all parameters of the family.

    `cost` is −2·ln(likelihood) plus the prices of the effects, and less where a bound cuts the distribution.
    """

    of: FittedMember
    mean: Floats
    covariance: Floats
    cost: float


@dataclass(frozen=True)
class AllowedChanges:
    """Permitted changes by competitors: no parameter fixed by the user, and a delay only if it is not free already."""

    fixed: Set[str]
    delay: bool
    top_hz: float


@dataclass(frozen=True, eq=False)
class Competition:
    """The specified model, the models that the lines do not tell apart, the best first, and their weights."""

    family: Family
    first: FittedMember
    every: tuple[Competitor, ...]
    weight: Floats

    def share(self, effect: str) -> float:
        """Weight of all models that have an effect."""
        return float(sum(w for w, c in zip(self.weight, self.every) if effect in c.of.member.effects))


def compete(
    problem: Problem, late: bool, fitted: FittedRows, measured: MeasuredRows, noise_dof: Floats, allowed: AllowedChanges
) -> Competition:
    """All models within a window of evidence (Madigan and Raftery, J. Amer. Stat. Assoc. 89, 1994).

    From the specified model (`late`: with its delay), every effect is added to and removed from every model in the
    window, and delay and lag replace each other, until no model in it is new. A model is fitted again from a neighbour
    that fits better: its first search may have ended in another minimum.
    """
    family = Family(problem, allowed.fixed, allowed.delay, allowed.top_hz, fitted.ended[0])
    start = FamilyMember(frozenset({DELAY} if late and allowed.delay else ()))
    values = family.without(family.padded(fitted.ended[0]), start)
    first = family.fitted([(start, values, float(fitted.epsilon[0]))], measured, noise_dof)[0]
    search = _Search(family, first, measured)
    for _ in range(_LEVELS):
        if not (tried := search.starts()):
            break
        search.add(family.fitted(tried, measured, noise_dof))
    return _weighed(family, first, list(search.known.values()), measured, noise_dof)


class _Search:
    """The models that are known, and those to be fitted next."""

    def __init__(self, family: Family, first: FittedMember, measured: MeasuredRows) -> None:
        self.known = {first.member: first}
        self._family, self._measured = family, measured
        self._lines = int(np.count_nonzero(measured.use))
        self._done: set[FamilyMember] = set()
        self._begun: dict[FamilyMember, float] = {}  # again, from a model of this misfit

    def starts(self) -> list[Start]:
        """Neighbours of the best models whose neighbours were not tried yet."""
        order = sorted(self.known.values(), key=lambda one: cost(one, self._lines))
        limit = cost(order[0], self._lines) + WINDOW
        parents = [one for one in order if one.member not in self._done and cost(one, self._lines) < limit][:_PARENTS]
        self._done |= {one.member for one in parents}
        return [
            start
            for parent in parents
            for start in _neighbours(self._family, parent, self._measured)
            if 2 * self._lines > np.count_nonzero(self._family.free(start[0]))
            and self._promises(start[0], parent, limit)
        ]

    def _promises(self, member: FamilyMember, parent: FittedMember, limit: float) -> bool:
        """Whether the model is new, or its search may have ended in a minimum from which this parent leads to a lower
        one, with a cost below the limit."""
        if member not in self.known:
            return True
        highest = limit - price(member, self._lines)
        now = self.known[member].misfit
        if now < highest and parent.member.effects >= member.effects:
            return False  # it has fewer parameters, and is in the window
        if parent.misfit > min(highest, min(now, self._begun.get(member, np.inf)) - _LOWER):
            return False
        self._begun[member] = parent.misfit
        return True

    def add(self, fitted: list[FittedMember]) -> None:
        """Models with a possible result, where they are new or better than before."""
        for one in fitted:
            before = self.known.get(one.member)
            if _possible(self._family, one) and (before is None or one.misfit < before.misfit):
                self.known[one.member] = one


def cost(of: FittedMember, lines: int) -> float:
    """−2·ln(likelihood) plus the prices of the effects."""
    return of.misfit + price(of.member, lines)


def price(member: FamilyMember, lines: int) -> float:
    """Decrease of −2·ln(likelihood) that the effects of a model must bring."""
    frictions = len(member.effects) - sum(name in _PRICE for name in member.effects)
    total = sum(_PRICE.get(name, 0.0) for name in member.effects) + _FRICTION_PRICE * (frictions > 0)
    if MODE in member.effects and member.held_at:
        total += _HELD_PRICE - _PRICE[MODE]
    elif MODE in member.effects:
        # The search is over all lines, so the largest of as many random values is found.
        total += 2 * float(np.log(lines)) + _DAMPING_PRICE * member.damped
    return total


def _neighbours(family: Family, of: FittedMember, measured: MeasuredRows) -> Iterator[Start]:
    """Each model that differs by one effect, with its start values and its start of ε."""
    effects, damped, held_at = of.member
    for name in family.effects:
        if name in effects:
            less = of.member._replace(effects=effects - {name})
            if name == MODE:
                less = FamilyMember(effects - {MODE, COUPLING})
            yield less, _without(family, of, less, name), of.epsilon
        elif name == MODE and RESIDUAL not in effects:
            more = FamilyMember(effects | {MODE})
            yield from ((more, family.without(start, more), of.epsilon) for start in _mode_starts(family, of, measured))
        elif name != MODE and not (name == RESIDUAL and held_at) and not (name == COUPLING and MODE not in effects):
            yield of.member._replace(effects=effects | {name}), _with(family, of, name), of.epsilon
    for place in family.held_at if RESIDUAL in effects and MODE not in effects else ():
        other = FamilyMember(effects - {RESIDUAL} | {MODE}, held_at=place)
        yield other, family.without(of.values, other), of.epsilon
    for name, instead in ((DELAY, LAG), (LAG, DELAY)):
        if name in effects and instead in family.effects and instead not in effects:
            other = of.member._replace(effects=effects - {name} | {instead})
            yield other, _without(family, of, other, name), of.epsilon
    if MODE in effects and not held_at:
        other = of.member._replace(damped=not damped)
        yield other, family.without(of.values, other), of.epsilon


def _with(family: Family, of: FittedMember, name: str) -> Floats:
    """Values with one more effect; a lag is half of the delay that it replaces."""
    values = of.values.copy()
    if name in family.base.frictions:
        values[family.index(name)] = family.model.shown(values, family.problem.grid)[family.index(name)]
    elif name == LAG:
        lag = family.index("lag")
        values[lag] = _LAG_S
        if DELAY in of.member.effects and (late := family.index(DELAY)) and values[late] > 2 * _LAG_S:
            values[lag] = values[late] / 2
            values[late] -= values[lag]
    return values


def _without(family: Family, of: FittedMember, less: FamilyMember, name: str) -> Floats:
    """Values without an effect; of delay and lag the other one takes it over."""
    values = family.without(of.values, less)
    other = {DELAY: LAG, LAG: DELAY}.get(name)
    if other in less.effects:
        own, column = family.index(name), family.index(other)
        values[column] = max(of.values[column] + of.values[own], _LAG_S if other == LAG else -np.inf)
    return values


def _mode_starts(family: Family, of: FittedMember, measured: MeasuredRows) -> Floats:
    """Values with a further mode where it would lower chi² most to first order, (starts, parameters).

    For each frequency and damping the gain is the only new parameter, and linear: least squares together with the
    slopes of the fit give it directly.
    """
    grid, solution = family.problem.grid, of.solution
    weight = line_weights(measured, np.abs(solution.response), np.array([of.epsilon]))
    weight = np.where(measured.use, weight, 0.0)
    columns = of.free[family.problem.free]
    slope = _stacked((weight[..., np.newaxis] * solution.slope)[0][:, columns])
    residual = _stacked((weight * np.where(measured.use, measured.value - solution.response, 0.0))[0])
    basis = np.linalg.qr(slope / np.maximum(np.linalg.norm(slope, axis=0), 1e-300))[0]
    high = min(_HIGHEST * grid.frequency_hz.max(), NEAR_NYQUIST * grid.rate_hz / 2)
    frequency = np.geomspace(_LOWEST * grid.frequency_hz.min(), high, _MODES)
    modes = np.repeat(of.values[np.newaxis], _MODES * len(_DAMPINGS), axis=0)
    modes[:, family.index("mode")] = np.tile(frequency, len(_DAMPINGS))
    modes[:, family.index("mode_damping")] = np.repeat(_DAMPINGS, _MODES)
    gain = family.index("mode_gain")
    unit = family.model.shown(modes, grid)[:, gain]
    modes[:, gain] = unit
    column = _stacked((weight * (family.model.at(modes, grid) - solution.response)).T)
    column = column - basis @ (basis.T @ column)
    power = np.sum(column**2, axis=0) + 1e-300
    share = residual @ column / power
    decrease = share**2 * power
    decrease[(share < 0) & family.model.parameters[gain].one_sided] = 0.0
    decrease[_near_own(family, of.values, modes[:, family.index("mode")])] = 0.0
    chosen = np.argsort(-decrease)[:_MODES_TRIED]
    modes[:, gain] = unit * share
    return modes[chosen]


def _near_own(family: Family, values: Floats, frequency_hz: Floats) -> NDArray[np.bool_]:
    """Frequencies near a resonance or antiresonance of the specified model."""
    base = family.base
    transfer = base.continuous(values[: len(base.names)])
    own_hz = np.abs(np.concatenate([transfer.poles(), transfer.zeros()])) / (2 * np.pi)
    return np.asarray((np.abs(np.log(np.divide.outer(frequency_hz, own_hz + 1e-300))) < _APART).any(axis=-1))


def _stacked(values: Complex) -> Floats:
    """Real above imaginary parts."""
    return np.concatenate([values.real, values.imag])


def _possible(family: Family, of: FittedMember) -> bool:
    """Whether its mode is separate from the model's own, and a free delay, if any, is one that logging can cause."""
    if not np.isfinite(of.misfit):
        return False
    if MODE in of.member.effects and _near_own(family, of.values, of.values[family.index("mode")]).any():
        return False
    if DELAY not in of.member.effects:
        return True
    return bool(of.values[family.index(DELAY)] * family.problem.grid.rate_hz >= -_EARLIEST_TICKS)


def _weighed(
    family: Family, first: FittedMember, every: list[FittedMember], measured: MeasuredRows, noise_dof: Floats
) -> Competition:
    """The models whose parameters the lines show, with their weights e^(−cost/2)."""
    lines = int(np.count_nonzero(measured.use))
    found: list[Competitor] = []
    least = np.inf  # of those whose parameters the lines show
    for one in sorted(every, key=lambda one: cost(one, lines)):
        if not cost(one, lines) < least + WINDOW:
            break
        if (competitor := _distribution(family, one, measured, noise_dof, lines)) is not None:
            least = min(least, cost(one, lines))
            found.append(competitor)
    found.sort(key=lambda c: c.cost)
    if not found:
        return Competition(family, first, (), np.zeros(0))
    weight = np.exp(-(np.array([c.cost for c in found]) - found[0].cost) / 2)
    return Competition(family, first, tuple(found), weight / weight.sum())


def _distribution(
    family: Family, of: FittedMember, measured: MeasuredRows, noise_dof: Floats, lines: int
) -> Competitor | None:
    """None if the lines do not determine a parameter."""
    step, small = family.normal(of, measured, noise_dof)
    relative = family.problem.relative()[of.free[family.problem.free]]
    if not np.isfinite(small).all() or (np.sqrt(np.diag(small))[relative] > _UNCERTAIN).any():
        return None
    columns = of.free[family.problem.free]
    outward = family.problem.outward_slopes(of.values[np.newaxis])[0][columns]
    parameters = [p for p, free in zip(family.model.parameters, of.free) if free]
    # Only a bound makes the step to the minimum without bounds large; of a logarithm it is then not exact.
    step = np.where(relative, step.clip(-_UNCERTAIN, _UNCERTAIN), step)
    mean, matrix = of.values[of.free] + outward * step, small * np.outer(outward, outward)
    evidence = cost(of, lines)
    for i, parameter in enumerate(parameters):
        if parameter.one_sided:
            mean, matrix, factor = _not_negative(mean, matrix, i)
            evidence -= 2 * np.log(factor)
    whole, values = np.zeros((len(of.values),) * 2), of.values.copy()
    free = np.flatnonzero(of.free)
    whole[np.ix_(free, free)], values[free] = matrix, mean
    return Competitor(of, values, whole, evidence)


def _not_negative(mean: Floats, matrix: Floats, index: int) -> tuple[Floats, Floats, float]:
    """Mean and covariance of a normal distribution in which one parameter is not negative, and what remains of its
    evidence, compared with the value at the best permitted point."""
    sigma = sqrt(matrix[index, index])
    if not sigma > 0 or mean[index] > 6 * sigma:
        return mean, matrix, 1.0
    distance = max(float(mean[index]) / sigma, -6.0)
    inside = 0.5 * (1 + erf(distance / sqrt(2)))
    ratio = exp(-(distance**2) / 2) / sqrt(2 * pi) / inside
    shift, less = sigma * (ratio + distance - mean[index] / sigma), ratio * (ratio + distance)
    along = matrix[:, index] / sigma**2
    factor = inside * exp(min(distance, 0.0) ** 2 / 2)
    return mean + along * shift, matrix - np.outer(along, along) * sigma**2 * less, factor
