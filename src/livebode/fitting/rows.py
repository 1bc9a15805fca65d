"""Fits of rows of responses: from measured values to parameters, covariance, or the reason for a failure."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import OK
from livebode.fitting.problem import MeasuredRows, Problem, Solution
from livebode.fitting.weights import chi_squared, lacks_more_than, own_epsilon, squares, weights
from livebode.kernel import FitModel, FitRows, fit
from livebode.language import Message

_FROM = 0.03  # of |G|: a smaller misfit remains the model's ε
_EXPLAINED = 0.5
_ROUNDS = 15


def held_by_friction(problem: Problem, measured: MeasuredRows, without: Solution, dof: Floats) -> NDArray[np.bool_]:
    """Rows whose ε falls to less than half as soon as one viscous friction of the model is fitted too.

    Dry friction of an axis at standstill acts on such a small motion much like a viscous one, and a real viscous one
    biases stiffness and inertia alike. Only rows with a model error above 3 % of |G| are examined; the error of a wrong
    model is not explained by friction.
    """
    by_friction = np.zeros(len(dof), dtype=bool)
    frictions = [name for name in problem.model.frictions if name in problem.held]
    lacking = np.flatnonzero(lacks_more_than(_FROM, measured, without.response, dof))
    if not (lacking.size and frictions):
        return by_friction
    some = measured[lacking]
    eps = own_epsilon(some, without.response[lacking], dof[lacking])
    for name in frictions:
        wider = problem.variant(free=(name,))
        column = wider.model.names.index(name)
        start = without.values[lacking]
        start[:, column] = wider.model.shown(start, problem.grid)[:, column]
        weight = weights(some.sigma, np.abs(some.value), eps / 2)
        solution, _ = wider.solve(some, weight, start, _ROUNDS)
        by_friction[lacking] |= own_epsilon(some, solution.response, dof[lacking] - 1) < _EXPLAINED * eps
    return by_friction


NO_RESPONSE = Message("no response")
NOT_CONVERGED = Message("not converged")
BOUND = Message("bound hit")
NOT_SEEN = Message("not seen")
NO_FIT = Message("model does not fit")
FRICTION = Message("friction")

SENTENCES = {
    OK: Message("the fit is valid"),
    NO_RESPONSE: Message("too few lines are valid for the model's free parameters"),
    NOT_CONVERGED: Message("the fit did not converge; the lines may not determine the model's parameters"),
    BOUND: Message("a parameter ended at its bound; the lines do not determine it"),
    NOT_SEEN: Message(
        "the lines do not determine the model: a parameter is uncertain by more than half; take lines around "
        "the resonance and the antiresonance, or fix parameters that are known"
    ),
    NO_FIT: Message(
        "the model differs from the response by more than half of it: the machine needs another model, or "
        "there is no response"
    ),
    FRICTION: Message(
        "friction stops the machine and explains most of the model's error; move the axis, increase the "
        "excitation, or free the model's viscous friction"
    ),
}
"""The meaning of each status as text."""

_WORDS = np.array(
    [OK, NO_RESPONSE, NOT_CONVERGED, BOUND, NOT_SEEN, NO_FIT, FRICTION], dtype="<U20"
)  # in the kernel's order

EPSILON_MAX = 0.5
_UNCERTAIN = 0.5  # of a logarithm
_WORD = "<U20"
_FIRST_EPSILON = (
    0.1  # so that a line measured much more accurately than the model is valid does not dominate a first fit
)
_REWEIGHTED, _SAME = 8, 0.01  # rounds, and the change of ε by which no weight changes visibly
_SUSPICIOUS = 4.0  # of a reduced chi², ε and all
_WARM_ROUNDS = 12
_DOF_LEAST = 3.0  # the correction d/(d − 2) of weights from estimated noise is infinite at two
_CONDITION_MAX = 1e11
_ROUNDING = 1e-14  # keeps a singular matrix invertible; its inverse then exceeds the limit above


class FittedRows(NamedTuple):
    """Result of a batch of rows: the arrays of `Parameters`, and, failed or not, the model's response (rows, lines)
    and the values at the end of the search."""

    values: Floats
    covariance: Floats
    status: NDArray[np.str_]
    epsilon: Floats
    chi2: Floats
    dof: Floats
    response: Complex
    ended: Floats


def fit_rows(
    problem: Problem,
    measured: MeasuredRows,
    noise_dof: Floats,
    start: Floats | None = None,
    epsilon: Floats | None = None,
) -> FittedRows:
    """Fit each row, from `start` (rows, parameters) where there is one; where there is none or it fails, from a scan.

    `epsilon` (rows,) is fixed where it is given; else each row's own is found, such that its reduced chi² is 1.
    `noise_dof` (rows,) are the degrees of freedom behind the sigmas.
    """
    if problem.native is not None:
        return _fitted_natively(problem, problem.native, measured, noise_dof, start, epsilon)
    dof = 2.0 * np.count_nonzero(measured.use, axis=1) - problem.size
    if dof.size and (dof > 0).all():
        return _fitted_apart(problem, measured, noise_dof, start, epsilon, dof)
    some = np.flatnonzero(dof > 0)
    whole = _none(problem, measured, dof, NO_RESPONSE)
    if some.size:
        begin, eps = (None if x is None else x[some] for x in (start, epsilon))
        fitted = _fitted_apart(problem, measured[some], noise_dof[some], begin, eps, dof[some])
        for kept, other in zip(whole, fitted):
            kept[some] = other
    return whole


def _fitted_natively(
    problem: Problem,
    native: FitModel,
    measured: MeasuredRows,
    noise_dof: Floats,
    start: Floats | None,
    epsilon: Floats | None,
) -> FittedRows:
    """All rows in C."""
    grid = problem.grid
    rows = FitRows(measured.value, measured.sigma, measured.use, noise_dof, start, epsilon)
    result = fit(native, grid.frequency_hz, grid.rate_hz, rows)
    status = _WORDS[result.status]
    return FittedRows(
        result.values, result.covariance, status, result.epsilon, result.chi2, result.dof, result.response, result.ended
    )


def _fitted_apart(
    problem: Problem,
    measured: MeasuredRows,
    noise_dof: Floats,
    start: Floats | None,
    epsilon: Floats | None,
    dof: Floats,
) -> FittedRows:
    """All rows at once; if that is not possible, each by itself: one row without a solution disturbs no other."""
    try:
        return _fitted(problem, measured, noise_dof, start, epsilon, dof)
    except np.linalg.LinAlgError:
        if len(dof) == 1:
            return _none(problem, measured, dof, NOT_CONVERGED)
    parts = []
    for i in range(len(dof)):
        row = slice(i, i + 1)
        begin, eps = (None if x is None else x[row] for x in (start, epsilon))
        parts.append(_fitted_apart(problem, measured[np.array([i])], noise_dof[row], begin, eps, dof[row]))
    return FittedRows(*(np.concatenate(columns) for columns in zip(*parts)))


def _none(problem: Problem, measured: MeasuredRows, dof: Floats, word: str) -> FittedRows:
    """Rows without a fit, with this status."""
    rows, n = len(dof), len(problem.model.names)
    nan = np.full(rows, np.nan)
    return FittedRows(
        np.full((rows, n), np.nan), np.full((rows, n, n), np.nan), np.full(rows, word, dtype=_WORD), nan,
        nan.copy(), dof, np.full(measured.value.shape, np.nan, dtype=np.complex128), np.full((rows, n), np.nan),
    )  # fmt: skip


def _fitted(
    problem: Problem,
    measured: MeasuredRows,
    noise_dof: Floats,
    start: Floats | None,
    epsilon: Floats | None,
    dof: Floats,
) -> FittedRows:
    eps = np.full(len(dof), _FIRST_EPSILON) if epsilon is None else epsilon
    # Before a model is known the measured size replaces the model's.
    size = np.where(measured.use, np.abs(measured.value), 0.0)
    weight = line_weights(measured, size, eps)
    solution = _begun(problem, measured, weight, start, dof)
    if epsilon is None:
        solution, eps = _reweighted(problem, measured, solution, dof)
    else:
        # A row with a much larger model error than the previous ones is less certain than they were.
        more = own_epsilon(measured, solution.response, _SUSPICIOUS * dof) > eps
        if more.any():
            eps = np.where(more, own_epsilon(measured, solution.response, dof), eps)
    return _judged(problem, measured, noise_dof, solution, eps, dof)


def line_weights(measured: MeasuredRows, size: Floats, epsilon: Floats) -> Floats:
    """Where neither noise nor ε is known, the weight of a line is its size."""
    by_noise = weights(measured.sigma, size, epsilon)
    unknown = ~(np.where(measured.use, by_noise, 0.0) > 0).any(axis=1)
    if unknown.any():
        by_noise[unknown] = weights(measured.sigma[unknown], size[unknown], np.ones(np.count_nonzero(unknown)))
    return by_noise


def _begun(problem: Problem, measured: MeasuredRows, weight: Floats, start: Floats | None, dof: Floats) -> Solution:
    """From the start, and for rows where this fails the best fit of a scan."""
    if start is None:
        return _scanned(problem, measured, weight)
    solution, cost = problem.solve(measured, weight, start, _WARM_ROUNDS)
    lost = ~solution.settled | (cost > _SUSPICIOUS * dof)
    if lost.any():
        again = _scanned(problem, measured[lost], weight[lost])
        squared = np.abs(weight[lost] * np.where(measured.use[lost], again.response - measured.value[lost], 0.0)) ** 2
        better = (squared.sum(axis=1) < cost[lost]) | ~solution.settled[lost]
        rows = np.flatnonzero(lost)[better]
        for kept, other in zip(solution, again):
            kept[rows] = other[better]
    return solution


def _scanned(problem: Problem, measured: MeasuredRows, weight: Floats) -> Solution:
    """The best of the fits from the model's first values."""
    starts = problem.starts(measured, np.where(measured.use, weight, 0.0))
    count, rows, _ = starts.shape
    every, cost = problem.solve(measured.repeated(count), np.tile(weight, (count, 1)), starts.reshape(count * rows, -1))
    best = np.argmin(np.where(every.settled, cost, cost + 1e300).reshape(count, rows), axis=0)
    return Solution(*(x.reshape(count, rows, *x.shape[1:])[best, np.arange(rows)] for x in every))


