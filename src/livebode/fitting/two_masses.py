"""Two masses behind a zero-order hold, for many positions at once."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.kernel import BeltGrid, belt_response

INERTIA, LOAD, STIFFNESS, DAMPING = range(4)
"""Order of the parameters, all as seen from the motor's shaft: Js and mL·r², kg m²; Keff·r², N m/rad; bs·r², N m s."""


def sampled(parameters: Floats, z: Complex, rate_hz: float) -> Complex:
    """Sampled response of (14) from torque to motor velocity, exact behind a zero-order hold, rad/s per N m.

    (14) is α/s + β·s/(s² + 2δ·s + ω²) with α = 1/(Js + m), β = 1/Js − α, m = mL·r²: a rigid body and one resonance.
    `tests/twins/belt.py` has its equation behind a zero-order hold.

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
    at = np.asarray(parameters, dtype=np.float64)
    found = belt_response(BeltGrid.of(z, rate_hz), np.ascontiguousarray(at.reshape(-1, 4)))
    return found.reshape(*at.shape[:-1], len(z))
