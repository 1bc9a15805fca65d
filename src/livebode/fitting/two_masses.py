"""Two masses behind a zero-order hold, for many positions at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

INERTIA, LOAD, STIFFNESS, DAMPING = range(4)
"""Order of the parameters, all as seen from the motor's shaft: Js and mL·r², kg m²; Keff·r², N m/rad; bs·r², N m s."""

_STEP = 1e-5


def sampled(parameters: Floats, z: Complex, rate_hz: float) -> Complex:
    """Sampled response of (14) from torque to motor velocity, exact behind a zero-order hold, rad/s per N m.

    (14) is α/s + β·s/(s² + 2δ·s + ω²) with α = 1/(Js + m), β = 1/Js − α, m = mL·r²: a rigid body and one resonance.
    With a zero-order hold, pole by pole, this is T·α/(z − 1) + β/(p1 − p2)·((E1 − 1)/(z − E1) − (E2 − 1)/(z − E2)) with
    E = e^(p·T).

    Parameters
    ----------
    parameters
        Natural logarithms in the order of this module, shape (..., 4).
    z
        e^(jωT) at each line, shape (lines,).

    Returns
    -------
    Shape (..., lines).

    Examples
    --------
    >>> belt = np.log([0.0028, 6.7 * 0.019**2, 5e5 * 0.019**2, 130 * 0.019**2])
    >>> abs(sampled(belt, np.exp(2j * np.pi * np.array([20.0, 60.0]) / 4000), 4000)).round(3)
    array([1.357, 4.604])
    """
    js, load, stiffness, damping = np.moveaxis(np.exp(parameters), -1, 0)[..., np.newaxis]
    alpha = 1 / (js + load)
    reduced = js * load * alpha
    delta = damping / (2 * reduced)
    root = np.sqrt((delta**2 - stiffness / reduced).astype(np.complex128))
    one, two = np.exp((root - delta) / rate_hz), np.exp((-root - delta) / rate_hz)
    resonance = ((one - 1) / (z - one) - (two - 1) / (z - two)) / (2 * root)
    return np.asarray(alpha / (rate_hz * (z - 1)) + (1 / js - alpha) * resonance)


def slopes(parameters: Floats, z: Complex, rate_hz: float) -> Complex:
    """Derivatives of `sampled` by each logarithm, shape (..., lines, 4); central differences, relative error 1e-9."""
    steps = _STEP * np.eye(4)
    return np.stack(
        [(sampled(parameters + h, z, rate_hz) - sampled(parameters - h, z, rate_hz)) / (2 * _STEP) for h in steps],
        axis=-1,
    )
