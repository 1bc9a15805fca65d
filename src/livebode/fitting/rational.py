"""Discrete rational models B(z)/A(z): as a Model, and fitted to responses by Nevaranta 2016, eqs. (19) to (28)."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebode.arrays import Complex, Floats
from livebode.core import OK, FitError, Parameters, Response, Responses, UsageError, not_installed
from livebode.dataclass import dataclass
from livebode.fitting.fitter import measured_of
from livebode.fitting.problem import MeasuredRows
from livebode.fitting.rows import NO_RESPONSE, NOT_SEEN
from livebode.fitting.transfer import Transfer, to_continuous
from livebode.fitting.weights import chi_squared, own_epsilon, squares, weights

Method = Literal["levy", "sanathanan-koerner", "maximum likelihood"]

_ROUNDS = 20
_SETTLED = 1e-9
_ORDER_MAX = 20  # higher powers of z are too nearly dependent in double precision


class _Equations(NamedTuple):
    """Powers of z (lines, order + 1), the number of b's, and the measured values."""

    powers: Complex
    above: int
    measured: MeasuredRows


def fit_rational(
    measured: Response | Responses, *, order: int, numerator_order: int | None = None, method: Method = "levy"
) -> Parameters:
    """b0 … bm and a0 … a(q−1) of (b_m z^m + … + b0)/(z^q + a_(q−1) z^(q−1) + … + a0) for each Response.

    "levy": least squares of A·Ĝ − B, (19) … (27): linear, and biased by noise and towards high frequencies, where |A|
    is large. "sanathanan-koerner": the same with 1/|A| of the previous iteration, which removes the second bias;
    "maximum likelihood": least squares of (Ĝ − B/A)/sigma, started from it, unbiased to first order and best where the
    model is true. Where no sigma is known, the weight of a line is its size.

    The covariance of the first two is that of noise by sigma through the linear equations; that of the third includes
    ε, the error of B/A. `chi2` is by sigma alone; that of the first two is above `dof` also where the model is true.

    Parameters
    ----------
    order, numerator_order
        q and m; default of m: q − 1.

    Raises
    ------
    UsageError
        If the orders are invalid.
    FitError
        If there are fewer lines than they need.

    Examples
    --------
    >>> from livebode import Lines, Response
    >>> from livebode.simulation import BeltAxis
    >>> lines = Lines.parse("20:120:5", rate_hz=2000, window=400)
    >>> truth = BeltAxis().linear(0.8).sampled(2000.0).response(lines.frequency_hz)
    >>> ones = np.ones(len(lines))
    >>> exact = Response(lines, truth, 1e-3 * ones, np.inf, ones, ones > 0, 0, 399, 0.1)
    >>> fit_rational(exact, order=3)["b2"].round(4)
    array([0.1774])
    """
    responses = measured if isinstance(measured, Responses) else Responses.of(measured)
    q, m = order, order - 1 if numerator_order is None else numerator_order
    if not (1 <= q <= _ORDER_MAX and 0 <= m < q):
        raise UsageError(
            "out-of-range",
            f"{order=} with numerator order {m} is not supported",
            f"take an order from 1 to {_ORDER_MAX} and a lower one of the numerator",
            argument="order",
            value=order,
            numerator_order=m,
        )
    if method not in ("levy", "sanathanan-koerner", "maximum likelihood"):
        raise UsageError(
            "not-one-of",
            f"{method=} is not supported",
            "choose 'levy', 'sanathanan-koerner' or 'maximum likelihood'",
            argument="method",
            value=method,
            allowed=["levy", "sanathanan-koerner", "maximum likelihood"],
        )
    lines = responses.lines
    if 2 * len(lines) <= q + m + 1:
        raise FitError(
            "too-few-lines",
            f"{len(lines)} lines are too few for {q + m + 1} coefficients",
            "take a lower order or more lines",
            lines=len(lines),
            parameters=q + m + 1,
        )
    rows, _ = measured_of(responses, np.ones(len(lines), dtype=bool))
    equations = _Equations(lines.z[:, np.newaxis] ** np.arange(q + 1), m + 1, rows)
    names = tuple([f"b{i}" for i in range(m + 1)] + [f"a{i}" for i in range(q)])
    return _fitted(equations, method, names, responses)


