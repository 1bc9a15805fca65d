"""A two-mass servo that livebode's simulation did not make, as a CSV with its configuration."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from livebode.arrays import Floats
from tools.two_mass_servo import TwoMassServo, multisine

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
class Servo(TwoMassServo):
    """Slower, with a gain alone."""

    damping_ratio: float = 0.018
    rate_hz: float = 2000.0

    def recording(self, seed: int, periods: int, noise: float = 0.03) -> dict[str, Floats]:
        """Excitation, torque and speed from rest, with white noise on the speed."""
        bins = np.arange(2, 100, 2)
        w = np.tile(0.02 * multisine(bins, 1000, -np.pi * np.arange(bins.size) ** 2 / bins.size), periods)
        u, y, _ = self.run(w, noise * np.random.default_rng(seed).standard_normal(w.size))
        return {"excitation": w, "torque": u, "speed": y}


def write_axis(folder: Path, name: str, servo: Servo, seed: int, periods: int = 12, more: str = "") -> Path:
    """The recording as CSV, and the axis.toml beside it; its path."""
    columns = servo.recording(seed, periods)
    time_s = np.arange(columns["torque"].size) / servo.rate_hz
    heads = ["time [s]", "excitation [N m]", "torque [N m]", "speed [rad/s]"]
    table = np.column_stack([time_s, *columns.values()])
    np.savetxt(folder / f"{name}.csv", table, "%.9g", ",", header=",".join(heads), comments="")
    path = folder / f"{name}.toml"
    path.write_text(AXIS.format(log=f"{name}.csv") + more, encoding="utf-8")
    return path