def _reweighted(problem: Problem, measured: MeasuredRows, solution: Solution, dof: Floats) -> tuple[Solution, Floats]:
    """Fits repeated with the ε of their residuals until it converges; each row by itself."""
    eps = np.full(len(dof), _FIRST_EPSILON)
    for _ in range(_REWEIGHTED):
        new = own_epsilon(measured, solution.response, dof)
        same = np.abs(new - eps) <= _SAME * new
        if same.all():
            break
        eps = np.where(same, eps, new)
        weight = line_weights(measured, np.abs(solution.response), eps)
        again, _ = problem.solve(measured, weight, solution.values)
        for kept, other in zip(solution, again):
            kept[~same] = other[~same]
    return solution, eps


def _judged(
    problem: Problem, measured: MeasuredRows, noise_dof: Floats, solution: Solution, eps: Floats, dof: Floats
) -> FittedRows:
    residual, noise, _ = squares(measured, solution.response)
    small = covariance(measured, solution, eps, noise_dof)
    with np.errstate(invalid="ignore"):
        uncertain = np.sqrt(np.einsum("rii->ri", small))[:, problem.relative()]
        unseen = ~np.isfinite(small).all(axis=(1, 2)) | ~(uncertain <= _UNCERTAIN).all(axis=1)
    status = np.full(len(dof), OK, dtype=_WORD)
    for word, failed in (
        (FRICTION, held_by_friction(problem, measured, solution, dof)),
        (NO_FIT, lacks_more_than(EPSILON_MAX, measured, solution.response, dof)),
        (NOT_SEEN, unseen),
        (BOUND, problem.at_bound(solution.values)),
        (NOT_CONVERGED, ~solution.settled),
    ):
        status[failed] = word
    failed = status != OK
    outward = problem.outward_slopes(solution.values)
    whole = np.zeros((len(dof), solution.values.shape[1], solution.values.shape[1]))
    free = np.flatnonzero(problem.free)
    whole[:, free[:, np.newaxis], free] = outward[:, :, np.newaxis] * small * outward[:, np.newaxis]
    whole[failed] = np.nan
    return FittedRows(
        np.where(failed[:, np.newaxis], np.nan, solution.values),
        whole, status, np.where(failed, np.nan, eps), chi_squared(residual, noise), dof,
        solution.response, solution.values,
    )  # fmt: skip


