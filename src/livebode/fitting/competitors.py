"""Competing models for one response: extended models, the adequate one that explains it best, and their distances."""

from __future__ import annotations

from collections.abc import Iterator, Set
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import OK
from livebode.dataclass import dataclass
from livebode.fitting.physical import DELAY, EvaluationGrid, Parameter, PhysicalModel, plus, times
from livebode.fitting.problem import MeasuredRows, Problem
from livebode.fitting.rows import FittedRows, fit_rows
from livebode.fitting.weights import misfit, weights
from livebode.language import Message

LAG, RESIDUAL, MODE = "lag", "residual compliance", "further mode"
BEYOND = 3.0
"""Frequency of the mode that represents all modes above the band, over the highest line."""

START_DAMPING = 0.03
"""Damping ratio of a further mode whose damping the lines do not show."""

_BEYOND_DAMPING = 0.05  # of a mode above the band, of which only the compliance shows
_SHOWN = 0.1  # of |G| at the highest line
WORDS = {
    "delay": Message("a delay"),
    "B": Message("viscous friction at the motor (B)"),
    "BL": Message("viscous friction at the load (BL)"),
    LAG: Message("a lag"),
    RESIDUAL: Message("the compliance of modes above the band"),
    MODE: Message("a further mode"),
}
"""Effects that a model may lack."""


@dataclass(frozen=True)
class ExtendedModel(PhysicalModel):
    """A model G and some of: a lag behind it, G/(1 + s·lag); a further mode, G + mode_gain·s/(s² + 2ζωs + ω²); the
    compliance of modes above the band, the same with ω at three times the highest line.

    The last two are over s for a position. At the motor their gains are not negative. Its own parameters keep their
    meaning: rigid body and first mode (or modes), which those of a chain with one more mass would not.

    Parameters
    ----------
    base
        The model.
    extras
        Of "lag", "residual compliance", "further mode".
    top_hz
        Highest line.

    Examples
    --------
    >>> from livebode.fitting import TwoMass
    >>> ExtendedModel(TwoMass(), ("lag",), 120.0).names[-2:]
    ('delay', 'lag')
    """

    base: PhysicalModel
    extras: tuple[str, ...]
    top_hz: float

    @property
    def name(self) -> str:  # type: ignore[override]
        extras = Message.conjunction(WORDS[extra] for extra in self.extras)
        return Message("{model} with {extras}", model=self.base.name, extras=extras)

    @property
    def frictions(self) -> tuple[str, ...]:  # type: ignore[override]
        return self.base.frictions

    @property
    def parameters(self) -> tuple[Parameter, ...]:  # type: ignore[override]
        least = 0.0 if getattr(self.base, "side", "motor") == "motor" else -inf
        own_gain: str = getattr(self.base, "gain_unit", "")
        effort = ("m", "N") if getattr(self.base, "linear", False) else ("rad", "(N m)")  # of masses in SI units
        gain = own_gain or f"{effort[0]}/s²/{effort[1]}"
        compliance = f"{gain} s²" if own_gain else f"{effort[0]}/{effort[1]}"
        own = {
            LAG: (Parameter("lag", "s", 1e-4, 1e-6, 1.0),),
            RESIDUAL: (Parameter("residual_compliance", compliance, 0.0, least, inf),),
            MODE: (
                Parameter("mode", "Hz", 1.5 * self.top_hz, 1e-4, 1e6),
                Parameter("mode_damping", "", START_DAMPING, 1e-6, 2.0),
                Parameter("mode_gain", gain, 0.0, least, inf),
            ),
        }
        return (*self.base.parameters, *(p for extra in self.extras for p in own[extra]))

    def transfer(self, *parameters: Any) -> tuple[list[Any], list[Any]]:
        own = [p.name for p in self.parameters[len(self.base.parameters) :]]
        values = dict(zip(own, parameters[len(parameters) - len(own) :]))
        above, below = (list(part) for part in self.base.transfer(*parameters[: len(parameters) - len(own)]))
        for omega, damping, gain in self._modes(values):
            mode = [1.0, 2 * damping * omega, omega**2]
            moved = [gain, 0.0] if getattr(self.base, "output", "velocity") == "velocity" else [gain]
            above, below = plus(times(above, mode), times(moved, below)), times(below, mode)
        if LAG in self.extras:
            below = times([values["lag"], 1.0], below)
        return above, below

    def _modes(self, values: dict[str, Any]) -> list[tuple[Any, Any, Any]]:
        """ω, ζ and gain of each that is added."""
        modes: list[tuple[Any, Any, Any]] = []
        if RESIDUAL in self.extras:
            omega = 2 * np.pi * BEYOND * self.top_hz
            modes.append((omega, _BEYOND_DAMPING, values["residual_compliance"] * omega**2))
        if MODE in self.extras:
            modes.append((2 * np.pi * values["mode"], values["mode_damping"], values["mode_gain"]))
        return modes

    @property
    def derived_names(self) -> tuple[str, ...]:
        return self.base.derived_names

    @property
    def derived_units(self) -> tuple[str, ...]:
        return self.base.derived_units

    def derived(self, values: Floats) -> Floats:
        return self.base.derived(values[..., : len(self.base.names)])

    def shown(self, values: Floats, grid: EvaluationGrid) -> Floats:
        own = len(self.base.names)
        visible = np.concatenate([self.base.shown(values[..., :own], grid), values[..., own:]], axis=-1)
        top = grid._replace(frequency_hz=np.array([self.top_hz]))
        position = 1 if getattr(self.base, "output", "velocity") == "velocity" else 0
        size = _SHOWN * np.abs(self.base.at(values[..., :own], top)[..., 0]) / (2 * np.pi * self.top_hz) ** position
        for name, scale in (("residual_compliance", 1.0), ("mode_gain", None)):
            if name in self.names:
                square = scale or (2 * np.pi * values[..., self.names.index("mode")]) ** 2
                visible[..., self.names.index(name)] = size * square
        return visible

    def starts(self, value: Complex, weight: Floats, grid: EvaluationGrid) -> Floats:
        first = self.base.starts(value, weight, grid)
        added = np.array([p.start for p in self.parameters[len(self.base.parameters) :]])
        return self.shown(
            np.concatenate([first, np.broadcast_to(added, (*first.shape[:-1], added.size))], axis=-1), grid
        )


