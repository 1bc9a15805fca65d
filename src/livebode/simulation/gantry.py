"""A gantry with two motors: its beam yaws, and the place of its cart changes the modes. With its truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace

import numpy as np

from livebode.arrays import Floats
from livebode.core import Block, UsageError
from livebode.dataclass import dataclass
from livebode.simulation.mechanism import LinearMechanism
from livebode.simulation.motor_loop import MotorLoop


@dataclass(frozen=True, kw_only=True)
class Gantry(LinearMechanism):
    """Two motors, each with a belt to one end of a cross beam; a cart at a fixed place on the beam.

    Coordinates are the angles φ1, φ2 of the motors, the position Y of the beam's centre and its yaw angle θ, which is
    small: the ends of the beam are at Y ± d·θ, and the cart, at x from the centre, is at Y + x·θ. Each belt is a spring
    and a damper between r·φ and its end of the beam; the guides resist yaw. The left belt is that of motor 1, at Y +
    d·θ; the right one is like it unless specified.

    Parameters
    ----------
    motor_inertia_kg_m2, radius_m, motor_viscous_n_m_s
        Inertia of each motor, radius of its pulley, and viscous friction.
    stiffness_n_per_m, damping_n_s_per_m
        Of each belt.
    beam_kg, beam_inertia_kg_m2, half_width_m
        Mass of the beam, its inertia in yaw, and half of the distance between the belts.
    yaw_stiffness_n_m, yaw_damping_n_m_s
        Of the guides, per radian of yaw.
    cart_kg, cart_m
        Mass of the cart, and its place from the centre of the beam.
    right_stiffness_n_per_m, right_damping_n_s_per_m
        Of the right belt; default: as the left one.

    Raises
    ------
    UsageError
        If a mass, the radius or the stiffness is not above 0, or the cart is not on the beam.

    Examples
    --------
    >>> Gantry(cart_m=0.0).modes_hz.round(1), Gantry(cart_m=0.4).modes_hz.round(1)
    (array([ 7.8, 56.1, 72.7]), array([ 7.2, 55. , 68.1]))
    """

    motor_inertia_kg_m2: float = 0.002
    radius_m: float = 0.02
    motor_viscous_n_m_s: float = 0.001
    stiffness_n_per_m: float = 4e5
    damping_n_s_per_m: float = 150.0
    beam_kg: float = 12.0
    beam_inertia_kg_m2: float = 1.6
    half_width_m: float = 0.5
    yaw_stiffness_n_m: float = 1e4
    yaw_damping_n_m_s: float = 20.0
    cart_kg: float = 6.0
    cart_m: float = 0.2
    right_stiffness_n_per_m: float | None = None
    right_damping_n_s_per_m: float | None = None

    def __post_init__(self) -> None:
        names: tuple[str, ...] = (
            "motor_inertia_kg_m2",
            "radius_m",
            "stiffness_n_per_m",
            "beam_kg",
            "beam_inertia_kg_m2",
            "half_width_m",
        )
        names += ("right_stiffness_n_per_m",) * (self.right_stiffness_n_per_m is not None)
        for name in names:
            if not getattr(self, name) > 0:
                raise UsageError(
                    "out-of-range",
                    f"{name}={getattr(self, name)} of a gantry is not above 0",
                    "specify a value above 0",
                    argument=name,
                    value=getattr(self, name),
                )
        if not abs(self.cart_m) <= self.half_width_m:
            raise UsageError(
                "out-of-range",
                f"cart_m={self.cart_m} is not on the beam of ±{self.half_width_m} m",
                "choose a place on the beam",
                argument="cart_m",
                value=self.cart_m,
            )

    @property
    def matrices(self) -> tuple[Floats, Floats, Floats]:
        """Mass, damping and stiffness matrix of φ1, φ2, Y, θ: M·q'' + C·q' + K·q = torques on the first two."""
        mass = np.diag([self.motor_inertia_kg_m2, self.motor_inertia_kg_m2, self.beam_kg, self.beam_inertia_kg_m2])
        cart = np.array([0.0, 0.0, 1.0, self.cart_m])
        mass += self.cart_kg * np.outer(cart, cart)
        r, d = self.radius_m, self.half_width_m
        belts = np.array([[r, 0.0, -1.0, -d], [0.0, r, -1.0, d]])
        springs, dampers = ([left, left if right is None else right] for left, right in self._belts)
        damping = belts.T @ np.diag(dampers) @ belts
        damping += np.diag([self.motor_viscous_n_m_s, self.motor_viscous_n_m_s, 0.0, self.yaw_damping_n_m_s])
        stiffness = belts.T @ np.diag(springs) @ belts + np.diag([0.0, 0.0, 0.0, self.yaw_stiffness_n_m])
        return mass, damping, stiffness

    @property
    def _belts(self) -> tuple[tuple[float, float | None], tuple[float, float | None]]:
        """Stiffness and damping of the left and the right belt."""
        return (
            (self.stiffness_n_per_m, self.right_stiffness_n_per_m),
            (self.damping_n_s_per_m, self.right_damping_n_s_per_m),
        )

    @property
    def torque_map(self) -> Floats:
        """The torques act on φ1 and φ2."""
        return np.eye(4, 2)

    @property
    def output_map(self) -> Floats:
        """Speeds of the motors and of the cart."""
        return np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, self.cart_m]])

    @property
    def outputs(self) -> tuple[tuple[str, str], ...]:
        """Speeds of the two motors, rad/s, and of the cart along the belts, m/s."""
        return (("velocity1", "rad/s"), ("velocity2", "rad/s"), ("cart", "m/s"))


