"""A two-mass servo that livebode's simulation did not make: exact zero-order hold, speed loop, recordings as CSV."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import cont2discrete, lfilter

from livebode.arrays import Complex, Floats

AXIS = """
[source]
log = "{log}"
[signals]
excitation = "excitation"
input = "torque"
output = "speed"
[lines]
frequencies = "4:196:4"
window = 1000
[fit]
model = "two-mass"
output = "velocity"
"""


@dataclass(frozen=True)
class Servo:
    """Motor, spring and load at the shaft: kg m², N m/rad, and the damping ratio of the resonance."""

    motor: float = 0.0012
    load: float = 0.0025
    stiffness: float = 180.0
    damping: float = 0.018

    @property
    def resonance_hz(self) -> float:
        """Undamped."""
        return float(np.sqrt(self.stiffness * (1 / self.motor + 1 / self.load)) / (2 * np.pi))

    @property
    def antiresonance_hz(self) -> float:
        return float(np.sqrt(self.stiffness / self.load) / (2 * np.pi))

    def _discrete(self, rate_hz: float) -> tuple[Floats, Floats]:
        """Numerator and denominator from torque to speed, with the hold."""
        spring = 2 * self.damping * 2 * np.pi * self.resonance_hz / (1 / self.motor + 1 / self.load)
        whole = self.motor + self.load
        numerator = np.array([self.load, spring, self.stiffness])
        denominator = np.array([self.motor * self.load, whole * spring, whole * self.stiffness, 0.0])
        (b,), a, _ = cont2discrete((numerator, denominator), 1 / rate_hz)
        return b, a

    def response(self, frequency_hz: Floats, rate_hz: float = 2000.0) -> Complex:
        """Torque to speed, as it is sampled."""
        b, a = self._discrete(rate_hz)
        z = np.exp(2j * np.pi * frequency_hz / rate_hz)
        return np.asarray(np.polyval(b, z) / np.polyval(a, z))

    def recording(self, seed: int, periods: int, noise: float = 0.03, rate_hz: float = 2000.0) -> dict[str, Floats]:
        """Time, excitation, torque and speed from rest, with white noise on the speed, whose loop has a gain."""
        b, a = self._discrete(rate_hz)
        lines, n = np.arange(4, 200, 4), 1000
        phases = -np.pi * np.arange(lines.size) ** 2 / lines.size
        period = np.cos(2 * np.pi * np.outer(np.arange(n) / rate_hz, lines) + phases).sum(axis=1)
        w = np.tile(0.02 * period, periods)
        e = noise * np.random.default_rng(seed).standard_normal(w.size)
        closed = np.polyadd(a, 0.08 * b)  # u = w - 0.08 (y + e), y = b/a u
        u = lfilter(a, closed, w - 0.08 * e)
        return {"excitation": w, "torque": u, "speed": lfilter(b, closed, w - 0.08 * e) + e}


def write_axis(folder: Path, name: str, servo: Servo, seed: int, periods: int = 12, more: str = "") -> Path:
    """The recording as CSV, and the axis.toml beside it; its path."""
    columns = servo.recording(seed, periods)
    time_s = np.arange(columns["torque"].size) / 2000.0
    heads = ["time [s]", "excitation [N m]", "torque [N m]", "speed [rad/s]"]
    table = np.column_stack([time_s, *columns.values()])
    np.savetxt(folder / f"{name}.csv", table, "%.9g", ",", header=",".join(heads), comments="")
    path = folder / f"{name}.toml"
    path.write_text(AXIS.format(log=f"{name}.csv") + more, encoding="utf-8")
    return path
