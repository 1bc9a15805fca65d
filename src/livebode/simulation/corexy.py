"""A CoreXY machine: two motors at the frame, whose belts both move the cart in x and y. With its truth."""

from __future__ import annotations

from dataclasses import field

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Complex, Floats
from livebode.core import UsageError
from livebode.dataclass import dataclass
from livebode.simulation.mechanism import LinearMechanism
from livebode.simulation.motor_loop import MotorLoop


@dataclass(frozen=True, kw_only=True)
class CoreXY(LinearMechanism):
    """Two motors a and b with belts that run over the bridge to the cart: x = (a + b)/2, y = (a − b)/2.

    a and b are the travels r·φ of the belts at their motors. Belt a is as long as x + y, belt b as x − y, and each is
    a spring and a damper. The cart moves along the bridge in x, and with the bridge in y, so that y moves more mass:
    from torques to speeds of the motors, everything couples. With equal belts x and y alone do not couple.

    Parameters
    ----------
    motor_inertia_kg_m2, radius_m, motor_viscous_n_m_s
        Inertia of each motor, radius of its pulley, and viscous friction.
    stiffness_a_n_per_m, stiffness_b_n_per_m
        Of belt a and of belt b.
    damping_n_s_per_m
        Of each belt.
    cart_kg, bridge_kg
        Mass that moves in x and y, and mass that moves only in y.
    guide_viscous_n_s_per_m
        Viscous friction of each guide.

    Raises
    ------
    UsageError
        If a mass, the radius or a stiffness is not above 0.

    Examples
    --------
    >>> CoreXY().modes_hz.round(1)
    array([59.6, 71.2])
    """

    motor_inertia_kg_m2: float = 2e-5
    radius_m: float = 0.01
    motor_viscous_n_m_s: float = 1e-4
    stiffness_a_n_per_m: float = 2e4
    stiffness_b_n_per_m: float = 2e4
    damping_n_s_per_m: float = 10.0
    cart_kg: float = 0.4
    bridge_kg: float = 0.6
    guide_viscous_n_s_per_m: float = 2.0

    def __post_init__(self) -> None:
        names = ("motor_inertia_kg_m2", "radius_m", "stiffness_a_n_per_m", "stiffness_b_n_per_m", "cart_kg")
        for name in names:
            if not getattr(self, name) > 0:
                raise UsageError(
                    "out-of-range",
                    f"{name}={getattr(self, name)} of a CoreXY machine is not above 0",
                    "specify a value above 0",
                    argument=name,
                    value=getattr(self, name),
                )

    @property
    def matrices(self) -> tuple[Floats, Floats, Floats]:
        """Mass, damping and stiffness matrix of φa, φb, x, y."""
        inertia, radius = self.motor_inertia_kg_m2, self.radius_m
        mass = np.diag([inertia, inertia, self.cart_kg, self.cart_kg + self.bridge_kg])
        stretch = np.array([[radius, 0.0, -1.0, -1.0], [0.0, radius, -1.0, 1.0]])
        viscous = [self.motor_viscous_n_m_s] * 2 + [self.guide_viscous_n_s_per_m] * 2
        damping = self.damping_n_s_per_m * stretch.T @ stretch + np.diag(viscous)
        return mass, damping, stretch.T @ np.diag([self.stiffness_a_n_per_m, self.stiffness_b_n_per_m]) @ stretch

    @property
    def torque_map(self) -> Floats:
        """The torques act on φa and φb."""
        return np.eye(4, 2)

    @property
    def output_map(self) -> Floats:
        """Speeds of the motors and of the cart."""
        return np.eye(4)

    @property
    def outputs(self) -> tuple[tuple[str, str], ...]:
        """Speeds of the two motors, rad/s, and of the cart in x and y, m/s."""
        return (("velocity1", "rad/s"), ("velocity2", "rad/s"), ("x", "m/s"), ("y", "m/s"))

    @property
    def to_axes(self) -> tuple[Floats, Floats]:
        """A and B for `MatrixResponses.transformed`: speeds of the axes from those of the motors, torques from forces.

        (x', y') = A·(φa', φb') in m/s, and (Ta, Tb) = B·(Fx, Fy) with the same power: B = Aᵀ.
        """
        speeds = self.radius_m / 2 * np.array([[1.0, 1.0], [1.0, -1.0]])
        return speeds, speeds.T

    def axes_response(self, frequency_hz: ArrayLike, rate_hz: float) -> Complex:
        """Truth of the axes at the motors: from forces in x and y to speeds, m/s per N, shape (lines, 2, 2)."""
        speeds, torques = self.to_axes
        return np.asarray(speeds @ self.response(frequency_hz, rate_hz)[:, :2] @ torques)


@dataclass(frozen=True, kw_only=True)
class CoreXYLoop(MotorLoop):
    """A CoreXY machine under a PI velocity controller for each motor.

    Examples
    --------
    >>> CoreXYLoop().decay < 1
    True
    """

    gain_n_m_s: float | tuple[float, ...] = 0.004
    corexy: CoreXY = field(default_factory=CoreXY)

    @property
    def mechanism(self) -> CoreXY:
        """The machine."""
        return self.corexy
