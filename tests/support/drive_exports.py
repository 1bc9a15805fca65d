"""A servo with two masses, as it is and as drives write it: the same samples in other units, words and encodings."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from math import pi
from pathlib import Path

import numpy as np

from livebode.arrays import Floats
from tools.two_mass_servo import TwoMassServo, multisine

SERVO, WINDOW, PERIODS = TwoMassServo(damping_ratio=0.018, integral_time_s=0.15), 2000, 5
TRUTH = {"Js": SERVO.motor, "JL": SERVO.load, "Keff": SERVO.stiffness, "resonance": SERVO.resonance_hz}
RPM, PERCENT, AMPERE, COUNTS = 30 / pi, 100 / 2.4, 1 / 0.35, (1 << 20) / (2 * pi)


@cache
def servo() -> dict[str, Floats]:
    """Excitation, torque, speed and angle of two masses in a speed loop, exact for a held torque, in SI units."""
    bins = np.arange(2, 100, 3)
    w = np.tile(0.02 * multisine(bins, WINDOW, -pi * bins**2 / bins.size), PERIODS)
    u, y, angle = SERVO.run(w, 1e-3 * np.random.default_rng(1).standard_normal(w.size))
    return {"t": np.arange(w.size) / SERVO.rate_hz, "w": w, "u": u, "y": y, "angle": angle}


@dataclass(frozen=True)
class Export:
    """How a drive writes the servo: headings with the factors of columns, declared units, and the form of the text."""

    time: tuple[str, float]
    excitation: tuple[str, float]
    torque: tuple[str, float]
    output: tuple[str, float]
    units: Mapping[str, str] = field(default_factory=dict)
    position: bool = False
    separator: str = ","
    decimal: str = "."
    encoding: str = "utf-8"

    @property
    def names(self) -> tuple[str, str, str]:
        excitation, torque, output = (
            re.sub(r" \[.*\]$", "", c[0]) for c in (self.excitation, self.torque, self.output)
        )
        return excitation, torque, output

    def write(self, path: Path) -> Path:
        columns = zip((self.time, self.excitation, self.torque, self.output), ("t", "w", "u", "y"))
        data = {
            heading: factor * servo()["angle" if self.position and c == "y" else c] for (heading, factor), c in columns
        }
        if self.position:
            data[self.output[0]] = np.round(data[self.output[0]])
        rows = [self.separator.join(data)]
        rows += [
            self.separator.join(f"{v:.12g}" for v in row).replace(".", self.decimal) for row in zip(*data.values())
        ]
        path.write_bytes(("\r\n".join(rows) + "\r\n").encode(self.encoding))
        return path


T, MS = ("time [s]", 1.0), ("t_ms", 1e3)
EXPORTS = {
    "SI": Export(T, ("excitation [N m]", 1), ("torque [N m]", 1), ("speed [rad/s]", 1)),
    "suffixes": Export(("t_s", 1), ("exc_Nm", 1), ("torque_Nm", 1), ("speed_rad_s", 1)),
    "rpm": Export(("t_s", 1), ("exc_Nm", 1), ("torque_Nm", 1), ("speed_rpm", RPM)),
    "1/min": Export(T, ("w [N m]", 1), ("u [N m]", 1), ("n [1/min]", RPM)),
    "deg/s": Export(("time [ms]", 1e3), ("w [Nm]", 1), ("u [mNm]", 1e3), ("velocity [deg/s]", 180 / pi)),
    "German": Export(
        ("Zeit [s]", 1), ("Anregung [Ncm]", 100), ("Solldrehmoment [Nm]", 1), ("Istdrehzahl [U/min]", RPM),
        separator=";", decimal=",", encoding="cp1252",
    ),
    "degrees in Latin-1": Export(T, ("w [N·m]", 1), ("u [N·m]", 1), ("y [°/s]", 180 / pi), encoding="latin-1"),
    "Chinese": Export(
        ("时间 [s]", 1), ("激励 [N·m]", 1), ("转矩 [N·m]", 1), ("转速 [转/分]", RPM), encoding="gb18030"
    ),
    "Chinese in UTF-8": Export(("时间 [s]", 1), ("激励 [N·m]", 1), ("转矩 [N·m]", 1), ("转速 [r/min]", RPM)),
    "% of the rated torque": Export(
        MS, ("Setpoint addition [%]", PERCENT), ("Actual torque [%]", PERCENT), ("Actual speed [min-1]", RPM),
        units={"Setpoint addition": "0.024 N m", "Actual torque": "0.024 N m"},
    ),
    "torque constant": Export(
        MS, ("iq_inject_A", AMPERE), ("iq_A", AMPERE), ("speed_rpm", RPM), units={"iq_A": "0.35 N m"}
    ),
    "without units": Export(T, ("a", 1), ("b", 1e3), ("c", 1), units={"b": "mNm", "c": "rad/s"}),
}  # fmt: skip