@dataclass(frozen=True, kw_only=True)
class GantryLoop(MotorLoop):
    """A gantry under a PI velocity controller for each motor.

    Examples
    --------
    >>> loop = GantryLoop()
    >>> loop.decay < 1, [channel.name for channel in loop.simulate(np.zeros((2, 4))).channels]
    (True, ['w1', 'w2', 'u1', 'u2', 'velocity1', 'velocity2', 'cart'])
    """

    gantry: Gantry = field(default_factory=Gantry)

    @property
    def mechanism(self) -> Gantry:
        """The gantry."""
        return self.gantry

    def simulate_places(
        self,
        excitation: Floats,
        cart_m: Sequence[float],
        disturbance: Floats | None = None,
        noise: Floats | None = None,
    ) -> Block:
        """The recording of experiments of equal length, before each of which the cart goes to another place.

        Speeds and positions continue over the change, which takes no time; the motion of the cart is not included.

        Parameters
        ----------
        excitation, disturbance, noise
            As of `simulate`.
        cart_m
            Place of the cart in each part of the recording, m.

        Raises
        ------
        UsageError
            If the samples are not a multiple of the places, or a place is not on the beam.

        Examples
        --------
        >>> w = np.zeros((2, 800))
        >>> w[:, 0] = 1.0, -1.0
        >>> len(GantryLoop().simulate_places(w, [-0.3, 0.3]))
        800
        """
        inputs = self.inputs(excitation, disturbance, noise)
        if not len(cart_m) or inputs.shape[1] % len(cart_m):
            raise UsageError(
                "wrong-shape",
                f"{inputs.shape[1]} samples are not a multiple of {len(cart_m)} places",
                "give one place for each experiment",
                argument="cart_m",
            )
        parts, state = [], None
        for place, given in zip(cart_m, np.split(inputs, len(cart_m), axis=1)):
            there = replace(self, gantry=replace(self.gantry, cart_m=place))
            seen, state = there.continued(given, state)
            parts.append(seen)
        return Block(np.concatenate(parts, axis=1), self.channels, self.rate_hz)


CHANNELS = GantryLoop().channels
