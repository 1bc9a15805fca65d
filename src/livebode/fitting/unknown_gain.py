"""Two masses behind an unknown gain: frequencies, damping and the ratio of inertias, but no inertia."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Any, Literal

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.core import UsageError
from livebode.fitting.modal import QUALITY, scan
from livebode.fitting.physical import EvaluationGrid, Parameter, PhysicalModel, delay
from livebode.language import Message

_HZ = (1e-4, 1e6)
_RATIO = (1e-6, 2.0)


@dataclass(frozen=True, kw_only=True)
class TwoMassGain(PhysicalModel):
    """One antiresonance and one resonance over a rigid body, seen at the motor through an unknown gain.

    Where the input is a current and the torque constant is not known, inertia and stiffness cannot be determined:
    `gain` is the acceleration of the rigid body per unit of input, and both masses and the spring may be larger by any
    factor. The model gives the frequencies, independent damping ratios (so that friction is not restricted to a damper
    parallel to the spring), and `inertia_ratio` = (resonance/antiresonance)² − 1, load over motor.

    Parameters
    ----------
    output
        "velocity" or "position".

    >>> TwoMassGain(output="position").names[:3]
    ('gain', 'antiresonance', 'resonance')
    """

    output: Literal["velocity", "position"] = "velocity"
    name = Message("two-mass-gain")

    def __post_init__(self) -> None:
        if self.output not in ("velocity", "position"):
            raise UsageError(
                "not-one-of",
                f"output={self.output!r} is not supported",
                "choose 'velocity' or 'position'",
                argument="output",
                value=self.output,
                allowed=["velocity", "position"],
            )

    @property
    def parameters(self) -> tuple[Parameter, ...]:  # type: ignore[override]
        return (
            Parameter("gain", Message("rad/s² per unit of input"), 1.0, 1e-12, 1e12),
            Parameter("antiresonance", "Hz", 10.0, *_HZ),
            Parameter("resonance", "Hz", 20.0, *_HZ),
            Parameter("antiresonance_damping", "", 0.05, *_RATIO),
            Parameter("resonance_damping", "", 0.05, *_RATIO),
            delay(held=None),
        )

    def transfer(
        self, gain: Any, low: Any, high: Any, damping_low: Any, damping_high: Any
    ) -> tuple[list[Any], list[Any]]:
        low, high = 2 * pi * low, 2 * pi * high
        numerator = [gain / low**2, 2 * gain * damping_low / low, gain]
        rest = [0.0] * (1 if self.output == "velocity" else 2)
        return numerator, [1 / high**2, 2 * damping_high / high, 1.0, *rest]

    @property
    def derived_names(self) -> tuple[str, ...]:
        return ("antiresonance_q", "resonance_q", "inertia_ratio")

    @property
    def derived_units(self) -> tuple[str, ...]:
        return ("", "", "")

    def derived(self, values: Floats) -> Floats:
        _, low, high, damping_low, damping_high, _ = np.moveaxis(values, -1, 0)
        return np.stack([1 / (2 * damping_low), 1 / (2 * damping_high), (high / low) ** 2 - 1], axis=-1)

    def starts(self, value: Complex, weight: Floats, grid: EvaluationGrid) -> Floats:
        weights, omega = scan(value, weight, grid, modes=1, integrators=1 if self.output == "velocity" else 2)
        high, gain = omega[..., 0] / (2 * pi), weights[..., 0]
        low = high * np.sqrt(gain / weights.sum(axis=-1))
        damping = 0.5 / QUALITY * np.ones_like(gain)
        return np.stack([gain, low, high, damping, damping, 0 * gain], axis=-1)