_TAKEN = 3  # at most
_FRICTION_PRICE = 2.5  # required decrease of −2·ln(likelihood): 1.6 sigma, because every machine has some
_PRICE = {DELAY: 4.0, LAG: 5.0, RESIDUAL: 5.0, MODE: 2.0}
_DAMPING_PRICE = 4.0  # of a mode whose damping is free
_APART = 0.15  # of a frequency of the model itself: a nearer further mode would change the model's own mode
_MODES, _MODES_TRIED = 40, 3
_LOWEST, _HIGHEST = 0.7, BEYOND  # of the lowest and of the highest line, where a further mode is looked for
_NEAR_NYQUIST = 0.9  # closer to half the rate, a mode and its alias look alike
_DAMPINGS = (0.02, 0.1)
_EARLIEST_TICKS = 2.0  # two signals of one tick may be logged so far apart, in either order


@dataclass(frozen=True, eq=False)
class Competitor:
    """One model, its fit of one row, and its cost: −2·ln(likelihood) plus the penalty for its additions.

    Attributes
    ----------
    taken
        Additions to the specified model, in the order in which they were made.
    """

    problem: Problem
    fitted: FittedRows
    cost: float
    taken: tuple[str, ...]


@dataclass(frozen=True)
class AllowedChanges:
    """Permitted changes by competitors: no parameter fixed by the user, and a delay only if it is not free already."""

    fixed: Set[str]
    delay: bool
    top_hz: float


def compete(start: Competitor, measured: MeasuredRows, noise_dof: Floats, allowed: AllowedChanges) -> list[Competitor]:
    """The model that explains one row best, then all others that were fitted.

    Starting with the specified model, the best of all models that differ by one step is selected as long as the cost
    decreases, at most three times; an earlier addition is removed again where this reduces the cost.
    """
    every, best = [start], start
    for _ in range(_TAKEN):
        rivals = list(_rivals(best, measured, noise_dof, allowed))
        every += rivals
        better = min([best, *rivals], key=lambda c: c.cost)
        if better is best:
            break
        best = better
        less = list(_less(best, measured, noise_dof))
        every += less
        best = min([best, *less], key=lambda c: c.cost)
    return [best, *(c for c in every if c is not best)]


def competitor(
    problem: Problem, measured: MeasuredRows, noise_dof: Floats, fitted: FittedRows, taken: tuple[str, ...] = ()
) -> Competitor:
    """A fit with its cost."""
    price = sum(_PRICE.get(name, _FRICTION_PRICE) for name in taken)
    if MODE in taken:
        # The search is over all lines, so the largest of as many random values is found.
        price += 2 * float(np.log(np.count_nonzero(measured.use)))
        price += _DAMPING_PRICE * ("mode_damping" not in problem.held)
    return Competitor(
        problem, fitted, float(misfit(measured, fitted.response, fitted.dof, noise_dof)[0]) + price, taken
    )


