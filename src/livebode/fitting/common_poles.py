"""Modes and poles that several outputs of one input have in common, fitted to their responses, with bounds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Complex, Floats
from livebode.core import COVERAGE, OK, FitError, GridError, Parameters, Response, Responses, UsageError, counted
from livebode.dataclass import dataclass
from livebode.fitting.fitter import measured_of
from livebode.fitting.mean import mean_response
from livebode.fitting.partial_fractions import PartialFractions, PoleQuantities
from livebode.fitting.patterns import RUNS, neighbours
from livebode.fitting.physical import EvaluationGrid, Hold
from livebode.fitting.pole_kinds import Kind, possible
from livebode.fitting.pole_search import ORDER_MAX, search
from livebode.fitting.problem import MeasuredRows
from livebode.fitting.rows import EPSILON_MAX, NO_FIT, NO_RESPONSE, NOT_CONVERGED, NOT_SEEN, SENTENCES
from livebode.fitting.separable import Outputs, SeparatedFit, whole_covariance
from livebode.fitting.stabilisation import Chart
from livebode.fitting.weights import chi_squared, squares
from livebode.language import Message

POLE_MODELS = ("modal", "rational")
_UNCERTAIN = 0.5  # of a frequency


@dataclass(frozen=True, eq=False)
class CommonPoles:
    """Poles common to all outputs, and the weights of their partial fractions at each; see `fit_common_poles`.

    Attributes
    ----------
    model
        "modal" or "rational".
    outputs, units
        Name and unit of the response of each output.
    best
        The fitted partial fractions; None if there are too few lines.
    grid
        Lines, rate and hold.
    tried
        Order and cost of each of the best fits, by increasing cost.
    parameters
        One row: frequency and damping ratio of each mode, corner frequency of each real pole (positive if stable), and
        for each output residues as size and phase, gains of the integrators, delay; with their covariance.
    epsilon, chi2, correlation
        Of each output: model error as a share of |G|, reduced chi² by sigma alone, and the correlation of the residuals
        of neighbouring lines.
    patterned
        Outputs whose residuals follow a pattern over the lines.
    specified
        Whether the order was specified.
    enough_lines
        Whether the lines are enough for a further pair of poles, so that it was tried unless the order was specified.
    magnitude
        |Ĝ| of the first output at the lines, NaN where it is not used.
    chart
        Poles of models of increasing order, with which the search began.
    raw_covariance
        Of the coefficients of `best`: those of the poles and delays, then the weights of each output.
    """

    model: Kind
    outputs: tuple[str, ...]
    units: tuple[str, ...]
    best: SeparatedFit | None
    grid: EvaluationGrid
    unit: float
    tried: tuple[tuple[int, float], ...]
    parameters: Parameters
    epsilon: Floats
    chi2: Floats
    correlation: Floats
    patterned: tuple[str, ...]
    specified: bool
    enough_lines: bool
    magnitude: Floats
    chart: Chart
    raw_covariance: Floats

    @property
    def status(self) -> str:
        """ "ok", or the reason why there are no numbers."""
        return str(self.parameters.status[0])

    @property
    def sentence(self) -> str:
        """The status for people."""
        if self.status == NOT_SEEN and self.order == 0:
            return "the lines show neither a pole nor an integrator above their noise"
        if self.status == NOT_SEEN:
            return "the lines do not determine so many modes or poles; specify a lower order"
        return SENTENCES[self.status]

    @property
    def raw(self) -> Floats:
        """Coefficients of `best`, in the order of `raw_covariance`."""
        return np.empty(0) if self.best is None else np.concatenate([self.best.theta, self.best.linear.ravel()])

    def moved(self, raw: Floats, frequency_hz: Floats) -> Complex:
        """Response of the first output for other coefficients, (lines,)."""
        assert self.best is not None
        of = self.best.structure
        moved = replace(self.best, theta=raw[: of.nonlinear], linear=raw[of.nonlinear :].reshape(of.outputs, of.linear))
        return np.asarray(response_of(moved, self.grid._replace(frequency_hz=frequency_hz), self.unit)[0])

    @property
    def order(self) -> int:
        """Number of modes, or of poles without integrators."""
        return 0 if self.best is None else _order(self.best, self.model)

    @property
    def complete(self) -> bool:
        """Whether the bounds are 95 % bounds: no pattern is visible in the residuals."""
        return not self.patterned

    @property
    def about_order(self) -> str:
        """How the order was chosen, as text."""
        chosen = counted(self.order, "mode" if self.model == "modal" else "pole")
        if self.specified:
            return f"{chosen}, as specified"
        others = "".join(f"; {order} costs {cost - self.tried[0][1]:.0f} more" for order, cost in self.tried[1:4])
        return f"{chosen}, by −2·ln(likelihood) + ln(values) for each parameter (BIC){others}"

    @property
    def about_bounds(self) -> str:
        """What the bounds cover, as text."""
        if self.complete:
            return Message("the residuals are white over the lines; ± covers 95 %")
        what = "modes" if self.model == "modal" else "poles"
        if self.specified:
            why = f"; further {what} were not tried, because the order is specified"
        elif self.order >= ORDER_MAX[self.model]:
            why = f"; more than {self.order} {what} were not tried"
        elif not self.enough_lines:
            why = f"; there are too few lines to try further {what}"
        else:
            why = f", which further {what} do not explain"
        return (
            f"the residuals of {', '.join(self.patterned)} follow a pattern over the lines{why}; ± is not a 95 % bound"
        )

    def __getitem__(self, name: str) -> float:
        return float(self.parameters[name][0])

    def bound(self, name: str, probability: float = COVERAGE) -> float:
        """Half-width of its interval; see `Parameters.bound`."""
        return float(self.parameters.bound(probability)[0, self.parameters.index(name)])

    def rows(self, probability: float = COVERAGE) -> list[tuple[str, float, float, str]]:
        """Name, value, half-width and unit of all quantities."""
        of = self.parameters
        return list(zip(of.names, of.value[0].tolist(), of.bound(probability)[0].tolist(), of.units))

    def response(self, frequency_hz: ArrayLike) -> Complex:
        """Fitted response of each output behind hold and delay, (outputs, lines).

        Raises
        ------
        FitError
            If the fit failed.
        """
        if self.status != OK or self.best is None:
            raise FitError(
                "not-fitted",
                f"there is no fit to evaluate: {self.sentence}",
                "give a fit that is valid",
                status=self.status,
            )
        f = np.atleast_1d(np.asarray(frequency_hz, dtype=np.float64))
        return response_of(self.best, self.grid._replace(frequency_hz=f), self.unit)


def response_of(of: SeparatedFit, grid: EvaluationGrid, unit: float) -> Complex:
    """Response of each output, (outputs, lines)."""
    shapes = PartialFractions(of.structure, grid, unit)
    delays = of.structure.delays_of(of.theta)
    return np.array([shapes.columns(of.theta, float(late)) @ c for late, c in zip(delays, of.linear)])


def fit_common_poles(
    measured: Sequence[Response | Responses],
    model: Kind = "modal",
    *,
    outputs: Sequence[str] | None = None,
    order: int | None = None,
    band_hz: tuple[float, float] | None = None,
    hold: Hold = "zero-order",
) -> CommonPoles:
    """Fit poles that several outputs of one input have in common; also of a single output.

    G_k(s) = e^(−s·τ_k)·(Σ_r (b1·s + b0)/(s² + a1·s + a0) + c1/s + c2/s² + d), with a1 and a0 common to all outputs, is
    sampled behind the hold and fitted by weighted least squares (variable projection, Golub and Pereyra 1973). "modal"
    has complex pairs between the lines only, and up to two direct terms for the modes above them; "rational" has
    complex and real poles and a direct term. Integrators, direct terms and delays are taken where they lower the cost.

    Poles are added where they lower chi² most, and all are fitted again. The order has the smallest cost, −2·ln
    (likelihood) + ln(values) for each parameter (Schwarz 1978). The variance of a line is sigma² + (ε|Ĝ|)², with ε ≥ 0
    of each output such that its reduced chi² is 1.

    Bias: none to first order where order and noise are right. The bounds do not contain the choice of the order, and
    take the noise of different outputs as independent.

    Parameters
    ----------
    measured
        One Response, or Responses whose mean is taken, for each output, at the same lines.
    model
        "modal" or "rational".
    outputs
        Their names; y1, y2 … by default.
    order
        Number of modes, or of poles without integrators; by default the best one.
    band_hz
        Lowest and highest frequency of the lines used.
    hold
        Hold of the input.

    Raises
    ------
    UsageError, GridError, FitError
        If order or band are invalid, the lines differ, or the responses are not of a plant. A fit that fails is not an
        error: its status gives the reason.

    Examples
    --------
    >>> import livebode
    >>> found = fit_common_poles([livebode.example_responses()])
    >>> found.order, round(found["frequency_1"], 1), found["damping_1"] < 0.1
    (1, 59.4, True)
    """
    check_model(model, order)
    batches = [mean_response(batch) if isinstance(batch, Responses) else Responses.of(batch) for batch in measured]
    names = tuple(outputs or (f"y{k + 1}" for k in range(len(batches))))
    outs = outputs_of(batches, names, band_hz, hold)
    best = search(outs, model, order)
    return assembled(outs, best, names, batches, model, specified=order is not None)


def assembled(
    outs: Outputs, best: Sequence[SeparatedFit], names: tuple[str, ...], batches: Sequence[Responses], model: Kind, *,
    specified: bool, covariance: Floats | None = None,
) -> CommonPoles:  # fmt: skip
    """The first of these fits with its quantities; `covariance` by default with independent outputs."""
    blank = _Blank(model, names, batches)
    if not best:
        return blank.without_fit(outs)

    def judged(of: SeparatedFit) -> tuple[SeparatedFit, Floats, Parameters]:
        raw = np.concatenate([of.theta, of.linear.ravel()])
        quantities = PoleQuantities(of.structure, outs.unit, names, blank.units, raw)
        of_raw = whole_covariance(outs, of) if covariance is None else covariance
        return of, of_raw, blank.parameters(quantities, outs, of, of_raw)

    chosen, covariance_of_chosen, parameters = judged(best[0])
    if parameters.status[0] == NOT_SEEN and chosen.structure.poles and covariance is None:
        # The next one whose frequencies the lines determine.
        others = (judged(of) for of in best[1:])
        chosen, covariance_of_chosen, parameters = next(
            (other for other in others if other[2].status[0] == OK), (chosen, covariance_of_chosen, parameters)
        )
    residual = np.where(outs.measured.use, outs.measured.value - chosen.response, 0.0) * chosen.weight
    correlated = np.array([neighbours(weighted[use]) for weighted, use in zip(residual, outs.measured.use)])
    limit = RUNS / np.sqrt(2 * np.count_nonzero(outs.measured.use, axis=1))
    return CommonPoles(
        model, names, blank.units, chosen, outs.grid, outs.unit, tuple((_order(of, model), of.cost) for of in best),
        parameters, chosen.epsilon, _reduced_chi2(outs, chosen), correlated,
        tuple(name for name, high in zip(names, correlated > limit) if high), specified,
        outs.enough_for(replace(chosen.structure, pairs=chosen.structure.pairs + 1)),
        _magnitude(outs), outs.chart, covariance_of_chosen,
    )  # fmt: skip


def _magnitude(outs: Outputs) -> Floats:
    """|Ĝ| of the first output, (lines,)."""
    return np.where(outs.measured.use[0], np.abs(outs.measured.value[0]), np.nan)


def _order(of: SeparatedFit, model: Kind) -> int:
    return of.structure.modes if model == "modal" else of.structure.poles


def check_model(model: str, order: int | None) -> None:
    if model not in POLE_MODELS:
        raise UsageError(
            "not-one-of", f"{model=} is not supported", "choose 'modal' or 'rational'", argument="model", value=model,
            allowed=list(POLE_MODELS),
        )  # fmt: skip
    if order is not None and not 0 <= order <= ORDER_MAX[model]:
        raise UsageError(
            "out-of-range", f"{order=} is not between 0 and {ORDER_MAX[model]}", "choose one in this range",
            argument="order", value=order,
        )  # fmt: skip


def outputs_of(
    batches: Sequence[Responses], names: tuple[str, ...], band_hz: tuple[float, float] | None, hold: Hold
) -> Outputs:
    """Lines of all outputs inside of a band."""
    lines = batches[0].lines
    for name, batch in zip(names, batches):
        if not lines.alike(batch.lines):
            raise GridError(
                "not-alike",
                f"{name!r} and {names[0]!r} have different lines or rates, so their poles cannot be fitted together",
                "track both at the same lines of one recording",
                outputs=[names[0], name],
            )
    low, high = band_hz or (0.0, np.inf)
    inside = (lines.frequency_hz >= low) & (lines.frequency_hz <= high)
    if not inside.any():
        raise FitError(
            "too-few-lines", f"the band {low:g} … {high:g} Hz has no lines", "choose a band with lines", lines=0
        )
    parts = [measured_of(batch, inside) for batch in batches]
    whole = MeasuredRows(
        *(np.concatenate([getattr(part, of) for part, _ in parts]) for of in ("value", "sigma", "use"))
    )
    dof = np.concatenate([np.asarray(dof) for _, dof in parts])
    grid = EvaluationGrid(lines.frequency_hz[inside], lines.rate_hz, hold)
    return Outputs(whole, np.where(np.isnan(dof), np.inf, dof), grid)


def _reduced_chi2(outs: Outputs, of: SeparatedFit) -> Floats:
    residual, noise, _ = squares(outs.measured, of.response)
    values = 2.0 * np.count_nonzero(outs.measured.use, axis=1)
    return np.asarray(chi_squared(residual, noise) / np.maximum(values - of.structure.size / len(values), 1.0))


class _Blank:
    """What a result has whether or not the fit is valid."""

    def __init__(self, model: Kind, names: tuple[str, ...], batches: Sequence[Responses]) -> None:
        self._model, self._names, self._first = model, names, batches[0]
        self.units = tuple(batch.unit for batch in batches)

    def without_fit(self, outs: Outputs) -> CommonPoles:
        nan = np.full(len(self._names), np.nan)
        parameters = self._row((), (), np.empty(0), np.empty((0, 0)), NO_RESPONSE, nan, nan, np.nan)
        return CommonPoles(
            self._model,
            self._names,
            self.units,
            None,
            outs.grid,
            outs.unit,
            (),
            parameters,
            nan,
            nan,
            nan,
            (),
            False,
            False,
            _magnitude(outs),
            outs.chart,
            np.empty((0, 0)),
        )

    def parameters(self, quantities: PoleQuantities, outs: Outputs, of: SeparatedFit, covariance: Floats) -> Parameters:
        raw = np.concatenate([of.theta, of.linear.ravel()])
        names = tuple(f"x{i}" for i in range(len(raw)))
        status = OK
        terms = of.structure.poles + of.structure.integrators
        if not terms or not np.isfinite(covariance).all() or not possible(outs, of, self._model):
            status = NOT_SEEN
        elif (of.epsilon > EPSILON_MAX).any():
            status = NO_FIT
        elif not of.settled:
            status = NOT_CONVERGED
        residual, noise, _ = squares(outs.measured, of.response)
        chi2, dof = chi_squared(residual, noise), outs.count - of.structure.size
        row = self._row(names, ("",) * len(raw), raw, covariance, status, of.epsilon, chi2, float(dof))
        shown = row.derived(quantities.names, quantities.units, quantities.of)
        if status == OK and (shown.sigma[0] > _UNCERTAIN * np.abs(shown.value[0]))[quantities.certain].any():
            return self._row(
                shown.names, shown.units, shown.value[0], shown.covariance[0], NOT_SEEN, of.epsilon, chi2,
                float(dof),
            )  # fmt: skip
        return shown

    def _row(
        self, names: tuple[str, ...], units: tuple[str, ...], value: Floats, covariance: Floats, status: str,
        epsilon: Floats, chi2: Any, dof: float,
    ) -> Parameters:  # fmt: skip
        if status != OK:
            value, covariance = np.full_like(value, np.nan), np.full_like(covariance, np.nan)
        of = self._first
        return Parameters(
            model=self._model, names=names, units=units, value=value[np.newaxis], covariance=covariance[np.newaxis],
            status=np.array([status], dtype="<U20"), epsilon=np.array([np.max(epsilon)]), chi2=np.array([np.sum(chi2)]),
            dof=np.array([dof]), sample=of.sample, time_s=of.time_s, schedule=of.schedule,
        )  # fmt: skip
