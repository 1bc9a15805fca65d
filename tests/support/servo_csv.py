"""The recording of a servo as a person has it, as CSV."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from livebode.arrays import Floats
from tools.two_mass_servo import TwoMassServo, multisine

WINDOW = 1000
SERVO = TwoMassServo(damping_ratio=0.03743, rate_hz=2000.0, gain=0.05, integral_time_s=0.05 / 0.6)
_NAMES = {
    "t": ("Zeit", "s"), "torque_offset": ("Anregung", "N m"), "torque": ("Drehmoment", "N m"),
    "motor_speed": ("Geschwindigkeit für Regler", "rad/s"),
}  # fmt: skip


def recording(periods: int = 16, noise: float = 0.01) -> dict[str, Floats]:
    """Time in s, excitation and torque in N m, speed in rad/s, from rest."""
    rng = np.random.default_rng(5)
    bins = np.unique(np.round(np.geomspace(2, 300, 40)).astype(int))
    period = multisine(bins, WINDOW, 2 * np.pi * rng.uniform(size=len(bins)))
    added = np.tile(0.4 * period / period.std(), periods)
    torque, speed, _ = SERVO.run(added, noise * rng.standard_normal(added.size))
    return {"t": np.arange(added.size) / SERVO.rate_hz, "torque_offset": added, "torque": torque, "motor_speed": speed}


def write_servo(path: Path, *, periods: int = 16, noise: float = 0.01, german: bool = False) -> Path:
    """The recording as CSV; `german`: of an Excel in Germany, in code page 1252."""
    columns = recording(periods, noise)
    heads = [f"{(german_name if german else name)} [{unit}]" for name, (german_name, unit) in _NAMES.items()]
    rows = [heads, *([f"{value:.6f}" for value in row] for row in zip(*columns.values()))]
    if german:
        text = "\r\n".join(";".join(row).replace(".", ",") for row in rows) + "\r\n"
        path.write_bytes(text.encode("cp1252"))
    else:
        path.write_text("\n".join(map(",".join, rows)) + "\n", encoding="utf-8")
    return path