def mixed(every: list[Competitor]) -> Floats:
    """Covariance (parameters, parameters) of the first one's values that includes the choice of the model.

    Each model has the weight e^(−cost/2). It is the mean square error of this mixture about the best model's values:
    it includes the differences between the models and the larger variance of a wider model.
    """
    best = every[0]
    total = np.array(best.fitted.covariance[0])
    names = best.problem.model.names
    for other in every[1:]:
        common = [name for name in names if name in other.problem.model.names]
        mine, theirs = ([c.problem.model.names.index(n) for n in common] for c in (best, other))
        apart = other.fitted.values[0, theirs] - best.fitted.values[0, mine]
        more = other.fitted.covariance[0][np.ix_(theirs, theirs)] - best.fitted.covariance[0][np.ix_(mine, mine)]
        total[np.ix_(mine, mine)] += _weight(other, every) * (np.outer(apart, apart) + positive(more))
    return total


def _weight(of: Competitor, every: list[Competitor]) -> float:
    relative = np.exp(-np.array([c.cost - min(e.cost for e in every) for c in (of, *every)]) / 2)
    return float(relative[0] / relative[1:].sum())


def positive(matrix: Floats) -> Floats:
    """The positive semidefinite part of a symmetric matrix, in units in which its diagonal is one."""
    scale = np.sqrt(np.abs(np.diag(matrix)))
    scale = np.where(scale > 0, scale, 1.0)
    values, vectors = np.linalg.eigh(matrix / np.outer(scale, scale))
    return np.asarray((vectors * values.clip(0)) @ vectors.T * np.outer(scale, scale))


def _rivals(of: Competitor, measured: MeasuredRows, noise_dof: Floats, allowed: AllowedChanges) -> Iterator[Competitor]:
    for name, problem, starts in _steps(of, measured, allowed):
        if 2 * np.count_nonzero(measured.use) <= problem.size:
            continue
        begun = _best_start(problem, measured, of.fitted, starts)
        fitted = fit_rows(problem, measured, noise_dof, begun)
        if fitted.status[0] == OK and _possible(problem, fitted, allowed):
            yield competitor(problem, measured, noise_dof, fitted, (*of.taken, name))


def _less(of: Competitor, measured: MeasuredRows, noise_dof: Floats) -> Iterator[Competitor]:
    """The competitor without one of its earlier additions, such as a delay that approximated a mode."""
    for i, name in enumerate(of.taken[:-1]):
        if name in of.problem.model.names and name not in of.problem.held and name not in (LAG, MODE, RESIDUAL):
            problem = of.problem.variant(held={name: 0.0})
            fitted = fit_rows(problem, measured, noise_dof, problem.with_held(of.fitted.ended))
            if fitted.status[0] == OK:
                yield competitor(problem, measured, noise_dof, fitted, of.taken[:i] + of.taken[i + 1 :])


def _steps(of: Competitor, measured: MeasuredRows, allowed: AllowedChanges) -> Iterator[tuple[str, Problem, Floats]]:
    """Name, problem and starts (starts, parameters) of each."""
    problem, values = of.problem, of.fitted.ended[0]
    for name in (DELAY, *problem.model.frictions):
        if name in problem.held and name not in allowed.fixed:
            wider = problem.variant(free=(name,))
            begun = values if name == DELAY else _only(values, wider.model.shown(values, problem.grid), wider, name)
            yield name, wider, begun[np.newaxis]
    model = problem.model
    base, extras = (model.base, model.extras) if isinstance(model, ExtendedModel) else (model, ())
    if LAG not in extras:
        lagging = ExtendedModel(base, (*extras, LAG), allowed.top_hz)
        begun = _padded(lagging, problem.model, values)
        yield LAG, problem.variant(lagging), begun[np.newaxis]
        if allowed.delay and DELAY in model.names and DELAY not in problem.held:
            instead = problem.variant(lagging, held={DELAY: 0.0})
            late = max(float(values[model.names.index(DELAY)]), 1e-5)
            begun = instead.with_held(begun)
            begun[instead.model.names.index("lag")] = late
            yield LAG, instead, begun[np.newaxis]
    if hasattr(base, "output") and not {RESIDUAL, MODE} & set(extras):
        if BEYOND * allowed.top_hz < _NEAR_NYQUIST * problem.grid.rate_hz / 2:
            stiff = problem.variant(ExtendedModel(base, (*extras, RESIDUAL), allowed.top_hz))
            yield RESIDUAL, stiff, _padded(stiff.model, model, values)[np.newaxis]
        moving = problem.variant(ExtendedModel(base, (*extras, MODE), allowed.top_hz))
        starts = _mode_starts(moving, problem, measured, of.fitted)
        yield MODE, moving, starts
        # Far above the band its damping has no visible effect.
        undamped = moving.variant(held={"mode_damping": START_DAMPING})
        yield MODE, undamped, undamped.with_held(starts)


