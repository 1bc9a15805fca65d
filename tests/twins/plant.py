"""The simulated belt drive in plain Python: the definition that tests compare with simulation/axis.c, bit by bit."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from math import copysign, cos, sin, sqrt
from typing import NamedTuple

from scipy.integrate import DOP853

from livebode.simulation.fmu import Now, Settings


def friction(coulomb: float, stribeck: float, s: Settings, speed: float) -> float:
    """Dry friction at a speed at the belt: (coulomb + stribeck/(1 + (v/vs)²))·v/√(v² + w²)."""
    if coulomb == 0 and stribeck == 0:
        return 0.0
    ratio, width = speed / s["stribeck_speed_m_per_s"], s["smoothing_m_per_s"]
    return float((coulomb + stribeck / (1 + ratio * ratio)) * (speed / sqrt(speed * speed + width * width)))


class Play(NamedTuple):
    """Elongation beyond a play, its rate, and the region of the play, in each of which the equations are smooth."""

    slack: float
    rate: float
    region: str


def play(gap: float, elongation: float, rate: float) -> Play:
    """A dead zone whose corners a quartic rounds over a twentieth of it."""
    if gap == 0:
        return Play(elongation, rate, "free")
    rounding, beyond = 0.05 * gap, abs(elongation) - 0.5 * gap
    into = beyond + rounding
    if into <= 0:
        return Play(0.0, 0.0, "free")
    if beyond >= rounding:
        return Play(copysign(beyond, elongation), rate, "above" if elongation > 0 else "below")
    square, unit = into * into, 16 * (rounding * rounding * rounding)
    slope = (3 * square * (3 * rounding - beyond) - square * into) / unit
    return Play(copysign(square * into * (3 * rounding - beyond) / unit, elongation), rate * slope, "corner")


def weakening(s: Settings, at: float) -> float:
    """Factor of the soft spots on the stiffness."""
    factor = 1.0
    for position, width, loss in s["spots"]:
        u = (at - position) / width
        bump = 1 / (1 + u * u)
        factor *= 1 - loss * (bump * bump)
    return factor


@cache
def stages() -> list[list[tuple[int, float]]]:
    """Nonzero coefficients of each stage after the first, and of the step (Hairer, Nørsett, Wanner, section II.10)."""
    return [[(j, float(w)) for j, w in enumerate(row) if w != 0] for row in (*DOP853.A[1:], DOP853.B)]


class Plant:
    """The belt drive's motion; state as in the truth: angle and speed of each pulley, then of the cart."""

    def __init__(self, settings: Settings, position_m: float) -> None:
        self.settings = settings
        self.state = [0.0] * settings["states"]
        self._regions: set[str] = set()  # of the play, in the stages of the newest step
        self.state[0] = position_m / settings["radius_m"]
        travel, angle, _, _ = self._pulley(self.state[0], 0.0)
        self.state[-2] = travel
        if settings["states"] == 6:
            self.state[2] = angle  # no span is elongated, not even by rounding

    def read(self) -> tuple[float, float, float]:
        """Angle and velocity of the motor, and the cart's position."""
        return self.state[0], self.state[1], self.state[-2]

    def step(self, torque: float, now: Now) -> None:
        """One tick under a constant torque: steps of the order-8 method."""
        seconds = 1 / (self.settings["rate_hz"] * self.settings["substeps"])
        for _ in range(self.settings["substeps"]):
            self._split(torque, now, seconds, self.settings["halvings"])

    def _split(self, torque: float, now: Now, seconds: float, halvings: int) -> None:
        """A step, or two halves where it crosses from one region of the play into another."""
        start, at, slopes = self.state, self.state, []
        self._regions = set()
        for stage in stages():
            slopes.append(self.derivative(now, torque, at))
            sums = [0.0] * len(start)
            for j, weight in stage:
                sums = [total + weight * slope for total, slope in zip(sums, slopes[j])]
            at = [value + seconds * total for value, total in zip(start, sums)]
        if halvings == 0 or len(self._regions) < 2:
            self.state = at
        else:
            for _ in range(2):
                self._split(torque, now, 0.5 * seconds, halvings - 1)

    def derivative(self, now: Now, torque: float, state: Sequence[float]) -> list[float]:
        """Time derivative of the state: (11), (12) or (8)–(10), with friction and torque ripple."""
        s, omega, v = self.settings, state[1], state[-1]
        dry = friction(s["motor_coulomb_n_m"], s["motor_stribeck_n_m"], s, s["radius_m"] * omega)
        torque = torque + now.disturbance_n_m - now.friction * (s["motor_viscous_n_m_s"] * omega + dry)
        if s["torque_ripple_n_m"] != 0:
            torque += s["torque_ripple_n_m"] * sin(s["torque_ripple_per_turn"] * state[0])
        d = (self._two_masses if len(state) == 4 else self._three_masses)(now, torque, state)
        dry = friction(s["load_coulomb_n"], s["load_stribeck_n"], s, v)
        resisting = now.friction * (s["load_viscous_n_s_per_m"] * v + dry)
        d[-1] = (d[-1] - resisting) / now.load_kg
        return d

    def _at(self, x: float) -> float:
        return float(self.settings["frozen_position_m"] if self.settings["frozen"] else x)

    def _pulley(self, phi: float, omega: float) -> tuple[float, float, float, float]:
        """Belt that the motor's pulley has moved, the angle at which a pulley without eccentricity moves as much, its
        arm, and the belt's speed there."""
        r, e = self.settings["radius_m"], self.settings["eccentricity"]
        if e == 0:
            return r * phi, phi, r, r * omega
        arm, angle = r * (1 + e * sin(phi)), phi + e * (1 - cos(phi))
        return r * angle, angle, arm, arm * omega

    def _two_masses(self, now: Now, torque: float, state: Sequence[float]) -> list[float]:
        s, at = self.settings, self._at(state[2])
        travel, _, arm, speed = self._pulley(state[0], state[1])
        shape = 1 / at + 1 / (2 * s["pulley_distance_m"] - at)
        k = s["specific_stiffness_n"] * now.stiffness * weakening(s, at) * shape
        b = s["damping_shape"] * now.damping * sqrt(shape)
        held = play(now.gap_m, travel - state[2], speed - state[3])
        self._regions.add(held.region)
        force = k * held.slack + b * held.rate
        return [state[1], (torque - arm * force) / s["motor_inertia_kg_m2"], state[3], force]

    def _three_masses(self, now: Now, torque: float, state: Sequence[float]) -> list[float]:
        s, r, at, l3 = self.settings, self.settings["radius_m"], self._at(state[4]), self.settings["pulley_distance_m"]
        travel, _, arm, speed = self._pulley(state[0], state[1])
        s1, s2, s3 = 1 / at, 1 / (l3 - at), 1 / l3
        shape = s1 + 1 / (2 * l3 - at)
        k = s["specific_stiffness_n"] * now.stiffness * weakening(s, at)
        b = s["damping_shape"] * now.damping / sqrt(shape)
        x, v = self._held(now, s1, s2, state)
        f1 = s1 * (k * (travel - x) + b * (speed - v))
        f2 = s2 * (k * (x - r * state[2]) + b * (v - r * state[3]))
        f3 = s3 * (k * (r * state[2] - travel) + b * (r * state[3] - speed))
        first = (torque - arm * f1 + arm * f3) / s["motor_inertia_kg_m2"]
        second = r * (f2 - f3) / s["pulley_inertia_kg_m2"]
        return [state[1], first, state[3], second, state[5], f1 - f2]

    def _held(self, now: Now, s1: float, s2: float, state: Sequence[float]) -> tuple[float, float]:
        """Position of the belt at the cart: that of the cart, or within the play the equilibrium of the spans."""
        if now.gap_m == 0:
            return state[4], state[5]
        r = self.settings["radius_m"]
        travel, _, _, speed = self._pulley(state[0], state[1])
        free = (s1 * travel + s2 * (r * state[2])) / (s1 + s2)
        free_rate = (s1 * speed + s2 * (r * state[3])) / (s1 + s2)
        held = play(now.gap_m, free - state[4], free_rate - state[5])
        self._regions.add(held.region)
        return free - held.slack, free_rate - held.rate
