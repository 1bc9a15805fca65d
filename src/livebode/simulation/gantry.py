"""A gantry with two motors: its beam yaws, and the place of its cart changes the modes. With its truth."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebode.core import Block, Channel, UsageError
from livebode.simulation.hold import held

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

OUTPUTS = ("velocity1", "velocity2", "cart")
"""Speeds of the two motors, rad/s, and of the cart along the belts, m/s."""


@dataclass(frozen=True, kw_only=True)
class Gantry:
    """Two motors, each with a belt to one end of a cross beam; a cart at a fixed place on the beam.

    Coordinates are the angles φ1, φ2 of the motors, the position Y of the beam's centre and its yaw angle θ, which is
    small: the ends of the beam are at Y ± d·θ, and the cart, at x from the centre, is at Y + x·θ. Each belt is a spring
    and a damper between r·φ and its end of the beam; the guides resist yaw. The left belt is that of motor 1, at Y +
    d·θ; the right one is like it unless specified. Without dry friction and limits the machine is linear, and its
    simulation is exact.

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
    def state_space(self) -> tuple[Floats, Floats, Floats]:
        """A, B, C of x' = A·x + B·torque, out = C·x with x = (q, q'): shapes (8, 8), (8, 2), (3, 8); see `OUTPUTS`."""
        mass, damping, stiffness = self.matrices
        a = np.zeros((8, 8))
        a[:4, 4:] = np.eye(4)
        a[4:, :4], a[4:, 4:] = -np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)
        b = np.zeros((8, 2))
        b[4:] = np.linalg.inv(mass)[:, :2]
        c = np.zeros((3, 8))
        c[0, 4] = c[1, 5] = c[2, 6] = 1.0
        c[2, 7] = self.cart_m
        return a, b, c

    @property
    def modes_hz(self) -> Floats:
        """Undamped frequencies, Hz, ascending: the yaw against the guides, and two that stretch the belts."""
        mass, _, stiffness = self.matrices
        squares = np.sort(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real)
        return np.asarray(np.sqrt(squares[squares > 1.0]) / (2 * np.pi))

    def sampled(self, rate_hz: float) -> tuple[Floats, Floats, Floats]:
        """A, B, C from tick to tick with torques that are constant over a tick: exact."""
        a, b, c = self.state_space
        columns = [held(a, column, 1 / rate_hz) for column in b.T]
        return columns[0][0], np.stack([column for _, column in columns], axis=1), c

    def response(self, frequency_hz: ArrayLike, rate_hz: float) -> Complex:
        """Truth: from the torques to `OUTPUTS` behind the hold, shape (lines, outputs, inputs)."""
        a, b, c = self.sampled(rate_hz)
        z = np.exp(2j * np.pi * np.atleast_1d(np.asarray(frequency_hz, dtype=np.float64)) / rate_hz)
        return np.asarray(c @ np.linalg.solve(z[:, None, None] * np.eye(8) - a, b.astype(np.complex128)))


@dataclass(frozen=True, kw_only=True)
class GantryLoop:
    """A gantry under a PI velocity controller for each motor: torque = w − gain·(1 + ∫/Ti)·velocity.

    Every tick the drives read the speeds of their motors, compute, and hold the torque until the next tick. Signals are
    logged as a Loop expects: speeds before and torques after the update.

    Examples
    --------
    >>> loop = GantryLoop()
    >>> loop.decay < 1, [channel.name for channel in loop.simulate(np.zeros((2, 4))).channels]
    (True, ['w1', 'w2', 'u1', 'u2', 'velocity1', 'velocity2', 'cart'])
    """

    gantry: Gantry = field(default_factory=Gantry)
    rate_hz: float = 4000.0
    gain_n_m_s: float = 0.3
    integral_time_s: float = 0.05

    @property
    def matrices(self) -> tuple[Floats, Floats]:
        """Φ and Γ of z(n+1) = Φ·z + Γ·(w, disturbance, noise) with z = (x, integrals), shapes (10, 10), (10, 7).

        The disturbance is a torque beside u, the noise is on the three outputs.
        """
        a, b, c = self.gantry.sampled(self.rate_hz)
        gain, step = self.gain_n_m_s, 1 / (self.rate_hz * self.integral_time_s)
        speeds = c[:2]
        # The integral after the update is that before it plus step·speed.
        control = -gain * np.hstack([(1 + step) * speeds, np.eye(2)])
        state = np.vstack([np.hstack([a, np.zeros((8, 2))]) + b @ control, np.hstack([step * speeds, np.eye(2)])])
        fed = -gain * (1 + step) * np.eye(2, 3)
        entry = np.zeros((10, 7))
        entry[:8, :2] = entry[:8, 2:4] = b
        entry[:8, 4:], entry[8:, 4:] = b @ fed, step * np.eye(2, 3)
        return state, entry

    @property
    def decay(self) -> float:
        """Size of the slowest eigenvalue that decays: transients shrink by it each tick; below 1 in a stable loop.

        Two eigenvalues are 1: the beam remains where it comes to rest, as a constant that no line contains.
        """
        return float(np.sort(np.abs(np.linalg.eigvals(self.matrices[0])))[-3])

    def simulate(self, excitation: Floats, disturbance: Floats | None = None, noise: Floats | None = None) -> Block:
        """The recording of a simulation from rest.

        Parameters
        ----------
        excitation, disturbance
            Torques added to those of the controllers, N m, and beside them, shape (2, samples).
        noise
            On the three outputs as the drives read and log them, shape (3, samples).
        """
        inputs = np.zeros((7, excitation.shape[1]))
        inputs[:2] = excitation
        for at, given in ((slice(2, 4), disturbance), (slice(4, 7), noise)):
            inputs[at] = 0.0 if given is None else given
        return Block(self.signals(inputs), CHANNELS, self.rate_hz)

    def signals(self, inputs: Floats) -> Floats:
        """w, u and outputs of inputs (w, disturbance, noise): (7, samples) or, of several runs, (7, samples, runs)."""
        state, entry = self.matrices
        samples = inputs.shape[1]
        flat = inputs.reshape(7, -1)
        pushes = np.ascontiguousarray(np.moveaxis((entry @ flat).reshape(10, *inputs.shape[1:]), 1, 0))
        states = np.empty_like(pushes)
        now = np.zeros(pushes.shape[1:])
        for n in range(samples):
            states[n] = now
            now = state @ now + pushes[n]
        c = self.gantry.state_space[2]
        z = np.moveaxis(states, 1, 0).reshape(10, -1)
        outputs = c @ z[:8] + flat[4:]
        step = 1 / (self.rate_hz * self.integral_time_s)
        torque = flat[:2] - self.gain_n_m_s * (outputs[:2] * (1 + step) + z[8:])
        return np.vstack([flat[:2], torque, outputs]).reshape(7, *inputs.shape[1:])

    def settle_periods(self, window: int, remaining: float = 1e-9) -> int:
        """Whole periods after which this share of a transient remains: the `settle` of an experiment."""
        return int(np.ceil(np.log(remaining) / (window * np.log(self.decay))))


CHANNELS = (
    *(Channel("w1", "N m"), Channel("w2", "N m"), Channel("u1", "N m"), Channel("u2", "N m")),
    *(Channel("velocity1", "rad/s"), Channel("velocity2", "rad/s"), Channel("cart", "m/s")),
)