def covariance(measured: MeasuredRows, solution: Solution, eps: Floats, noise_dof: Floats) -> Floats:
    """Covariance of the free parameters' coordinates, (rows, free, free); not finite where it is singular.

    A sigma that was estimated with d degrees of freedom makes a weight that scatters; weighted least squares then
    scatter more than the weights indicate, by d/(d − 2) where the weight is noise alone and parameters are few; with as
    many parameters as data the weights have no effect.
    """
    size = np.abs(solution.response)
    weight = np.where(measured.use, line_weights(measured, size, eps), 0.0)
    left = weight[..., np.newaxis] * solution.slope
    matrix = (left.conj().swapaxes(1, 2) @ left).real
    share = np.where(measured.sigma > 0, measured.sigma * weight, 0.0) ** 2 / 2
    d = np.where(np.isnan(noise_dof), np.inf, np.maximum(noise_dof, _DOF_LEAST))[:, np.newaxis]
    data = 2 * np.count_nonzero(measured.use, axis=1)[:, np.newaxis]
    middle = np.sqrt(1 + share**2 * 2 / (d - 2) * (1 - left.shape[-1] / data))[..., np.newaxis] * left
    scattered = (middle.conj().swapaxes(1, 2) @ middle).real
    with np.errstate(all="ignore"):
        scale = np.sqrt(np.einsum("rii->ri", matrix))
        scaled = matrix / (scale[:, :, np.newaxis] * scale[:, np.newaxis])
        unit = np.eye(matrix.shape[-1])
        finite = np.isfinite(scaled).all(axis=(1, 2))
        inverse = np.linalg.inv(np.where(finite[:, np.newaxis, np.newaxis], scaled, unit) + _ROUNDING * unit)
        held = finite & (np.abs(inverse).max(axis=(1, 2), initial=0.0) < _CONDITION_MAX)
        inverse[~held] = np.nan
        inverse /= scale[:, :, np.newaxis] * scale[:, np.newaxis]
    return np.asarray(inverse @ scattered @ inverse)
