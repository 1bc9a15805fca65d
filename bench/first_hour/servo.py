"""The recording of a servo that livebode did not make, as several drives would have written it.

`python -m bench.first_hour.servo DIR` writes its recording in the units and the spelling of several drives.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from tools.two_mass_servo import Samples, TwoMassServo, multisine, schroeder

PERIOD, LINES_HZ = 4000, np.arange(4, 201, 3)  # bins of the period
RATED_TORQUE_N_M, TORQUE_CONSTANT_N_M_PER_A = 2.4, 0.35


SERVO = TwoMassServo(integral_time_s=0.15)
SOFTER = replace(SERVO, stiffness=0.92 * SERVO.stiffness)


def recorded(servo: TwoMassServo = SERVO, seconds: float = 20.0, seed: int = 1) -> dict[str, Samples]:
    """Time in s, excitation and torque in N m, speed of the motor in rad/s, each of shape (samples,)."""
    count = int(seconds * servo.rate_hz)
    w = np.resize(0.02 * multisine(LINES_HZ, PERIOD, schroeder(len(LINES_HZ))), count)
    u, y, _ = servo.run(w, 2e-3 * np.random.default_rng(seed).standard_normal(count))
    return {"time": np.arange(count) / servo.rate_hz, "excitation": w, "torque": u, "speed": y}


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
    t, w, u, y = recorded(seconds=seconds).values()
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
    softer = recorded(SOFTER, seconds, seed=2)
    write_csv(
        folder / "softer.csv", ["time [s]", "excitation [N m]", "torque [N m]", "speed [rad/s]"], [*softer.values()]
    )


if __name__ == "__main__":
    directory = Path(sys.argv[1])
    directory.mkdir(parents=True, exist_ok=True)
    write_recordings(directory)
