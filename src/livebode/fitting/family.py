"""Family: the models that differ from a specified one by any of some effects, many of them fitted at once."""

from __future__ import annotations

from collections.abc import Iterable, Set
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.dataclass import dataclass
from livebode.fitting.chains import TwoMass
from livebode.fitting.extended import BEYOND, COUPLING, LAG, MODE, RESIDUAL, START_DAMPING, ExtendedModel
from livebode.fitting.physical import DELAY, PhysicalModel
from livebode.fitting.problem import MeasuredRows, Problem, Solution
from livebode.fitting.rows import covariance, line_weights
from livebode.fitting.weights import misfit, own_epsilon

NEAR_NYQUIST = 0.9
"""Of half the rate: a mode that is closer and its alias look alike."""

_NO_LAG_S = 1e-14  # a lag whose pole no rate can show
_NO_FRICTION = 1e-7  # of the smallest that the lines show
_ROUNDS, _REWEIGHTED, _SAME = (4, 4, 12), 3, 0.03
_HELD_AT = (1.2, 1.5, 2.0)  # of the highest line: modes of which the lines show the compliance, and not the frequency
_PARTS = {
    LAG: ("lag",),
    RESIDUAL: ("residual_compliance",),
    MODE: ("mode", "mode_damping", "mode_gain"),
    COUPLING: ("mode_coupling",),
}
_NOT_THERE = {
    "lag": _NO_LAG_S,
    "residual_compliance": 0.0,
    "mode_gain": 0.0,
    "mode_damping": START_DAMPING,
    "mode_coupling": 0.0,
}


def _row(of: Solution, i: int) -> Solution:
    row = slice(i, i + 1)
    return Solution(of.values[row], of.response[row], of.slope[row], of.settled[row])


class FamilyMember(NamedTuple):
    """A model of the family: its effects, whether the damping of its further mode is free, and the frequency at which
    that mode is held, over the highest line; zero where it is fitted."""

    effects: frozenset[str]
    damped: bool = False
    held_at: float = 0.0


@dataclass(frozen=True, eq=False)
class FittedMember:
    """A member fitted to one row.

    Attributes
    ----------
    values, free
        Values and which are fitted, of all parameters of the family.
    dof, epsilon, misfit
        As of `FittedRows`, and −2·ln(likelihood).
    solution
        Of one row, with the slopes by all free parameters of the family.
    """

    member: FamilyMember
    values: Floats
    free: NDArray[np.bool_]
    dof: float
    epsilon: float
    misfit: float
    solution: Solution


