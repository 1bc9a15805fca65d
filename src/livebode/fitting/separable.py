"""Partial fractions fitted to responses of several outputs: the weights are linear, the common poles are not."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import needing
from livebode.dataclass import dataclass
from livebode.fitting.partial_fractions import PartialFractions, Structure
from livebode.fitting.physical import EvaluationGrid
from livebode.fitting.problem import MeasuredRows, Solution
from livebode.fitting.rows import covariance
from livebode.fitting.stabilisation import Chart, stabilisation_chart
from livebode.fitting.weights import epsilon_for, misfit_by, squares, weights

_FIRST_EPSILON = 0.1
_SAME = 0.01
_TICK_STEP = 1e-4  # of a tick, for the slope by a delay
_ERROR_PRICE = 0.15  # of a pole for each value whose error is the model's: a pair has to lower ε by 14 %
_CHANCE = 3.0  # deviations of chi² by which an error of the model is told from chance
_EVIDENCE = 5.0  # for each pole: 10 for a pair, which Kass and Raftery (1995) call very strong
_LEFT_OVER = 4  # real values more than parameters
_SINGULAR = 1e-6  # of the largest singular value of residual terms
_TOLERANCE = 1e-8
EVALUATIONS = 40


@dataclass(frozen=True, eq=False)
class Outputs:
    """Responses of several outputs to one input, (outputs, lines), and the degrees of freedom of their sigmas."""

    measured: MeasuredRows
    noise_dof: Floats
    grid: EvaluationGrid

    @property
    def unit(self) -> float:
        """Geometric mean of the lines, in rad/s."""
        return float(2 * np.pi * np.exp(np.mean(np.log(self.grid.frequency_hz))))

    @cached_property
    def chart(self) -> Chart:
        """Poles of models of increasing order."""
        return stabilisation_chart(self.measured, self.grid)

    @property
    def count(self) -> int:
        """Number of measured real values."""
        return 2 * int(np.count_nonzero(self.measured.use))

    def enough_for(self, structure: Structure) -> bool:
        lines = np.count_nonzero(self.measured.use, axis=1)
        return bool(self.count >= structure.size + _LEFT_OVER and (2 * lines > structure.linear).all())


@dataclass(frozen=True, eq=False)
class SeparatedFit:
    """A structure fitted: the nonlinear parameters, the weights of the columns, and what they give.

    Attributes
    ----------
    theta, linear
        (nonlinear,) and (outputs, linear).
    response, weight
        Of the model, and by which the residuals were multiplied, (outputs, lines).
    epsilon
        Model error of each output as a share of its measured |G|, (outputs,).
    misfit
        −2·ln(likelihood).
    cost
        The misfit plus ln(values) for each parameter, the criterion of Bayes and Schwarz (BIC); and for each
        pole ln(lines) + 5, and 0.15 for each value whose error is the model's, not noise.
    settled
        Whether the search converged.
    """

    structure: Structure
    theta: Floats
    linear: Floats
    response: Complex
    weight: Floats
    epsilon: Floats
    misfit: float
    cost: float
    settled: bool


def solve(
    outputs: Outputs, structure: Structure, start: Floats, *, rounds: int, evaluations: int = EVALUATIONS
) -> SeparatedFit:
    """Fit from a start, and again with the ε of the residuals, at most `rounds` times; poles rest at 0 evaluations."""
    measured = outputs.measured
    epsilon = np.full(structure.outputs, _FIRST_EPSILON)
    theta, dof = start, _dof(outputs, structure)
    # |residual|²/sigma² is on average n/(n − 1) where sigma has n complex degrees of freedom.
    expected, spread = _student(outputs.noise_dof)
    for _ in range(rounds):
        problem = _WeightedFit(outputs, structure, _weights(measured, epsilon))
        theta, settled = problem.minimised(theta, evaluations) if evaluations else (theta, False)
        linear, response = problem.at(theta)
        residual, noise, _ = squares(measured, response)
        size = np.where(measured.use, np.abs(measured.value), 0.0) ** 2
        before, epsilon = epsilon, epsilon_for(residual, noise * expected[:, np.newaxis], size, dof)
        if (np.abs(epsilon - before) <= _SAME * epsilon).all():
            break
    variance = noise + epsilon[:, np.newaxis] ** 2 * size
    likely = float(np.sum(misfit_by(residual, noise, variance, outputs.noise_dof, measured.use)))
    # Errors of an incomplete model are alike at neighbouring lines and in all outputs: they are fewer than lines.
    chance = 1 + _CHANCE * spread * np.sqrt(2 / dof)
    sure = epsilon_for(residual, noise * (expected * chance)[:, np.newaxis], size, dof)
    least = noise + sure[:, np.newaxis] ** 2 * size
    erring = 2 * float(np.sum(1 - (noise / np.where(least > 0, least, 1.0))[measured.use]))
    each_pole = pole_price(outputs.grid.frequency_hz.size, erring)
    cost = likely + structure.size * np.log(outputs.count) + structure.poles * each_pole
    return SeparatedFit(structure, theta, linear, response, problem.weight, epsilon, likely, cost, settled)


def _student(dof: Floats) -> tuple[Floats, Floats]:
    """Mean of |residual|²/sigma² and its relative deviation, where sigma² has these complex degrees of freedom."""
    n = np.clip(dof, 3.0, 1e9)
    return n / (n - 1), np.sqrt(n / (n - 2))


def pole_price(lines: int, erring: float) -> float:
    """Cost of a pole beside its parameters; `erring` is the number of real values whose error is the model's."""
    # A pole is searched for over all lines, so the largest of as many random values is found.
    return float(np.log(lines) + _EVIDENCE + _ERROR_PRICE * erring)


