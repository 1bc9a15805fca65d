"""Pairs of masses joined by a belt, under a measured torque, without control and friction."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from livebode.arrays import Floats
from livebode.core import SimulationError
from livebode.simulation._axis import two_masses


class Pair(NamedTuple):
    """Motor and load: inertia, kg m², load, kg, and factors on the stiffness and the damping of the belt."""

    inertia_kg_m2: float
    load_kg: float
    stiffness: float = 1.0
    damping: float = 1.0


def open_belt(
    pairs: list[Pair],
    torque_n_m: Floats,
    stiffness_n_per_m: Floats,
    damping_n_s_per_m: Floats,
    *,
    rate_hz: float,
    radius_m: float,
    carts: bool = True,
) -> tuple[Floats, Floats]:
    """Velocities of motors (rad/s) and carts (m/s), shape (pairs, samples) each, from rest.

    Eight pairs cost little more than one. Stiffness, damping and torque are constant within a sample; a step is a
    Taylor series of order 8, the order of the `Engine`.

    Parameters
    ----------
    torque_n_m
        Shape (samples,) for all pairs, or (pairs, samples).
    stiffness_n_per_m, damping_n_s_per_m
        Of the belt at each sample, shape (samples,).
    carts
        Whether the velocities of the carts are returned; if not, they have no rows.

    Raises
    ------
    SimulationError
        If a pair diverges.

    Examples
    --------
    >>> flat = np.ones(4)
    >>> motor, cart = open_belt([Pair(0.003, 6.7)], flat, 5e5 * flat, 100 * flat, rate_hz=4000, radius_m=0.019)
    >>> motor.round(3)
    array([[0.   , 0.083, 0.166, 0.247]])
    """
    torque = np.atleast_2d(torque_n_m)
    motor, cart = (np.empty((rows, torque.shape[1])) for rows in (len(pairs), len(pairs) if carts else 0))
    two_masses(rate_hz, radius_m, np.array(pairs, dtype=np.float64), stiffness_n_per_m, damping_n_s_per_m, torque,
               motor, cart)  # fmt: skip
    # What is not finite remains so until the end.
    if not (np.isfinite(motor[:, -1:]).all() and np.isfinite(cart[:, -1:]).all()):
        finite = np.isfinite(np.vstack([motor, cart]))
        raise SimulationError(
            "diverged",
            "the model diverges under this torque",
            "check the signals and their units",
            sample=int(np.argmin(finite.all(axis=0))),
        )
    return motor, cart
