"""A servo that is none of livebode's machines, and its recording as a person has it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.linalg

RATE_HZ, WINDOW = 2000.0, 1000
MOTOR, LOAD, STIFFNESS, DAMPING = 0.0012, 0.0025, 180.0, 0.0286  # kg m², kg m², N m/rad, N m s/rad


@dataclass(frozen=True)
class Servo:
    """Two masses on a shaft under a PI controller, with a multisine added to the torque."""

    periods: int = 16
    noise: float = 0.01

    def recording(self) -> dict[str, np.ndarray]:
        """Time in s, excitation and torque in N m, speed in rad/s."""
        rng = np.random.default_rng(5)
        bins = np.unique(np.round(np.geomspace(2, 300, 40)).astype(int))
        phase = 2 * np.pi * (np.arange(WINDOW)[:, None] * bins / WINDOW + rng.uniform(size=len(bins)))
        period = np.cos(phase).sum(axis=1)
        added = np.tile(0.4 * period / period.std(), self.periods)
        step, push = self._discrete()
        state, integral = np.zeros(4), 0.0
        torque, speed = np.zeros_like(added), np.zeros_like(added)
        for i, offset in enumerate(added):
            speed[i] = state[1] + self.noise * rng.standard_normal()
            integral -= 0.6 * speed[i] / RATE_HZ
            torque[i] = offset - 0.05 * speed[i] + integral
            state = step @ state + push * torque[i]
        return {"t": np.arange(added.size) / RATE_HZ, "torque_offset": added, "torque": torque, "motor_speed": speed}

    def response(self, frequency_hz: np.ndarray) -> np.ndarray:
        """From torque to speed, with the torque held over a sample; closed form."""
        step, push = self._discrete()
        z = np.exp(2j * np.pi * frequency_hz / RATE_HZ)
        return np.array([np.linalg.solve(each * np.eye(4) - step, push)[1] for each in z])

    @staticmethod
    def _discrete() -> tuple[np.ndarray, np.ndarray]:
        k1, d1, k2, d2 = STIFFNESS / MOTOR, DAMPING / MOTOR, STIFFNESS / LOAD, DAMPING / LOAD
        whole = np.zeros((5, 5))
        whole[:4, :4] = [[0, 1, 0, 0], [-k1, -d1, k1, d1], [0, 0, 0, 1], [k2, d2, -k2, -d2]]
        whole[1, 4] = 1 / MOTOR
        exact = scipy.linalg.expm(whole / RATE_HZ)
        return exact[:4, :4], exact[:4, 4]


def write_servo(path: Path, servo: Servo | None = None, *, german: bool = False) -> Path:
    """Its recording as CSV; `german`: of an Excel in Germany, in code page 1252."""
    columns = (servo or Servo()).recording()
    units = {"t": "s", "torque_offset": "N m", "torque": "N m", "motor_speed": "rad/s"}
    rows = [[f"{name} [{units[name]}]" for name in columns]]
    rows += [[f"{value:.6f}" for value in row] for row in zip(*columns.values())]
    if not german:
        path.write_text("\n".join(map(",".join, rows)) + "\n", encoding="utf-8")
        return path
    names = {
        "t": "Zeit",
        "torque_offset": "Anregung",
        "torque": "Drehmoment",
        "motor_speed": "Geschwindigkeit für Regler",
    }
    rows[0] = [f"{names[name]} [{units[name]}]" for name in columns]
    text = "\r\n".join(";".join(row).replace(".", ",") for row in rows) + "\r\n"
    path.write_bytes(text.encode("cp1252"))
    return path
