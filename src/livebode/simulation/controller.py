"""Sensor and control of the simulated axis, in plain Python: of a machine whose motion is an FMU.

Tests compare them with simulation/axis.c, bit by bit.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import copysign, floor, isfinite, sin
from typing import Any, NamedTuple

Settings = Mapping[str, Any]


class Now(NamedTuple):
    """Inputs of one tick: references, excitation, noise, and the machine's condition."""

    position_reference: float
    velocity_reference: float
    w: float
    noise: float
    stiffness: float
    damping: float
    load_kg: float
    gap_m: float
    friction: float
    disturbance_n_m: float


class Controller:
    """Sensor and control of the drive (Nevaranta 2016, Fig. 7)."""

    def __init__(self, settings: Settings, angle: float) -> None:
        self.settings = settings
        self.integral: float = 0.0
        self.held: float = 0.0
        self.control: float = 0.0
        self.delayed = [0.0] * settings["delay_ticks"]
        self.limited = False
        self.angle, self.reading, self.tick_number = angle, self._encoder(angle), 0

    def tick(self, angle: float, velocity: float, now: Now) -> tuple[float, float, float]:
        """Torque, velocity and angle as logged at this tick."""
        velocity = self._read(angle, velocity) + now.noise
        torque = self._update(velocity, now) + now.w
        most = self.settings["torque_n_m_max"]
        self.limited = abs(torque) > most
        self.tick_number += 1
        return (copysign(most, torque) if self.limited else torque), velocity, self.reading

    def _encoder(self, angle: float) -> float:
        step, eccentricity = self.settings["encoder_step_rad"], self.settings["encoder_eccentricity_rad"]
        if eccentricity > 0 and isfinite(angle):
            angle += eccentricity * sin(angle)
        return floor(angle / step + 0.5) * step if step > 0 and isfinite(angle) else angle

    def _read(self, angle: float, velocity: float) -> float:
        reading, rate = self._encoder(angle), self.settings["rate_hz"]
        if self.settings["velocity_differenced"]:
            velocity = (reading - self.reading) * rate
        else:
            velocity = velocity + ((reading - angle) - (self.reading - self.angle)) * rate
        self.reading, self.angle = reading, angle
        return velocity

    def _update(self, velocity: float, now: Now) -> float:
        s, n = self.settings, self.tick_number
        if n % s["position_ticks"] == 0:
            self.held = s["position_gain_per_s"] * (now.position_reference - self.reading) + (
                s["velocity_feedforward"] * now.velocity_reference
            )
        if n % s["velocity_ticks"] == 0:
            error = self.held - velocity
            if not self.limited:
                self.integral += error * s["integral_step"]
            self.control = s["velocity_gain_n_m_s"] * (error + self.integral)
        if not self.delayed:
            return self.control
        slot = n % len(self.delayed)
        torque, self.delayed[slot] = self.delayed[slot], self.control
        return torque