def whole_covariance(outputs: Outputs, of: SeparatedFit) -> Floats:
    """Covariance of the nonlinear parameters and then the weights of each output; not finite where it is singular.

    The noise of different outputs is taken as independent.
    """
    problem = _WeightedFit(outputs, of.structure, of.weight)
    slope = problem.slopes(of.theta, of.linear)
    measured = outputs.measured
    sigma = np.where(measured.sigma > 0, measured.sigma, 0.0)
    epsilon = np.where(_unknown(measured) & (of.epsilon == 0), 1.0, of.epsilon)
    total = np.sqrt(sigma**2 + (epsilon[:, np.newaxis] * np.abs(measured.value)) ** 2)
    # As noise alone: what part of it is sigma, with few degrees of freedom, is in `noise_dof` of the whole.
    flat = MeasuredRows(measured.value.reshape(1, -1), total.reshape(1, -1), measured.use.reshape(1, -1))
    known = _determined(of.structure, of.weight.reshape(-1, 1) * slope)
    solution = Solution(of.theta[np.newaxis], of.response.reshape(1, -1), (slope @ known)[np.newaxis], np.array([True]))
    share = np.where(measured.use, sigma / np.where(total > 0, total, 1.0), 0.0) ** 2
    dof = outputs.noise_dof / np.maximum(np.mean(share, axis=1, where=measured.use) ** 2, 1e-12)
    return np.asarray(known @ covariance(flat, solution, np.zeros(1), np.array([np.min(dof)]))[0] @ known.T)


