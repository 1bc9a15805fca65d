"""Transfer functions in s for many parameters at once: poles, zeros, and sampling behind a hold."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Complex, Floats
from livebode.core import FitError

_APART = 1e-5  # poles nearer to each other than this share of their size are moved apart
_TINY = 1e-300


class Transfer(NamedTuple):
    """N(s)/(s^integrators · D(s)): coefficients from the highest power on, shape (..., degree + 1).

    The shapes of both are broadcast, so that several numerators may share a denominator.
    """

    numerator: Floats
    denominator: Floats
    integrators: int

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
        ticks = np.asarray(delay_s, dtype=np.float64) * rate_hz
        whole = np.floor(ticks)
        late = (ticks - whole)[..., np.newaxis, np.newaxis] if np.any(ticks) else None
        response: Any = 0.0
        if self.denominator.shape[-1] > 1:
            poles = self.poles()
            poles[poles == 0] = _TINY**0.1  # a pole that friction hardly moves: equivalent to an integrator
            weights = (self._residues(poles) / poles)[..., np.newaxis, :]
            poles = poles[..., np.newaxis] * tick
            end: Any = np.expm1(poles)
            sampled = 1 / ((z - 1)[..., np.newaxis, :] - end)
            if late is None:
                weights = weights * end[..., np.newaxis, :, 0]
            else:
                soon = np.expm1(poles * (1 - late))
                sampled *= soon + (end - soon) / z[..., np.newaxis, :]
            response = (weights @ sampled)[..., 0, :]
        for order, weight in enumerate(self._at_rest(), 1):
            response = response + weight[..., np.newaxis] * _integrated(order, z, tick, late)
        if np.any(whole):
            response = response * z ** -whole[..., np.newaxis]
        return np.asarray(response)

    def poles(self) -> Complex:
        """Poles without the integrators, shape (..., poles); equal ones are moved apart by a hundred-thousandth."""
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
