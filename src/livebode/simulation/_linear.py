"""Linear models of the belt drive, continuous and sampled: the truth that estimates are compared with."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Complex, Floats
from livebode.core import Algebra
from livebode.dataclass import dataclass
from livebode.simulation.axis_settings import Friction
from livebode.simulation.hold import held
from livebode.simulation.mechanics import Mechanics, Spans

Output = Literal["velocity", "position", "cart"]


@dataclass(frozen=True)
class BeltResponse(Algebra):
    """Motor velocity over torque of two masses without friction, rad/s per N m, by formula (Nevaranta 2016, (14)).

    >>> belt = BeltResponse(0.0028, 6.7, 0.019, stiffness_n_per_m=5e5, damping_n_s_per_m=130)
    >>> round(belt.resonance_hz, 2), round(belt.antiresonance_hz, 2)
    (59.36, 43.48)
    """

    inertia_kg_m2: float
    load_kg: float
    radius_m: float
    stiffness_n_per_m: float
    damping_n_s_per_m: float

    def response(self, frequency_hz: ArrayLike) -> Complex:
        s = 2j * np.pi * np.asarray(frequency_hz, dtype=np.float64)
        belt = self.damping_n_s_per_m * s + self.stiffness_n_per_m
        free = self.load_kg * s**2 + belt
        return np.asarray(free / (self._total * s * (self._reduced * s**2 + belt)))

    @property
    def resonance_hz(self) -> float:
        """Undamped."""
        return float(np.sqrt(self.stiffness_n_per_m / self._reduced) / (2 * np.pi))

    @property
    def antiresonance_hz(self) -> float:
        """Undamped."""
        return float(np.sqrt(self.stiffness_n_per_m / self.load_kg) / (2 * np.pi))

    @property
    def _total(self) -> float:
        return self.inertia_kg_m2 + self.load_kg * self.radius_m**2

    @property
    def _reduced(self) -> float:
        return self.inertia_kg_m2 * self.load_kg / self._total


@dataclass(frozen=True, eq=False)
class StateSpace(Algebra):
    """x' = A·x + b·torque, out = c·x; frequencies above 0.

    A and b are of the states of the simulation: angle and speed of each pulley, then position and speed of the cart.
    """

    a: Floats
    b: Floats
    c: Floats

    def response(self, frequency_hz: ArrayLike) -> Complex:
        s = 2j * np.pi * np.asarray(frequency_hz, dtype=np.float64)
        return _resolvent(self.a, self.b, self.c, np.asarray(s, dtype=np.complex128))

    def sampled(self, rate_hz: float) -> Sampled:
        """This model behind a zero-order hold, read at the ticks: exact."""
        return Sampled(*held(self.a, self.b, 1 / rate_hz), self.c, rate_hz)

    def out(self, output: Output) -> StateSpace:
        """This plant with another output: motor velocity, rad/s, motor angle, rad, or cart position, m."""
        c = np.zeros(len(self.b))
        c[{"velocity": 1, "position": 0, "cart": -2}[output]] = 1.0
        return replace(self, c=c)


@dataclass(frozen=True, eq=False)
class Sampled(Algebra):
    """x(n+1) = A·x(n) + b·torque(n), out(n) = c·x(n), at `rate_hz`; `differenced`: (out(n) − out(n−1))·rate instead."""

    a: Floats
    b: Floats
    c: Floats
    rate_hz: float
    differenced: bool = False

    def response(self, frequency_hz: ArrayLike) -> Complex:
        z = np.exp(2j * np.pi * np.asarray(frequency_hz, dtype=np.float64) / self.rate_hz)
        plain = _resolvent(self.a, self.b, self.c, np.asarray(z, dtype=np.complex128))
        return plain * (1 - 1 / z) * self.rate_hz if self.differenced else plain


def linear(mechanics: Mechanics, friction: Friction, spans: Spans, load_kg: float) -> StateSpace:
    """The belt drive linearised with these spans, torque to motor velocity: exact for small motions around rest.

    Friction enters with its viscous part: dry friction of an axis in motion is a constant.

    >>> belt = Mechanics()
    >>> plant = linear(belt, Friction(), Spans.of(belt, 0.8), belt.load_kg)
    >>> formula = BeltResponse(belt.inertia_kg_m2, belt.load_kg, belt.radius_m, 5e5, 130.0)
    >>> np.allclose(plant.response([20.0, 60.0]), formula.response([20.0, 60.0]), rtol=1e-12)
    True
    """
    build = _two_masses if mechanics.masses == 2 else _three_masses
    stiffness, damping, inverse_masses = build(mechanics, spans, load_kg)
    damping[0, 0] += friction.motor_viscous_n_m_s
    damping[-1, -1] += friction.load_viscous_n_s_per_m
    n = 2 * len(inverse_masses)
    a, b = np.zeros((n, n)), np.zeros(n)
    a[0::2, 1::2] = np.eye(n // 2)
    a[1::2, 0::2] = -inverse_masses[:, None] * stiffness
    a[1::2, 1::2] = -inverse_masses[:, None] * damping
    b[1] = inverse_masses[0]
    return StateSpace(a, b, np.eye(n)[1])


def _two_masses(mechanics: Mechanics, spans: Spans, load_kg: float) -> tuple[Floats, Floats, Floats]:
    """Stiffness and damping matrices and inverse masses of φ, x (11), (12)."""
    pull = np.outer([mechanics.radius_m, -1.0], [mechanics.radius_m, -1.0])
    masses = np.array([mechanics.motor_inertia_kg_m2, load_kg])
    return spans.stiffness_n_per_m * pull, spans.damping_n_s_per_m * pull, 1 / masses


def _three_masses(mechanics: Mechanics, spans: Spans, load_kg: float) -> tuple[Floats, Floats, Floats]:
    """Matrices of φ1, φ2, x (8)–(10): each span pulls with its elongation."""
    r = mechanics.radius_m
    elongations = np.array([[r, 0.0, -1.0], [0.0, -r, 1.0], [-r, r, 0.0]])
    pulls = [np.outer(e, e) for e in elongations]
    stiffness = np.sum([k * pull for k, pull in zip(spans.stiffness, pulls)], axis=0)
    damping = np.sum([b * pull for b, pull in zip(spans.damping, pulls)], axis=0)
    masses = np.array([mechanics.motor_inertia_kg_m2, mechanics.pulley_inertia_kg_m2, load_kg])
    return stiffness, damping, 1 / masses


def _resolvent(a: Floats, b: Floats, c: Floats, argument: Complex) -> Complex:
    """c·(at·I − A)⁻¹·b at each point, the shape of `at`."""
    points = np.atleast_1d(argument)
    shifted = points[..., None, None] * np.eye(len(b)) - a
    solved = np.linalg.solve(shifted, np.broadcast_to(b[:, None], (*points.shape, len(b), 1)))
    return np.asarray((solved[..., 0] @ c).reshape(np.shape(argument)))