class Family:
    """All models that have the specified one and any of some effects.

    Parameters
    ----------
    problem
        The specified model.
    fixed
        Parameters that no member frees.
    delay
        Whether a delay is an effect.
    top_hz
        Highest line.
    values
        Those of the specified model, about which others are searched.
    """

    def __init__(self, problem: Problem, fixed: Set[str], delay: bool, top_hz: float, values: Floats) -> None:
        base = problem.model
        extras = [LAG]
        if hasattr(base, "output"):
            nyquist = NEAR_NYQUIST * problem.grid.rate_hz / 2
            extras += [*([RESIDUAL] if BEYOND * top_hz < nyquist else []), MODE]
        if isinstance(base, TwoMass):
            extras.append(COUPLING)
        model = ExtendedModel(base, tuple(extras), top_hz)
        own = [name for name in (DELAY, *base.frictions) if name in problem.held and name not in fixed]
        own = [name for name in own if name != DELAY or delay]
        self.base, self.extras, self.top_hz = base, tuple(extras), top_hz
        self.model: PhysicalModel = model
        self.problem = problem.variant(model, free=own)
        self.effects = (*own, *extras)
        self.held_at = tuple(
            x for x in _HELD_AT if MODE in extras and x * top_hz < NEAR_NYQUIST * problem.grid.rate_hz / 2
        )
        self.specified = problem.held
        self.names = model.names
        self._always = np.array([name in base.names and name not in problem.held for name in self.names])
        # Members are computed together, and without any friction they would have one more integrator than others.
        shown = dict(zip(base.names, base.shown(values, problem.grid)))
        self._rest = problem.held | _NOT_THERE | {n: _NO_FRICTION * shown[n] for n in own if n in base.frictions}

    def index(self, name: str) -> int:
        return self.names.index(name)

    def free(self, member: FamilyMember) -> NDArray[np.bool_]:
        """Which parameters a member fits."""
        free = self._always.copy()
        for effect in member.effects:
            for name in _PARTS.get(effect, (effect,)):
                free[self.index(name)] = True
        for name, fitted in (("mode_damping", member.damped), ("mode", not member.held_at)):
            if MODE in member.effects:
                free[self.index(name)] = fitted
        return free

    def without(self, values: Floats, member: FamilyMember) -> Floats:
        """Values with those parameters at rest that this member does not have."""
        values = np.array(values)
        for effect in self.effects:
            for name in _PARTS.get(effect, (effect,)) if effect not in member.effects else ():
                if name in self._rest:
                    values[..., self.index(name)] = self._rest[name]
        if not member.damped and MODE in self.effects:
            values[..., self.index("mode_damping")] = START_DAMPING
        if member.held_at:
            values[..., self.index("mode")] = member.held_at * self.top_hz
        return values

    def padded(self, values: Floats) -> Floats:
        """Values of the specified model as those of the family."""
        others = [p.start for p in self.model.parameters[len(values) :]]
        return np.concatenate([values, others])

    def fitted(
        self,
        tried: Iterable[tuple[FamilyMember, Floats, float]],
        measured: MeasuredRows,
        noise_dof: Floats,
    ) -> list[FittedMember]:
        """Members fitted to one row, each from its start values and a start of ε, all in one search."""
        members, starts, eps = (list(part) for part in zip(*tried))
        free = np.array([self.free(member) for member in members])
        rows, values, epsilon = measured.repeated(len(members)), np.array(starts), np.array(eps)
        resting = ~free[:, self.problem.free]
        dof = 2.0 * np.count_nonzero(measured.use) - np.count_nonzero(free, axis=1)
        size = np.repeat(np.where(measured.use, np.abs(measured.value), 0.0), len(members), axis=0)
        solution = self._solved(rows, line_weights(rows, size, epsilon), values, resting)
        for _ in range(_REWEIGHTED):
            new = own_epsilon(rows, solution.response, dof)
            same = np.abs(new - epsilon) <= _SAME * new
            if same.all():
                break
            epsilon = np.where(same, epsilon, new)
            turn = np.flatnonzero(~same)
            weight = line_weights(rows[turn], np.abs(solution.response[turn]), epsilon[turn])
            again = self._solved(rows[turn], weight, solution.values[turn], resting[turn])
            for kept, other in zip(solution, again):
                kept[turn] = other
        cost = misfit(rows, solution.response, dof, np.repeat(noise_dof, len(members)))
        return [
            FittedMember(
                member, solution.values[i], free[i], float(dof[i]), float(epsilon[i]),
                float(cost[i]) if solution.settled[i] and np.isfinite(cost[i]) else np.inf,
                _row(solution, i),
            )
            for i, member in enumerate(members)
        ]  # fmt: skip

    def _solved(self, measured: MeasuredRows, weight: Floats, start: Floats, resting: NDArray[np.bool_]) -> Solution:
        """Least squares; rows that take longer continue without the others."""
        solution, _ = self.problem.solve(measured, weight, start, _ROUNDS[0], resting)
        for rounds in _ROUNDS[1:]:
            late = np.flatnonzero(~solution.settled)
            if not late.size:
                break
            again, _ = self.problem.solve(measured[late], weight[late], solution.values[late], rounds, resting[late])
            for kept, other in zip(solution, again):
                kept[late] = other
        return solution

    def normal(self, of: FittedMember, measured: MeasuredRows, noise_dof: Floats) -> tuple[Floats, Floats]:
        """Step to the minimum without bounds, and covariance, in the coordinates of the member's free parameters.

        The step is zero up to the tolerance of the search but where a parameter is at its bound.
        """
        solution, columns = of.solution, of.free[self.problem.free]
        own = solution._replace(slope=solution.slope[..., columns])
        eps = np.array([of.epsilon])
        matrix = covariance(measured, own, eps, noise_dof)[0]
        weight = np.where(measured.use, line_weights(measured, np.abs(own.response), eps), 0.0)[0]
        residual = np.where(measured.use, measured.value - own.response, 0.0)[0]
        pull = ((weight**2 * residual)[:, np.newaxis] * own.slope[0].conj()).real.sum(axis=0)
        return matrix @ pull, matrix