def _fitted(equations: _Equations, method: Method, names: tuple[str, ...], responses: Responses) -> Parameters:
    measured = equations.measured
    dof = 2.0 * np.count_nonzero(measured.use, axis=1) - len(names)
    ok = dof > 0
    theta = np.full((len(dof), len(names)), np.nan)
    covariance = np.full((len(dof), len(names), len(names)), np.nan)
    chi2, epsilon = np.full(len(dof), np.nan), np.full(len(dof), np.nan)
    if ok.any():
        some = equations._replace(measured=measured[ok])
        solution, weight = _solved(some, method)
        value = _ratio(some, solution)
        eps = own_epsilon(some.measured, value, dof[ok])
        theta[ok], covariance[ok] = solution, _covariance(some, solution, weight, eps, method)
        residual, noise, _ = squares(some.measured, value)
        chi2[ok], epsilon[ok] = chi_squared(residual, noise), eps
    status = np.where(ok, OK, NO_RESPONSE).astype("<U20")
    status[ok & ~(np.isfinite(theta).all(axis=1) & np.isfinite(covariance).all(axis=(1, 2)))] = NOT_SEEN
    failed = status != OK
    theta[failed], covariance[failed], epsilon[failed] = np.nan, np.nan, np.nan
    return Parameters(
        model=f"rational, {method}", names=names, units=("",) * len(names), value=theta, covariance=covariance,
        status=status, epsilon=epsilon, chi2=chi2, dof=dof, sample=responses.sample, time_s=responses.time_s,
        schedule=responses.schedule,
    )  # fmt: skip


def _solved(equations: _Equations, method: Method) -> tuple[Floats, Floats]:
    """Coefficients (rows, n), and the weights of the linear equations (rows, lines) that gave them."""
    weight = np.where(equations.measured.use, 1.0, 0.0)
    theta = _least_squares(*_linear(equations, weight))
    if method == "levy":
        return theta, weight
    use = weight
    for _ in range(_ROUNDS):
        with np.errstate(divide="ignore", invalid="ignore"):
            weight = use / np.abs(_below(equations, theta))
        new = _least_squares(*_linear(equations, weight))
        moved = np.max(np.abs(new - theta), initial=0.0)
        theta = new
        if moved < _SETTLED:
            break
    return (theta, weight) if method == "sanathanan-koerner" else _most_likely(equations, theta)


def _most_likely(equations: _Equations, theta: Floats) -> tuple[Floats, Floats]:
    """Gauss–Newton on (Ĝ − B/A)/sigma; a step is halved until it lowers the cost."""
    measured = equations.measured
    size = np.abs(measured.value)
    weight = _noise_weights(measured, size, np.zeros(len(theta)))
    cost = _cost(equations, theta, weight)
    for _ in range(_ROUNDS):
        left = weight[..., np.newaxis] * _gradient(equations, theta)
        right = weight * np.where(measured.use, measured.value - _ratio(equations, theta), 0.0)
        step = _least_squares(left, right)
        for _ in range(_ROUNDS):
            new = _cost(equations, theta + step, weight)
            worse = ~(new <= cost)
            if not worse.any():
                break
            step[worse] /= 2
        step[worse] = 0.0
        theta, cost = theta + step, np.where(worse, cost, new)
        if np.max(np.abs(step), initial=0.0) < _SETTLED:
            break
    return theta, weight


def _cost(equations: _Equations, theta: Floats, weight: Floats) -> Floats:
    measured = equations.measured
    residual = np.where(measured.use, measured.value - _ratio(equations, theta), 0.0)
    return np.asarray(np.sum(np.abs(weight * residual) ** 2, axis=1))


def _covariance(equations: _Equations, theta: Floats, weight: Floats, eps: Floats, method: Method) -> Floats:
    """An error of Ĝ enters the linear equations multiplied by A, the nonlinear ones unchanged."""
    measured = equations.measured
    size = np.where(measured.use, np.abs(_ratio(equations, theta)), 0.0)
    if method == "maximum likelihood":
        left = weight[..., np.newaxis] * _gradient(equations, theta)
        entering = weight
    else:
        left, _ = _linear(equations, weight)
        eps = np.where((measured.sigma > 0).any(axis=1), 0.0, eps)
        entering = weight * np.abs(_below(equations, theta))
    with np.errstate(divide="ignore", invalid="ignore"):
        deviation = np.where(measured.use, 1 / _noise_weights(measured, size, eps), 0.0)  # of each part
    stacked = np.concatenate([left.real, left.imag], axis=1)
    scatter = np.tile(entering * deviation, 2)
    q, r = np.linalg.qr(stacked)
    with np.errstate(all="ignore"):
        good = np.abs(np.einsum("rii->ri", r)).min(axis=1) > 0
        inverse = np.full(r.shape, np.nan)
        inverse[good] = np.linalg.inv(r[good])
        through = inverse @ (q.swapaxes(1, 2) * scatter[:, np.newaxis])
    return np.asarray(through @ through.swapaxes(1, 2))


