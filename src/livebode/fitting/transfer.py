"""Transfer functions in s for many parameters at once: poles, zeros, sampling behind a hold, and back from z."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Complex, Flags, Floats
from livebode.core import FitError

_APART = 1e-5  # poles nearer to each other than this share of their size are moved apart
_SLOW = 2e-7  # of the lowest line: beside an integrator the residue of a slower pole loses more digits than it is worth
_TINY = 1e-300  # avoids 0/0, and vanishes beside any other number


class Transfer(NamedTuple):
    """N(s)/(s^integrators · D(s)): coefficients from the highest power on, shape (..., degree + 1).

    The shapes of both are broadcast, so that several numerators may share a denominator. `known` are the
    roots of D, where they are known.
    """

    numerator: Floats
    denominator: Floats
    integrators: int
    known: Complex | None = None

    @classmethod
    def of(cls, numerator: Sequence[ArrayLike], denominator: Sequence[ArrayLike]) -> Transfer:
        """From coefficients that are numbers or arrays of one shape; powers of s that both have are cancelled.

        Raises
        ------
        FitError
            If the numerator's degree is not below the denominator's, or there are more than two integrators.
        """
        n, d = ([np.asarray(c, dtype=np.float64) for c in part] for part in (numerator, denominator))
        while len(n) > 1 and len(d) > 1 and not n[-1].any() and not d[-1].any():
            n, d = n[:-1], d[:-1]
        integrators = 0
        while len(d) > 1 and not d[-1].any():
            d, integrators = d[:-1], integrators + 1
        if integrators > 2 or len(n) >= len(d) + integrators:
            raise FitError(
                "not-proper",
                f"a transfer function with numerator degree {len(n) - 1}, denominator degree "
                f"{len(d) - 1 + integrators} and {integrators} integrators cannot be sampled",
                "define one that is strictly proper, with at most two integrators",
                numerator_degree=len(n) - 1,
                denominator_degree=len(d) - 1 + integrators,
                integrators=integrators,
            )
        return cls(_stacked(n), _stacked(d), integrators)

    def response(self, s: Complex) -> Complex:
        """On the s axis, without a hold; s of shape (lines,), result (..., lines)."""
        s = np.asarray(s)
        return np.asarray(
            _valued(self.numerator[..., np.newaxis, :], s)
            / (_valued(self.denominator[..., np.newaxis, :], s) * s**self.integrators)
        )

    def sampled(self, z: Complex, rate_hz: float, delay_s: ArrayLike = 0.0) -> Complex:
        """Sampled response behind a zero-order hold and a delay, exact, shape (..., lines); z (lines,) or (..., lines).

        Each pole p with residue r holds and samples to r·(Γ0 + Γ1/z)/(z − e^(pT)), where the input of the tick before
        acts for the share θ of a tick by which the delay exceeds whole ticks: Γ0 = (e^(p(1−θ)T) − 1)/p,
        Γ1 = e^(p(1−θ)T)·(e^(pθT) − 1)/p.
        """
        tick = 1 / rate_hz
        if self.integrators == 1 and (slow := self._slow(float(np.abs(z - 1).min(initial=2.0)) * rate_hz)).any():
            return self._with_integrators(slow, z, rate_hz, delay_s)
        ticks = np.asarray(delay_s, dtype=np.float64) * rate_hz
        whole = np.floor(ticks)
        late = (ticks - whole)[..., np.newaxis, np.newaxis] if np.any(ticks) else None
        response: Any = 0.0
        if self.denominator.shape[-1] > 1:
            poles = self.poles()
            poles[poles == 0] = _TINY**0.1  # a pole that friction hardly moves: equivalent to an integrator
            weights = (self._residues(poles) / poles)[..., np.newaxis, :]
            poles = poles[..., np.newaxis] * tick
            with np.errstate(over="ignore", invalid="ignore"):  # of a trial far from stable; its search leaves it
                response = _held(weights, poles, z, late)
        for order, weight in enumerate(self._at_rest(), 1):
            response = response + weight[..., np.newaxis] * _integrated(order, z, tick, late)
        if np.any(whole):
            response = response * z ** -whole[..., np.newaxis]
        return np.asarray(response)

    def _slow(self, lowest: float) -> Flags:
        """Which rows have a pole, by a friction that is almost nothing, that is an integrator for ω ≥ `lowest`."""
        of = self.denominator
        if of.shape[-1] == 1:
            return np.zeros(of.shape[:-1], dtype=np.bool_)
        return np.asarray(np.abs(of[..., -1]) < _SLOW * lowest * np.abs(of[..., -2]))

    def _with_integrators(self, slow: Flags, z: Complex, rate_hz: float, delay_s: ArrayLike) -> Complex:
        """As `sampled`, with an integrator in place of the slowest pole of these rows."""
        rows = np.broadcast_shapes(slow.shape, self.numerator.shape[:-1], np.shape(delay_s), z.shape[:-1])
        n, d = (np.broadcast_to(x, (*rows, x.shape[-1])) for x in (self.numerator, self.denominator))
        z = np.broadcast_to(z, (*rows, z.shape[-1]))
        poles = np.broadcast_to(self.poles(), (*rows, d.shape[-1] - 1))
        slow, delay_s = np.broadcast_to(slow, rows), np.broadcast_to(delay_s, rows)
        others = np.take_along_axis(poles, np.argsort(np.abs(poles), axis=-1)[..., 1:], axis=-1)
        response = np.empty(z.shape, dtype=np.complex128)
        for chosen, of in (
            (slow, Transfer(n[slow], d[slow][..., :-1], 2, others[slow])),
            (~slow, Transfer(n[~slow], d[~slow], 1, poles[~slow])),
        ):
            response[chosen] = of.sampled(z[chosen], rate_hz, delay_s[chosen])
        return response

    def poles(self) -> Complex:
        """Poles without the integrators, shape (..., poles); equal ones are moved apart by a hundred-thousandth."""
        if self.known is not None:
            return self.known.copy()
        poles = roots(self.denominator)
        if poles.shape[-1] == 2:
            near = np.abs(poles[..., 0] - poles[..., 1]) < _APART * np.abs(poles[..., 0])
            if near.any():
                poles[near] = poles[near].mean(axis=-1, keepdims=True) * np.array([1 - _APART, 1 + _APART])
        return poles

    def zeros(self) -> Complex:
        """Shape (..., zeros)."""
        return roots(self.numerator)

    def _residues(self, poles: Complex) -> Complex:
        """Residue of each pole, shape (..., poles)."""
        apart = poles[..., :, np.newaxis] - poles[..., np.newaxis, :]
        index = np.arange(poles.shape[-1])
        apart[..., index, index] = self.denominator[..., :1]
        below = np.prod(apart, axis=-1) * poles**self.integrators
        return np.asarray(_valued(self.numerator[..., np.newaxis, :], poles) / below)

    def _at_rest(self) -> list[Floats]:
        """Weights of 1/s and, with two integrators, of 1/s²."""
        if self.integrators == 0:
            return []
        n, d = self.numerator, self.denominator
        constant = n[..., -1] / d[..., -1]
        if self.integrators == 1:
            return [constant]
        n1: Any = n[..., -2] if n.shape[-1] > 1 else 0.0
        d1: Any = d[..., -2] if d.shape[-1] > 1 else 0.0
        return [(n1 - constant * d1) / d[..., -1], constant]


def roots(polynomial: Floats) -> Complex:
    """Roots of polynomials (..., degree + 1), by size and then by imaginary part, shape (..., degree)."""
    degree = polynomial.shape[-1] - 1
    if degree == 0:
        return np.empty((*polynomial.shape[:-1], 0), dtype=np.complex128)
    monic = polynomial[..., 1:] / polynomial[..., :1]
    if degree == 1:
        return -monic.astype(np.complex128)
    if degree == 2:
        half = -monic[..., 0] / 2
        turn = np.sqrt((half**2 - monic[..., 1]).astype(np.complex128))
        # The larger root first: the difference of half and turn would lose the smaller one's digits.
        large = half - np.where(half > 0, -1, 1) * np.where(turn.imag == 0, turn, -turn)
        return np.stack([monic[..., 1] / np.where(large == 0, _TINY, large), large], axis=-1)
    power = np.arange(1, degree + 1)
    scale = np.max(np.abs(monic) ** (1 / power), axis=-1, keepdims=True) + _TINY
    companion = np.zeros((*monic.shape[:-1], degree, degree))
    companion[..., 0, :] = -monic / scale**power
    companion[..., np.arange(1, degree), np.arange(degree - 1)] = 1.0
    poles = np.linalg.eigvals(np.where(np.isfinite(companion), companion, 0.0)) * scale
    return _by_size(poles)


def _by_size(values: Complex) -> Complex:
    size = np.round(np.abs(values) / np.max(np.abs(values) + _TINY, axis=-1, keepdims=True), 9)
    order = np.lexsort((values.imag, size))
    return np.take_along_axis(values, order, axis=-1)


def _valued(polynomial: Floats, places: Complex) -> Complex:
    """Values of polynomials (..., 1, degree + 1) at places (..., places), by Horner."""
    value: Any = polynomial[..., 0]
    for i in range(1, polynomial.shape[-1]):
        value = value * places + polynomial[..., i]
    return np.asarray(value)


def _held(weights: Complex, poles: Complex, z: Complex, late: Floats | None) -> Complex:
    """Sum of the sampled responses of poles·T, (..., poles, 1), with the weights r/p, (..., 1, poles)."""
    end: Any = np.expm1(poles)
    sampled = 1 / ((z - 1)[..., np.newaxis, :] - end)
    if late is None:
        weights = weights * end[..., np.newaxis, :, 0]
    else:
        soon = np.expm1(poles * (1 - late))
        sampled *= soon + (end - soon) / z[..., np.newaxis, :]
    return np.asarray((weights @ sampled)[..., 0, :])


def _integrated(order: int, z: Complex, tick: float, late: Floats | None) -> Complex:
    """1/s or 1/s² behind the hold and a share of a tick's delay."""
    if late is None:
        return np.asarray(tick / (z - 1) if order == 1 else tick**2 / 2 * (z + 1) / (z - 1) ** 2)
    soon = (1 - late[..., 0]) * tick
    speed = (soon + (tick - soon) / z) / (z - 1)
    if order == 1:
        return np.asarray(speed)
    return np.asarray((soon**2 / 2 + (tick**2 - soon**2) / 2 / z + tick * speed) / (z - 1))


