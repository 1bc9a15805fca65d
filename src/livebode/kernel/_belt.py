"""Two masses joined by a belt, behind a zero-order hold, in C; `tests/twins/belt.py` defines them.

Parameters are natural logarithms of what the motor's shaft sees: its inertia and that of the load, kg m²; stiffness,
N m/rad; damping, N m s.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.kernel import _native


class BeltGrid(NamedTuple):
    """Lines of a response.

    Attributes
    ----------
    rate_hz
        Rate of the loop.
    step, theta
        z − 1, and the angle of z, at each line, shape (lines,).
    """

    rate_hz: float
    step: Complex
    theta: Floats

    @classmethod
    def of(cls, z: Complex, rate_hz: float) -> BeltGrid:
        """For e^(jωT) at each line."""
        return cls(rate_hz, np.ascontiguousarray(z - 1), np.ascontiguousarray(np.angle(z)))


class BeltRows(NamedTuple):
    """Measured responses, and one over their standard deviations up to a factor, shape (rows, lines)."""

    value: Complex
    weight: Floats


class BeltSplines(NamedTuple):
    """Value of each spline of the logarithm of the stiffness, and of the damping, shape (rows, splines) each."""

    stiffness: Floats
    damping: Floats


class BeltNormal(NamedTuple):
    """Σ (weight·|rest|)² of each problem, shape (problems,); its gradient over two, (problems, unknowns); and its
    Gauss–Newton matrix, (problems, unknowns, unknowns)."""

    cost: Floats
    gradient: Floats
    matrix: Floats

    @classmethod
    def empty(cls, problems: int, unknowns: int) -> BeltNormal:
        return cls(np.empty(problems), np.empty((problems, unknowns)), np.empty((problems, unknowns, unknowns)))


class BeltMasses(NamedTuple):
    """Inertia of the motor, load of the cart, and radius of the pulley."""

    inertia_kg_m2: float
    load_kg: float
    radius_m: float


class BeltCourse(NamedTuple):
    """Stiffness and damping of the belt and torque of the motor, constant within each tick, shape (ticks,) each."""

    rate_hz: float
    stiffness_n_per_m: Floats
    damping_n_s_per_m: Floats
    torque_n_m: Floats


def belt_response(grid: BeltGrid, parameters: Floats) -> Complex:
    """Sampled response from torque to motor velocity of each row of parameters, shape (rows, lines)."""
    response = np.empty((len(parameters), len(grid.step)), np.complex128)
    _native.belt_response(grid, parameters, response)
    return response


def belt_each(grid: BeltGrid, rows: BeltRows, parameters: Floats) -> BeltNormal:
    """Normal equations of each row by itself, at parameters of shape (rows, 4)."""
    normal = BeltNormal.empty(len(parameters), 4)
    _native.belt_each(grid, rows, parameters, normal)
    return normal


def belt_together(grid: BeltGrid, rows: BeltRows, splines: BeltSplines, unknowns: Floats) -> BeltNormal:
    """Normal equations of all rows together: one problem.

    The unknowns are the logarithms of both inertias, the weights of the splines, and a delay of the response in
    samples, shape (3 + splines,).
    """
    normal = BeltNormal.empty(1, len(unknowns))
    _native.belt_together(grid, rows, splines, unknowns, normal)
    return normal


def belt_replay(masses: BeltMasses, course: BeltCourse) -> tuple[Floats, Floats]:
    """Velocities of motor, rad/s, and cart, m/s, at the beginning of each tick, from rest, shape (ticks,) each.

    Without control and friction. If the belt diverges, the last values are not finite.
    """
    velocities = np.empty(len(course.torque_n_m)), np.empty(len(course.torque_n_m))
    _native.belt_replay(masses, course, velocities)
    return velocities