def _noise_weights(measured: MeasuredRows, size: Floats, eps: Floats) -> Floats:
    """Weights as those of `weights`; by size where no noise is known."""
    by_noise = weights(measured.sigma, size, eps)
    unknown = ~((by_noise > 0) & measured.use).any(axis=1)
    by_noise[unknown] = weights(measured.sigma[unknown], size[unknown], np.ones(np.count_nonzero(unknown)))
    return np.where(measured.use, by_noise, 0.0)


def _linear(equations: _Equations, weight: Floats) -> tuple[Complex, Complex]:
    """B − Σ a_i z^i·Ĝ = z^q·Ĝ, each line weighed: left (rows, lines, n) and right (rows, lines)."""
    powers, count, measured = equations.powers, equations.above, equations.measured
    value = np.where(measured.use, measured.value, 0.0)
    above = np.broadcast_to(powers[:, :count], (*value.shape, count))
    below = -value[..., np.newaxis] * powers[:, :-1]
    left = np.concatenate([above, below], axis=-1) * weight[..., np.newaxis]
    return np.asarray(left, dtype=np.complex128), np.asarray(weight * value * powers[:, -1], dtype=np.complex128)


def _least_squares(left: Complex, right: NDArray[Any]) -> Floats:
    stacked = np.concatenate([left.real, left.imag], axis=1)
    q, r = np.linalg.qr(stacked)
    turned = q.swapaxes(1, 2) @ np.concatenate([right.real, right.imag], axis=1)[..., np.newaxis]
    regular = np.abs(np.einsum("rii->ri", r)).min(axis=1) > 0
    solution = np.full(turned.shape[:2], np.nan)
    solution[regular] = np.linalg.solve(r[regular], turned[regular])[..., 0]
    return solution


def _below(equations: _Equations, theta: Floats) -> Complex:
    """A at the lines, (rows, lines)."""
    powers, count = equations.powers, equations.above
    return np.asarray(theta[:, count:] @ powers[:, :-1].T + powers[:, -1])


def _ratio(equations: _Equations, theta: Floats) -> Complex:
    powers, count = equations.powers, equations.above
    return np.asarray((theta[:, :count] @ powers[:, :count].T) / _below(equations, theta))


def _gradient(equations: _Equations, theta: Floats) -> Complex:
    """Gradient of B/A by the coefficients, (rows, lines, n)."""
    powers, count = equations.powers, equations.above
    below = 1 / _below(equations, theta)[..., np.newaxis]
    ratio = _ratio(equations, theta)[..., np.newaxis]
    return np.concatenate([below * powers[:, :count], -ratio * below * powers[:, :-1]], axis=-1)


@dataclass(frozen=True, eq=False)
class Rational:
    """B(z)/A(z) with coefficients from the highest power on, at a rate; a Model.

    Examples
    --------
    >>> integrator = Rational(np.array([0.01]), np.array([1.0, -1.0]), rate_hz=100.0)
    >>> abs(integrator.response(5.0)).round(4), integrator.continuous().numerator.round(6)
    (np.float64(0.032), array([1.]))
    """

    numerator: Floats
    denominator: Floats
    rate_hz: float

    def response(self, frequency_hz: ArrayLike) -> Complex:
        z = np.exp(2j * np.pi * np.asarray(frequency_hz, dtype=np.float64) / self.rate_hz)
        return np.asarray(np.polyval(self.numerator, z) / np.polyval(self.denominator, z))

    def continuous(self) -> Transfer:
        """The system in s whose zero-order-hold equivalent this is; see `to_continuous`."""
        return to_continuous(self.numerator, self.denominator, self.rate_hz)

    def to_tf(self) -> Any:
        """python-control TransferFunction in z (extra `control`)."""
        try:
            import control
        except ImportError:
            raise not_installed("python-control is not installed", package="control", extra="control") from None
        return control.tf(self.numerator, self.denominator, 1 / self.rate_hz)


def rational_of(parameters: Parameters, row: int, rate_hz: float) -> Rational:
    """One row of the result of `fit_rational`, as a Model."""
    m = sum(name.startswith("b") for name in parameters.names)
    value = parameters.value[row]
    return Rational(value[:m][::-1], np.concatenate([[1.0], value[m:][::-1]]), rate_hz)
