"""From continuous to discrete time and back, for an input that is held between its ticks."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Complex, Floats
from livebode.core import FitError
from livebode.fitting.transfer import Transfer, roots

_AT_ONE = 1e-6  # a pole this near to z = 1 is an integrator
_AROUND = 1.5
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