def _stacked(coefficients: list[Floats]) -> Floats:
    return np.stack(np.broadcast_arrays(*coefficients), axis=-1)


_AT_ONE = 1e-6  # a pole this near to z = 1 is an integrator
_AROUND = 1.5  # of the distance of the poles from 1: a circle around all of them
_NEAR = 1e-6


def to_discrete(transfer: Transfer, rate_hz: float, delay_s: float = 0.0) -> tuple[Floats, Floats]:
    """Coefficients of numerator and denominator in z of one system behind a zero-order hold and a delay ≥ 0.

    Exact; a delay adds poles at zero. For a single Transfer, whose coefficients have no further axes. Modes far slower
    than the rate are close to z = 1, where coefficients lose digits: a hundredth of the rate leaves six.

    Examples
    --------
    >>> numerator, denominator = to_discrete(Transfer.of([1.0], [0.5, 0.0]), 100.0)
    >>> numerator.round(12), denominator
    (array([0.02]), array([ 1., -1.]))
    """
    if delay_s < 0:
        raise FitError(
            "not-causal",
            f"{delay_s=:g} is negative, and no discrete system responds before its input",
            "hold the delay at 0",
            delay_s=float(delay_s),
        )
    poles = np.exp(transfer.poles() / rate_hz)
    places = np.concatenate([poles, np.ones(transfer.integrators)])
    ticks = delay_s * rate_hz
    late = int(np.floor(ticks)) + int(ticks != np.floor(ticks))
    denominator = np.concatenate([np.poly(places).real, np.zeros(late)])
    # The numerator is a polynomial in z − 1, found from its values on a circle around 1, about as wide as the poles.
    count = len(denominator) - 1
    around = _AROUND * min(max(np.max(np.abs(places - 1)), _NEAR), 2.0)
    turn = np.exp(2j * np.pi * (np.arange(count) + 0.3) / count)
    values = transfer.sampled(1 + around * turn, rate_hz, delay_s) * np.polyval(denominator, 1 + around * turn)
    powers = (around * turn[:, np.newaxis]) ** np.arange(count)
    coefficients = np.linalg.solve(powers, values).real
    numerator = np.zeros(count)
    for power, coefficient in enumerate(coefficients):
        numerator[count - 1 - power :] += coefficient * np.poly(np.ones(power))
    return numerator, denominator