def _only(values: Floats, shown: Floats, problem: Problem, name: str) -> Floats:
    """`at` with one parameter at the smallest value that the lines show."""
    begun = problem.with_held(values)
    begun[problem.model.names.index(name)] = shown[problem.model.names.index(name)]
    return begun


def _padded(model: PhysicalModel, of: PhysicalModel, values: Floats) -> Floats:
    """Values of a model as those of one with more parameters, the new ones at their start."""
    known = dict(zip(of.names, values))
    return np.array([known.get(p.name, p.start) for p in model.parameters])


def _mode_starts(problem: Problem, of: Problem, measured: MeasuredRows, fitted: FittedRows) -> Floats:
    """Values with a further mode where it would lower chi² most to first order, (starts, parameters).

    For each frequency and damping the gain is the only new parameter, and linear: least squares together with the
    slopes of the fit give it directly.
    """
    grid = problem.grid
    weight = np.where(measured.use, weights(measured.sigma, np.abs(fitted.response), fitted.epsilon), 0.0)
    known, _ = of.solve(measured, weight, fitted.ended, 1)
    slope = _stacked((weight[..., np.newaxis] * known.slope)[0])
    residual = _stacked((weight * np.where(measured.use, measured.value - fitted.response, 0.0))[0])
    basis = np.linalg.qr(slope)[0]
    high = min(_HIGHEST * grid.frequency_hz.max(), _NEAR_NYQUIST * grid.rate_hz / 2)
    frequency = np.geomspace(_LOWEST * grid.frequency_hz.min(), high, _MODES)
    names = problem.model.names
    modes = np.repeat(_padded(problem.model, of.model, fitted.ended[0])[np.newaxis], _MODES * len(_DAMPINGS), axis=0)
    modes[:, names.index("mode")] = np.tile(frequency, len(_DAMPINGS))
    modes[:, names.index("mode_damping")] = np.repeat(_DAMPINGS, _MODES)
    unit = problem.model.shown(modes, grid)[:, names.index("mode_gain")]
    modes[:, names.index("mode_gain")] = unit
    column = _stacked((weight * (problem.model.at(modes, grid) - fitted.response)).T)
    column = column - basis @ (basis.T @ column)
    power = np.sum(column**2, axis=0) + 1e-300
    share = residual @ column / power
    gain = share**2 * power
    gain[(share < 0) & problem.model.parameters[-1].one_sided] = 0.0
    gain[_near_own(of, fitted.ended, modes[:, names.index("mode")])] = 0.0
    chosen = np.argsort(-gain)[:_MODES_TRIED]
    modes[:, names.index("mode_gain")] = unit * share
    return modes[chosen]


def _near_own(problem: Problem, values: Floats, frequency_hz: Floats) -> NDArray[np.bool_]:
    """Frequencies near a resonance or antiresonance of the model."""
    transfer = problem.model.continuous(values[0])
    own_hz = np.abs(np.concatenate([transfer.poles(), transfer.zeros()])) / (2 * np.pi)
    return np.asarray((np.abs(np.log(np.divide.outer(frequency_hz, own_hz + 1e-300))) < _APART).any(axis=1))


def _stacked(values: Complex) -> Floats:
    """Real above imaginary parts."""
    return np.concatenate([values.real, values.imag])


def _best_start(problem: Problem, measured: MeasuredRows, fitted: FittedRows, starts: Floats) -> Floats:
    """One row, from the start with the least cost."""
    if len(starts) == 1:
        return starts
    weight = weights(measured.sigma, np.abs(fitted.response), fitted.epsilon)
    every = measured.repeated(len(starts))
    solutions, cost = problem.solve(every, np.tile(weight, (len(starts), 1)), starts)
    return solutions.values[[int(np.argmin(cost))]]


def _possible(problem: Problem, fitted: FittedRows, allowed: AllowedChanges) -> bool:
    """Whether its mode is separate from the model's own, and a free delay, if any, is one that logging can cause."""
    model = problem.model
    if isinstance(model, ExtendedModel) and MODE in model.extras:
        own = len(model.base.names)
        base = Problem(model.base, problem.grid)
        if _near_own(base, fitted.values[:, :own], fitted.values[:, model.names.index("mode")]).any():
            return False
    if DELAY in problem.held or DELAY not in problem.model.names or not allowed.delay:
        return True
    late_s = fitted.values[0, problem.model.names.index(DELAY)]
    return bool(late_s * problem.grid.rate_hz >= -_EARLIEST_TICKS)