def _determined(of: Structure, slope: Complex) -> Floats:
    """Combinations of the parameters that are determined, (size, combinations), from weighted slopes.

    Residual pairs and direct terms may replace each other: only what they do together is determined.
    """
    if not of.residual:
        return np.eye(of.size)
    nonlinear = np.arange(of.nonlinear) // 2
    linear = np.arange(of.linear)
    loose = np.concatenate(
        [(nonlinear >= of.modes) & (nonlinear < of.pairs)]
        + [(linear // 2 >= of.modes) & ((linear // 2 < of.pairs) | (linear >= of.linear - of.direct))] * of.outputs
    )
    firm, weak = np.flatnonzero(~loose), np.flatnonzero(loose)
    scale = _sizes(slope[:, weak])
    _, size, axes = np.linalg.svd(stacked(slope[:, weak] / scale), full_matrices=False)
    held = size > _SINGULAR * size[0]
    known = np.zeros((of.size, firm.size + np.count_nonzero(held)))
    known[firm, np.arange(firm.size)] = 1.0
    known[weak, firm.size :] = axes[held].T / size[held] / scale[:, np.newaxis]
    return known


def left_over(outputs: Outputs, of: SeparatedFit) -> tuple[Floats, list[Floats]]:
    """Weighted residuals, real above imaginary parts, (outputs, 2·lines), and the basis of each output's columns."""
    problem = _WeightedFit(outputs, of.structure, of.weight)
    residual = of.weight * np.where(outputs.measured.use, outputs.measured.value - of.response, 0.0)
    return stacked(residual.T).T, [q for q, *_ in problem.factors(of.theta)]


def lost_without(outputs: Outputs, of: SeparatedFit) -> Floats:
    """Increase of the weighted sum of squares without the columns of each pair, all poles at rest, (pairs,)."""
    problem, lost = _WeightedFit(outputs, of.structure, of.weight), np.zeros(of.structure.pairs)
    for weight, (_, linear, columns, _) in zip(of.weight, problem.factors(of.theta)):
        left = stacked(weight[:, np.newaxis] * columns)
        scale = _sizes(left)
        inverse = np.linalg.pinv(np.linalg.qr(left / scale)[1], rcond=1e-13)
        size = (linear * scale)[: 2 * of.structure.pairs].reshape(-1, 2)
        rows = inverse[: 2 * of.structure.pairs].reshape(-1, 2, inverse.shape[1])
        lost += np.einsum("pi,pij,pj->p", size, np.linalg.pinv(rows @ rows.swapaxes(1, 2)), size)
    return lost


def _sizes(columns: NDArray[Any]) -> Floats:
    """Norm of each column; 1 for one without values, of a pole far from all lines, whose weight stays finite."""
    norm = np.linalg.norm(columns, axis=0)
    return np.asarray(np.where(norm > 0, norm, 1.0))


def stacked(values: NDArray[Any]) -> Floats:
    """Real above imaginary parts, along the first axis."""
    return np.concatenate([values.real, values.imag])


class _WeightedFit:
    """The least squares of one structure with given weights, and its solution at the last poles."""

    def __init__(self, outputs: Outputs, structure: Structure, weight: Floats) -> None:
        self.structure, self.weight = structure, weight
        self._shapes = PartialFractions(structure, outputs.grid, outputs.unit)
        self._rate_hz, value = outputs.grid.rate_hz, outputs.measured.value
        self._right = [stacked(w * np.where(w > 0, y, 0.0)) for w, y in zip(weight, value)]
        self._last: tuple[Floats, list[Any]] | None = None
        self._moves: tuple[Floats, tuple[Complex, Complex]] | None = None

    def minimised(self, start: Floats, evaluations: int) -> tuple[Floats, bool]:
        with needing("SciPy", "analysis", "a fit of poles"):
            from scipy.optimize import least_squares

        if not start.size:
            return start, True
        with np.errstate(all="ignore"):
            minimum = least_squares(
                self._residual, start, self._jacobian, method="lm", x_scale="jac", max_nfev=evaluations,
                xtol=_TOLERANCE, ftol=_TOLERANCE, gtol=_TOLERANCE,
            )  # fmt: skip
        return np.asarray(minimum.x), bool(minimum.success)

    def at(self, theta: Floats) -> tuple[Floats, Complex]:
        """Weights (outputs, linear) and response (outputs, lines)."""
        factors = self.factors(theta)
        return np.array([c for _, c, _, _ in factors]), np.array([columns @ c for _, c, columns, _ in factors])

    def factors(self, theta: Floats) -> list[Any]:
        """Orthonormal basis of the weighted columns, their weights, the columns, and the residual, of each output."""
        if self._last is not None and np.array_equal(self._last[0], theta):
            return self._last[1]
        factors = []
        delays, columns = self.structure.delays_of(theta), None
        for weight, right, delay_s in zip(self.weight, self._right, delays):
            if columns is None or self.structure.delays:
                columns = np.nan_to_num(self._shapes.columns(theta, float(delay_s)), posinf=0.0, neginf=0.0)
            left = stacked(weight[:, np.newaxis] * columns)
            scale = _sizes(left)
            q, r = np.linalg.qr(left / scale)
            across = q.T @ right
            linear = np.linalg.lstsq(r, across, rcond=1e-13)[0] / scale
            factors.append((q, linear, columns, right - q @ across))
        self._last = (np.array(theta), factors)
        return factors

    def slopes(self, theta: Floats, linear: Floats) -> Complex:
        """Derivatives of all responses by all parameters, (outputs·lines, size), without weights."""
        of, lines = self.structure, self.weight.shape[1]
        whole = np.zeros((of.outputs, lines, of.size), dtype=np.complex128)
        for k, (_, _, columns, _) in enumerate(self.factors(theta)):
            whole[k, :, : of.nonlinear] = self._moved(theta, linear[k], k)
            begin = of.nonlinear + k * of.linear
            whole[k, :, begin : begin + of.linear] = columns
        return whole.reshape(of.outputs * lines, of.size)

    def _residual(self, theta: Floats) -> Floats:
        return np.concatenate([residual for *_, residual in self.factors(theta)])

    def _jacobian(self, theta: Floats) -> Floats:
        """Kaufman's: the slopes at fixed weights, without what the weights can follow."""
        parts = []
        for k, (q, linear, _, _) in enumerate(self.factors(theta)):
            moved = stacked(self.weight[k][:, np.newaxis] * self._moved(theta, linear, k))
            parts.append(q @ (q.T @ moved) - moved)
        return np.asarray(np.nan_to_num(np.concatenate(parts)))

    def _moved(self, theta: Floats, linear: Floats, k: int) -> Complex:
        """Derivative of the response of output k by the nonlinear parameters, (lines, nonlinear)."""
        of, delay_s = self.structure, float(self.structure.delays_of(theta)[k])
        if of.delays or self._moves is None or not np.array_equal(self._moves[0], theta):
            self._moves = (np.array(theta), self._shapes.moves(theta, delay_s))
        slopes = self._shapes.slopes(self._moves[1], linear)
        if not of.delays:
            return slopes
        step = _TICK_STEP / self._rate_hz
        later, earlier = (self._shapes.columns(theta, delay_s + way * step) @ linear for way in (1, -1))
        by_delay = np.zeros((len(slopes), of.outputs), dtype=np.complex128)
        by_delay[:, k] = (later - earlier) / (2 * step)
        return np.concatenate([slopes, by_delay], axis=1)


def _unknown(measured: MeasuredRows) -> Any:
    return ~((measured.sigma > 0) & measured.use).any(axis=1)


def _weights(measured: MeasuredRows, epsilon: Floats) -> Floats:
    """Weight of each line; by its size where neither noise nor ε is known.

    The size is the measured one: that of a model with too few poles is wrong by orders of magnitude between them.
    """
    known = np.where(_unknown(measured) & (epsilon == 0), 1.0, epsilon)
    return np.where(measured.use, weights(measured.sigma, np.abs(measured.value), known), 0.0)


def _dof(outputs: Outputs, structure: Structure) -> Floats:
    """Degrees of freedom of each output's residuals, with an equal share of the common parameters."""
    values = 2.0 * np.count_nonzero(outputs.measured.use, axis=1)
    return np.asarray(np.maximum(values - structure.size / structure.outputs, 1.0))