def to_continuous(numerator: ArrayLike, denominator: ArrayLike, rate_hz: float) -> Transfer:
    """The system in s that a zero-order hold samples to this one in z, with its modes below the Nyquist frequency.

    Raises
    ------
    FitError
        If a pole is on the negative real axis or at zero (no system in s has one there), or the numerator's degree is
        not below the denominator's. Poles that coincide, other than two at z = 1, cannot be separated.

    Examples
    --------
    >>> back = to_continuous(*to_discrete(Transfer.of([3.0], [1.0, 20.0, 1e4]), 1000.0), 1000.0)
    >>> (back.denominator / back.denominator[0]).round(6), abs(back.numerator / back.denominator[0]).round(6)
    (array([1.e+00, 2.e+01, 1.e+04]), array([0., 3.]))
    """
    n, d = (_trimmed(np.atleast_1d(np.asarray(x, dtype=np.float64))) for x in (numerator, denominator))
    if len(n) >= len(d):
        raise FitError(
            "not-proper",
            f"a system of numerator degree {len(n) - 1} and denominator degree {len(d) - 1} responds without delay, "
            "which no sampled system does",
            "take a lower degree of the numerator",
            numerator_degree=len(n) - 1,
            denominator_degree=len(d) - 1,
        )
    places = roots(d)
    resting = np.abs(places - 1) < np.sqrt(_AT_ONE)
    integrators = int(np.count_nonzero(resting))
    if integrators == 1:
        resting = np.abs(places - 1) < _AT_ONE
        integrators = int(np.count_nonzero(resting))
    moving = places[~resting]
    if np.any((moving.real <= 0) & (np.abs(moving.imag) < 1e-12 * np.abs(moving))):
        bad = moving[(moving.real <= 0) & (np.abs(moving.imag) < 1e-12 * np.abs(moving))][0].real
        raise FitError(
            "no-continuous-model",
            f"the pole z = {bad:.6g} has no counterpart in s",
            "take another order, or a higher rate",
            pole=float(bad),
        )
    poles = np.log(moving) * rate_hz
    held = np.concatenate([(moving - 1) / poles, np.ones(integrators)])
    parts = _parts(n, d[0], moving, integrators)
    tick = 1 / rate_hz
    weights = parts[: len(moving)] / held[: len(moving)]
    of_integrators = parts[len(moving) :]
    if integrators == 2:
        double = of_integrators[1] / tick**2
        of_integrators = np.array([(of_integrators[0] - tick**2 / 2 * double) / tick, double])
    elif integrators == 1:
        of_integrators = of_integrators / tick
    below = np.poly(np.concatenate([poles, np.zeros(integrators)]))
    above = np.zeros(len(below) - 1, dtype=np.complex128)
    for i, weight in enumerate(weights):
        others = np.concatenate([np.delete(poles, i), np.zeros(integrators)])
        above += weight * np.poly(others)
    for i, weight in enumerate(of_integrators):
        others = np.concatenate([poles, np.zeros(integrators - 1 - i)])
        above[len(above) - len(others) - 1 :] += weight * np.poly(others)
    return Transfer(above.real, np.asarray(np.poly(poles).real, dtype=np.float64), integrators)


def _parts(n: Floats, lead: float, poles: Complex, integrators: int) -> Complex:
    """Weights of 1/(z − pole), and of 1/(z − 1) and 1/(z − 1)², solved at as many points as there are unknowns."""
    count = len(poles) + integrators
    z = _AROUND * np.exp(2j * np.pi * (np.arange(count) + 0.3) / count)
    columns = [1 / (z - p) for p in poles] + [1 / (z - 1) ** (i + 1) for i in range(integrators)]
    value = np.polyval(n, z) / (lead * np.polyval(np.poly(np.concatenate([poles, np.ones(integrators)])), z))
    return np.asarray(np.linalg.solve(np.array(columns).T, value))


def _trimmed(coefficients: Floats) -> Floats:
    """Without leading coefficients that are rounding errors."""
    size = np.max(np.abs(coefficients), initial=0.0)
    above = np.flatnonzero(np.abs(coefficients) > 1e-12 * size)
    return coefficients[above[0] :] if above.size else coefficients[-1:]
