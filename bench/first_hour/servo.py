"""A servo that livebode did not make: two masses and a shaft, discretised exactly by SciPy, with a PI velocity loop.

`python -m bench.first_hour.servo DIR` writes its recording in the units and the spelling of several drives.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.linalg import expm

Samples = npt.NDArray[np.float64]
RATE_HZ, PERIOD = 4000.0, 4000
LINES_HZ = np.arange(4, 201, 3)
RATED_TORQUE_N_M, TORQUE_CONSTANT_N_M_PER_A = 2.4, 0.35


@dataclass(frozen=True)
class Servo:
    """Inertias in kg m², stiffness in N m/rad, damping of the shaft in N m s/rad, noise of the speed in rad/s."""

    motor: float = 0.0012
    load: float = 0.0025
    stiffness: float = 180.0
    damping: float = 0.014036
    noise: float = 2e-3

    @property
    def resonance_hz(self) -> float:
        """Undamped, with the motor free."""
        return float(np.sqrt(self.stiffness * (1 / self.motor + 1 / self.load)) / (2 * np.pi))

    @property
    def resonance_damping(self) -> float:
        """Share of critical damping."""
        return self.damping * (1 / self.motor + 1 / self.load) / (4 * np.pi * self.resonance_hz)

    def record(self, seconds: float = 20.0, seed: int = 1) -> dict[str, Samples]:
        """Time in s, excitation and torque in N m, speed of the motor in rad/s, each of shape (samples,)."""
        step, force = self._discrete()
        count = int(seconds * RATE_HZ)
        phases = -np.pi * np.arange(len(LINES_HZ)) * (np.arange(len(LINES_HZ)) + 1) / len(LINES_HZ)
        turns = 2 * np.pi * np.outer(LINES_HZ, np.arange(PERIOD)) / RATE_HZ
        excitation = np.resize(0.02 * np.cos(turns + phases[:, None]).sum(axis=0), count)
        noise = self.noise * np.random.default_rng(seed).standard_normal(count)
        torque, speed = np.zeros(count), np.zeros(count)
        state, integral = np.zeros(3), 0.0
        for i in range(count):
            speed[i] = state[0] + noise[i]
            integral -= speed[i] / RATE_HZ
            torque[i] = 0.08 * (integral / 0.15 - speed[i]) + excitation[i]
            state = step @ state + force * torque[i]
        return {"time": np.arange(count) / RATE_HZ, "excitation": excitation, "torque": torque, "speed": speed}

    def _discrete(self) -> tuple[Samples, Samples]:
        """Speeds and twist one sample later, from themselves and from a torque that is held."""
        c, k, jm, jl = self.damping, self.stiffness, self.motor, self.load
        system = np.zeros((4, 4))
        system[:3] = [[-c / jm, c / jm, -k / jm, 1 / jm], [c / jl, -c / jl, k / jl, 0], [1, -1, 0, 0]]
        step = expm(system / RATE_HZ)
        return step[:3, :3], step[:3, 3]


def write_csv(
    path: Path,
    headings: Sequence[str],
    columns: Sequence[Samples],
    separator: str = ",",
    comma: str = ".",
    encoding: str = "utf-8",
) -> None:
    """Write a table as a spreadsheet of that country does."""
    rows = (separator.join(f"{v:.9g}" for v in row).replace(".", comma) for row in zip(*columns, strict=True))
    path.write_bytes("\r\n".join([separator.join(headings), *rows, ""]).encode(encoding))


def write_recordings(folder: Path, seconds: float = 20.0) -> None:
    """The same recording as several drives would have written it."""
    t, w, u, y = Servo().record(seconds).values()
    rpm, torque_percent = y * 30 / np.pi, 100 / RATED_TORQUE_N_M
    si = ["time [s]", "excitation [N m]", "torque [N m]", "speed [rad/s]"]
    write_csv(folder / "si.csv", si, [t, w, u, y])
    write_csv(folder / "rpm.csv", ["t_s", "exc_Nm", "torque_Nm", "speed_rpm"], [t, w, u, rpm])
    write_csv(
        folder / "percent.csv",
        ["t_ms", "Setpoint addition [%]", "Actual torque [%]", "Actual speed [rpm]"],
        [1e3 * t, w * torque_percent, u * torque_percent, rpm],
    )
    german = ["Zeit [s]", "Anregung [Nm]", "Solldrehmoment [Nm]", "Istdrehzahl [1/min]"]
    write_csv(folder / "german.csv", german, [t, w, u, rpm], ";", ",", "cp1252")
    softer = Servo(stiffness=0.92 * Servo.stiffness).record(seconds, seed=2)
    write_csv(
        folder / "softer.csv", ["time [s]", "excitation [N m]", "torque [N m]", "speed [rad/s]"], [*softer.values()]
    )


if __name__ == "__main__":
    directory = Path(sys.argv[1])
    directory.mkdir(parents=True, exist_ok=True)
    write_recordings(directory)
