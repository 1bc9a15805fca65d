"""fit: one model to one response, with parameters, derived quantities and verdicts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebode.core import COVERAGE, OK, FitError, Parameters, Response, Responses, not_installed, with_bound
from livebode.dataclass import dataclass
from livebode.fitting.averaging import Average, average, named_average, positive, specified
from livebode.fitting.competitors import AllowedChanges, Competition, Competitor, compete
from livebode.fitting.extended import MODE, WORDS
from livebode.fitting.family import Family, FittedMember
from livebode.fitting.fitter import Fitter
from livebode.fitting.mean import mean_response
from livebode.fitting.patterns import correlation, covariance, follows_pattern, pattern_size
from livebode.fitting.physical import DELAY, EvaluationGrid, Hold, PhysicalModel
from livebode.fitting.problem import MeasuredRows, Problem
from livebode.fitting.rows import NO_FIT, SENTENCES, FittedRows, fit_rows
from livebode.fitting.transfer import to_discrete
from livebode.fitting.weights import chi_squared, squares
from livebode.language import Message

EPSILON_LARGE = 0.1
"""Model error as a share of |G| from which bounds are not called 95 % bounds, whatever its pattern."""

_NOTABLE = 0.03  # of the weight of the best model: others count too little to be read
_DAMPINGS_APART = 2.5  # of a mode whose damping the lines do not show: 0.012 and 0.075, as usual in machines
_ROUNDING = 1e-9  # of a value: rounding gives a quantity of fixed values a bound of this size


@dataclass(frozen=True, eq=False)
class Fit:
    """A model fitted to one response; a Model by its `response`.

    Attributes
    ----------
    model
        The fitted model.
    parameters, derived
        One row each: the parameters, and the derived resonances, damping ratios and ratios.
    held
        Fixed parameters and their values.
    band_hz, lines
        Lowest and highest line used, and their number.
    rate_hz, hold
        Rate and hold of the input.
    measured
        The fitted response, one row; None for a fit that was restored from a snapshot.
    asked
        The specified model.
    taken
        Additions in `model` that the lines show: "delay", "B", "BL", "lag", "further mode", "residual
        compliance". Values, bounds, response and margins include them.
    correlation
        Correlation of the residuals of neighbouring lines, if they follow a pattern that no model explains; else None.
    competitors
        Model that all have in common, parameters (a row for each), and weights of the models that the lines do not tell
        apart; None where there is only the fitted one. A model with a mode above the lines has two rows, with less and
        with more damping of this mode.
    averaged
        Model and parameters of the average over all models that the lines do not tell apart; see `with_unseen`.
    refusal
        Why a fit whose search ended well has no numbers; see `refused`.

    Examples
    --------
    >>> import livebode
    >>> found = livebode.fit(livebode.example_responses(), "two-mass")
    >>> found.status, round(found["resonance"], 1), found.response([60.0, 61.5]).shape
    ('ok', 59.4, (2,))
    """

    model: PhysicalModel
    parameters: Parameters
    derived: Parameters
    held: dict[str, float]
    band_hz: tuple[float, float]
    lines: int
    rate_hz: float
    hold: Hold = field(default="zero-order")
    measured: Responses | None = None
    asked: PhysicalModel | None = None
    taken: tuple[str, ...] = ()
    correlation: float | None = None
    competitors: tuple[PhysicalModel, Parameters, NDArray[np.float64]] | None = None
    averaged: tuple[PhysicalModel, Parameters] | None = None
    refusal: str = ""

    def __repr__(self) -> str:
        band = f"{self.lines} lines, {self.band_hz[0]:g} … {self.band_hz[1]:g} Hz"
        if self.status != "ok":
            return f"<Fit: {self.model.name} to {band}: {self.sentence}>"
        rows = ((name, *with_bound(value, bound), unit) for name, value, bound, unit in self.rows())
        values = (f"{name} = {value} ± {bound} {unit}".strip() for name, value, bound, unit in rows)
        return f"<Fit: {self.model.name} to {band}: {', '.join(values)}>"

    @property
    def status(self) -> str:
        """ "ok", or the reason why there are no numbers."""
        return str(self.parameters.status[0])

    @property
    def sentence(self) -> str:
        """The status for people."""
        return self.refusal or SENTENCES[self.status]

    def refused(self, reason: str) -> Fit:
        """This fit without numbers, for a reason that is its sentence."""
        part = self.parameters
        status = np.full(1, NO_FIT, dtype=part.status.dtype)
        blank = [
            replace(
                table,
                value=np.full_like(table.value, np.nan),
                covariance=np.full_like(table.covariance, np.nan),
                status=status,
            )
            for table in (part, self.derived)
        ]
        return replace(self, parameters=blank[0], derived=blank[1], refusal=reason)

    def with_unseen(self) -> Fit:
        """This fit with every effect that the lines do not rule out among its parameters, for frequencies between and
        beyond the lines: its values are the average over all models that the lines do not tell apart.
        """
        if self.averaged is None:
            return self
        model, parameters = self.averaged
        fitted = set(self.parameters.names) - set(self.held)
        held = {n: float(v) for n, v in zip(parameters.names, parameters.value[0]) if n not in fitted}
        return replace(self, model=model, parameters=parameters, held=held, averaged=None)

    @property
    def complete(self) -> bool:
        """Whether the bounds are 95 % bounds: the residuals have no pattern, and beyond noise they are small."""
        return self.correlation is None and not self.epsilon >= EPSILON_LARGE

    @property
    def about_bounds(self) -> str:
        """What the bounds cover, and what the specified model lacks, as text."""
        words = []
        if self.taken:
            asked = self.model if self.asked is None else self.asked
            lacking = Message.conjunction(dict.fromkeys(WORDS.get(name, name) for name in self.taken))
            words.append(
                Message(
                    "the {model} model alone is incomplete: the lines show {lacking}, fitted with it",
                    model=asked.name,
                    lacking=lacking,
                )
            )
        if self.complete:
            words.append(Message("± covers 95 %"))
        elif self.correlation is None:
            words.append(
                Message(
                    "model incomplete: it differs from the response by {percent:.2g} % of |G| more than noise "
                    "explains; ± takes this error as independent from line to line, and is not a 95 % bound",
                    percent=100 * self.epsilon,
                )
            )
        else:
            words.append(
                Message(
                    "model incomplete: its error follows a pattern over the lines (correlation of neighbours "
                    "{correlation:.2f}), and no competing model explains it; ± covers it as far as the lines show it, "
                    "but is not a 95 % bound",
                    correlation=self.correlation,
                )
            )
        return words[0] if len(words) == 1 else Message("{model}; {bounds}", model=words[0], bounds=words[1])

    @property
    def epsilon(self) -> float:
        """Error of the model as a share of |G|; 0 where noise alone explains the residuals."""
        return float(self.parameters.epsilon[0])

    @property
    def chi2(self) -> float:
        """Reduced: residuals against sigma alone, 1 for a true model; NaN where no sigma is known."""
        return float(self.parameters.chi2[0] / self.parameters.dof[0])

    def __getitem__(self, name: str) -> float:
        """Value of a parameter or derived quantity."""
        part = self.parameters if name in self.parameters.names else self.derived
        return float(part[name][0])

    def bound(self, name: str, probability: float = COVERAGE) -> float:
        """Half-width of its interval; see `Parameters.bound`."""
        part = self.parameters if name in self.parameters.names else self.derived
        return float(part.bound(probability)[0, part.index(name)])

    def at_most(self, name: str) -> float | None:
        """Upper limit of a parameter that may be zero (a friction) and whose 95 % bound reaches there; else None."""
        one_sided = {p.name for p in self.model.parameters if p.one_sided}
        if name not in one_sided or name in self.held or self[name] > self.bound(name):
            return None
        return self[name] + self.bound(name)

    def response(self, frequency_hz: ArrayLike) -> NDArray[np.complex128]:
        """The fitted model's response, behind hold and delay.

        Raises
        ------
        FitError
            If the fit failed.
        """
        f = np.asarray(frequency_hz, dtype=np.float64)
        response = self.model.at(self._values(), EvaluationGrid(f.ravel(), self.rate_hz, self.hold))
        return np.asarray(response.reshape(f.shape))

    def to_tf(self, discrete: bool = False) -> Any:
        """python-control TransferFunction (extra `control`): in s, without the delay; or in z, behind hold and delay.

        Raises
        ------
        FitError
            If the fit failed, or a negative delay is to become discrete.
        ExtraError
            If python-control is not installed.
        """
        values = self._values()
        try:
            import control
        except ImportError:
            raise not_installed("python-control is not installed", package="control", extra="control") from None
        transfer = self.model.continuous(values)
        if discrete:
            late = float(values[self.model.names.index(DELAY)]) if DELAY in self.model.names else 0.0
            return control.tf(*to_discrete(transfer, self.rate_hz, late), 1 / self.rate_hz)
        below = np.concatenate([transfer.denominator, np.zeros(transfer.integrators)])
        return control.tf(transfer.numerator, below)

    def rows(self, probability: float = COVERAGE) -> list[tuple[str, float, float, str]]:
        """Name, value, half-width and unit of all fitted and derived quantities; 0 where fixed values determine it."""
        rows = []
        for part in (self.parameters, self.derived):
            bound = part.bound(probability)[0]
            for i, name in enumerate(part.names):
                if name not in self.held:
                    value, half = float(part.value[0, i]), float(bound[i])
                    # What follows from fixed values alone has the rounding of its slopes as a bound.
                    rows.append((name, value, 0.0 if half <= _ROUNDING * abs(value) else half, part.units[i]))
        return rows

    def _values(self) -> NDArray[np.float64]:
        if self.status != "ok":
            raise FitError(
                "not-fitted",
                f"there is no fit to evaluate: {self.sentence}",
                "give a fit that is valid",
                status=self.status,
            )
        return np.asarray(self.parameters.value[0])


def fit(
    measured: Response | Responses,
    model: PhysicalModel | str,
    *,
    fixed: Mapping[str, float] | None = None,
    free: Sequence[str] = (),
    band_hz: tuple[float, float] | None = None,
    hold: Hold = "zero-order",
    **options: Any,
) -> Fit:
    """Fit a model to a Response, or to the mean of Responses (`mean_response`).

    The variance of a line is sigma² + (ε|G|)², with ε ≥ 0 such that the reduced chi² is 1; docs/explanation/fits.md
    explains what the bounds then cover. The other arguments are those of `Fitter`.

    Bias: as `Fitter`.

    Raises
    ------
    UsageError, FitError
        If model, names, bounds or band are invalid, or the responses are not of a plant. A fit that fails is not an
        error: its status gives the reason, and its values are NaN.

    Examples
    --------
    >>> from livebode import Lines, Response
    >>> from livebode.simulation import BeltAxis
    >>> lines = Lines.parse("20:140:5", rate_hz=4000, window=800)
    >>> truth = BeltAxis().linear(0.8).sampled(4000.0).response(lines.frequency_hz)
    >>> ones = np.ones(len(lines))
    >>> exact = Response(lines, truth, 1e-3 * ones, np.inf, ones, ones > 0, 0, 799, 0.1)
    >>> found = fit(exact, "two-mass", radius_m=0.019)
    >>> round(found["Keff"], -2), round(found["mL"], 3), round(found["resonance"], 3)
    (500000.0, 6.7, 59.357)
    """
    mean = mean_response(measured) if isinstance(measured, Responses) else Responses.of(measured)
    fitter = Fitter(model, fixed=fixed, free=free, band_hz=band_hz, hold=hold, **options)
    return best_of(fitter, fitter.process(mean), mean)


def best_of(fitter: Fitter, parameters: Parameters, measured: Responses) -> Fit:
    """One row of a Fitter, after a competition with extended models (docs/explanation/fits.md)."""
    plain = fit_of(fitter, parameters, measured)
    if plain.status != "ok":
        return plain
    problem, rows, noise_dof = fitter.start_of(measured, parameters)
    fitted = fit_rows(problem, rows, noise_dof, parameters.value)
    if fitted.status[0] != "ok":
        return plain
    allowed = AllowedChanges(fitter.fixed, fitter.may_take_delay(), plain.band_hz[1])
    competition = compete(fitter.problem, problem is not fitter.problem, fitted, rows, noise_dof, allowed)
    return _chosen(plain, competition, rows, noise_dof) if competition.every else plain


def _chosen(plain: Fit, of: Competition, rows: MeasuredRows, noise_dof: NDArray[np.float64]) -> Fit:
    """The average of the competitors as a Fit, with bounds that include the choice and its own model error."""
    mean, best, pattern, taken = named_average(of), of.every[0].of, None, of.every[0].of.member.effects
    problem, held, fitted = _as_fitted(of, mean, best, rows)
    averaged: Average | None = average(of)
    if follows_pattern(rows, fitted._replace(response=best.solution.response), noise_dof):
        # No model explains it: the specified model is as good as any, and the others show its possible error.
        pattern = correlation(rows, fitted)
        mean, best, averaged, taken = specified(of), of.first, None, of.first.member.effects
        problem, held, fitted = _as_fitted(of, mean, best, rows)
        fitted = fitted._replace(epsilon=np.maximum(fitted.epsilon, pattern_size(rows, fitted)))
        more = positive(covariance(problem, rows, fitted) - mean.covariance)
        mean = replace(mean, covariance=mean.covariance + more)
    parameters = _parameters(plain, mean, fitted)
    model = mean.model
    derived = parameters.derived(model.derived_names, model.derived_units, model.derived)
    return replace(
        plain, model=model, parameters=parameters, derived=derived, held=held, correlation=pattern,
        taken=tuple(sorted(taken, key=lambda effect: -of.share(effect))),
        averaged=None if averaged is None else (averaged.model, _parameters(plain, averaged, fitted)),
        competitors=None if averaged is None else _rows_of(of, plain, fitted),
    )  # fmt: skip


def _parameters(plain: Fit, mean: Average, fitted: FittedRows) -> Parameters:
    model = mean.model
    return replace(
        plain.parameters, model=model.name, names=model.names, units=model.units, value=mean.values[np.newaxis],
        covariance=mean.covariance[np.newaxis], epsilon=fitted.epsilon, chi2=fitted.chi2, dof=fitted.dof,
    )  # fmt: skip


def _rows_of(
    of: Competition, plain: Fit, fitted: FittedRows
) -> tuple[PhysicalModel, Parameters, NDArray[np.float64]] | None:
    """The competitors with 3 % of the weight of the best one and more."""
    family = of.family
    each = [
        (value, c.covariance, w / len(values))
        for c, w in zip(of.every, of.weight)
        if w >= _NOTABLE * of.weight[0]
        for values in [_with_dampings(family, c)]
        for value in values
    ]
    if len(each) < 2:
        return None
    one = _parameters(plain, Average(family.model, *each[0][:2], frozenset()), fitted)
    one = one[np.zeros(len(each), dtype=int)]
    values, matrices, weight = (np.array(part) for part in zip(*each))
    return family.model, replace(one, value=values, covariance=matrices), weight


def _with_dampings(family: Family, of: Competitor) -> list[NDArray[np.float64]]:
    """The values of a competitor; of a mode above the lines, which do not show its damping, with less and with more."""
    member = of.of.member
    if MODE not in member.effects or member.damped or of.mean[family.index("mode")] <= family.top_hz:
        return [of.mean]
    values = np.repeat(of.mean[np.newaxis], 2, axis=0)
    values[:, family.index("mode_damping")] *= [1 / _DAMPINGS_APART, _DAMPINGS_APART]
    return list(values)


def _as_fitted(
    of: Competition, mean: Average, best: FittedMember, rows: MeasuredRows
) -> tuple[Problem, dict[str, float], FittedRows]:
    """An average as the problem that it solves, the values that are not fitted, and a fit of one row."""
    held = {name: float(v) for name, v in zip(mean.model.names, mean.values) if name not in mean.free}
    problem = of.family.problem.variant(mean.model, held=held)
    return problem, held, _rows(problem, mean.values, best, rows)


def _rows(problem: Problem, values: NDArray[np.float64], best: FittedMember, rows: MeasuredRows) -> FittedRows:
    """These values as a fit of one row, with the ε of the best model."""
    value = values[np.newaxis]
    response = problem.model.at(value, problem.grid)
    residual, noise, _ = squares(rows, response)
    blank = np.full((1, len(values), len(values)), np.nan)
    return FittedRows(
        value, blank, np.full(1, OK), np.array([best.epsilon]), chi_squared(residual, noise), np.array([best.dof]),
        response, value,
    )  # fmt: skip


def fit_of(fitter: Fitter, parameters: Parameters, measured: Responses | None = None) -> Fit:
    """One row of a Fitter, with the fitted response."""
    grid = fitter.grid
    moving = parameters.sigma[0] > 0  # a delay that the phase shows is fitted, even if it is fixed at first
    return Fit(
        model=fitter.model,
        parameters=parameters,
        derived=fitter.derived(parameters),
        held={name: value for name, value in fitter.held.items() if not moving[parameters.index(name)]},
        band_hz=(float(grid.frequency_hz[0]), float(grid.frequency_hz[-1])),
        lines=grid.frequency_hz.size,
        rate_hz=grid.rate_hz,
        hold=grid.hold,
        measured=measured,
        asked=fitter.model,
    )
