"""Two masses behind a zero-order hold: at many positions at once, and fitted to each response alone."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.fitting import two_masses
from livebode.fitting.least_squares import minimise
from livebode.kernel import BeltGrid, BeltRows, belt_each, belt_response

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
    values = np.asarray(parameters, dtype=np.float64)
    response = belt_response(BeltGrid.of(z, rate_hz), np.ascontiguousarray(values.reshape(-1, 4)))
    return response.reshape(*values.shape[:-1], len(z))


_SCANNED = 10
_QUALITY = 10.0  # of the scanned resonances; Table I has it


def fit_windows(value: Complex, weight: Floats, z: Complex, rate_hz: float, start: Floats) -> tuple[Floats, Floats]:
    """Weighted least squares for each row of `value`: logarithms of the four parameters, (rows, 4), and cost (rows,).

    `weight` (rows, lines) is one over the standard deviation, up to a factor; start (rows, 4).
    """

    grid, rows = BeltGrid.of(z, rate_hz), BeltRows(np.ascontiguousarray(value), np.ascontiguousarray(weight))
    minimum = minimise(lambda parameters: belt_each(grid, rows, parameters), start)
    return minimum.parameters, minimum.cost


def scan(value: Complex, weight: Floats, z: Complex, rate_hz: float) -> tuple[Floats, Floats]:
    """Best fit without a start: ten resonances from half the lowest to twice the highest line, the best of ten fits.

    A fit that starts at twice or half the stiffness ends in a false minimum, so each of the ten is tried. For a given
    resonance the response is linear in 1/(Js + m) and 1/Js − 1/(Js + m), which gives its two inertias.
    """
    f_hz = np.abs(np.angle(z)) * rate_hz / (2 * np.pi)
    resonances = 2 * np.pi * np.geomspace(f_hz.min() / 2, f_hz.max() * 2, _SCANNED)
    start = np.concatenate([_with_resonance(omega, value, weight, z, rate_hz) for omega in resonances])
    logarithms, cost = fit_windows(np.tile(value, (_SCANNED, 1)), np.tile(weight, (_SCANNED, 1)), z, rate_hz, start)
    costs = cost.reshape(_SCANNED, -1)
    best, rows = np.argmin(costs, axis=0), np.arange(len(value))
    return logarithms.reshape(_SCANNED, -1, 4)[best, rows], costs[best, rows]


def _with_resonance(omega: float, value: Complex, weight: Floats, z: Complex, rate_hz: float) -> Floats:
    unit = np.log([2.0, 2.0, omega**2, omega / _QUALITY])  # reduced inertia 1: α = 1/4, β = 1/4
    rigid = 1 / (rate_hz * (z - 1))
    parts = np.stack([rigid, 4 * two_masses.sampled(unit, z, rate_hz) - rigid], axis=-1)
    left = weight[..., np.newaxis] * parts
    left, right = np.concatenate([left.real, left.imag], axis=-2), weight * value
    right = np.concatenate([right.real, right.imag], axis=-1)
    solved = np.linalg.solve(left.swapaxes(-1, -2) @ left, (left.swapaxes(-1, -2) @ right[..., np.newaxis]))[..., 0]
    alpha = np.maximum(solved[:, 0], 1e-3 * np.abs(solved).max(axis=1) + 1e-300)
    beta = np.maximum(solved[:, 1], 1e-3 * alpha)
    js, load = 1 / (alpha + beta), beta / (alpha * (alpha + beta))
    reduced = js * load * alpha
    return np.asarray(np.log(np.stack([js, load, reduced * omega**2, reduced * omega / _QUALITY], axis=-1)))
