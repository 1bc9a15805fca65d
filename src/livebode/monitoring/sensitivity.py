"""A MovingModel driven by the measured torque, and how its motion answers to each of its parameters."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.monitoring.offset import Offset
from livebode.monitoring.ripple import torques
from livebode.motion import MovingModel
from livebode.motion.replay import INPUTS, PLACE_M, advance, engine, late, torque_only

Floats = NDArray[np.float64]

DIRECTIONS = ("stiffness", "load", "damping", "inertia")
"""What a change is told apart into: Keff, mL, bs, Js; each as a small change of its logarithm."""

_STEP = 1e-3  # of a logarithm; the change is linear to a twentieth of a percent
_GRID = 4096


class Replay:
    """The model under a torque along a way, five times: as it is, and with each parameter a little larger.

    What made the torque does not matter: excitation, motion, and the controllers' answer to noise move the model as
    they moved the machine, at any speed and in any direction.
    """

    def __init__(self, model: MovingModel, rate_hz: float, delay_s: float = 0.0) -> None:
        self._rate_hz, self._delay_samples = rate_hz, delay_s * rate_hz
        self._at = np.linspace(model.low_m, model.high_m, _GRID)
        stiffness, damping = model.stiffness_at(self._at), model.damping_at(self._at)
        most = float(stiffness.max()), float(damping.max())
        self._stiffness, self._damping = stiffness / most[0], damping / most[1]
        self._load_kg, self._radius_m = model.load_kg, model.radius_m
        self._settings = engine(model, torque_only(rate_hz), most)
        self._inertia_kg_m2 = model.inertia_kg_m2

    def __call__(self, u: Floats, position_m: Floats, offset: Offset) -> tuple[Floats, Floats]:
        """Velocity of the motor from rest, rad/s (samples,), and its slopes (5, samples).

        By the logarithm of each direction, and by the velocity's delay, s.

        The model is off its own parameters by `offset`. What is not in u or not in the model, such as friction, makes
        the velocity drift away slowly.
        """
        inputs, inertia_kg_m2 = self._inputs(u, position_m, offset)
        plain = self._run(inertia_kg_m2, inputs)
        slopes = np.empty((len(DIRECTIONS) + 1, u.size))
        for i, row in enumerate((4, 6, 5)):
            moved = inputs.copy()
            moved[row] *= 1.0 + _STEP
            slopes[i] = self._run(inertia_kg_m2, moved)
        slopes[3] = self._run(inertia_kg_m2 * (1.0 + _STEP), inputs)
        slopes[:4] = (slopes[:4] - plain) / _STEP
        slopes[4] = -np.gradient(plain) * self._rate_hz
        return plain, slopes

    def plain(self, u: Floats, position_m: Floats, offset: Offset) -> Floats:
        """The velocity alone."""
        inputs, inertia_kg_m2 = self._inputs(u, position_m, offset)
        return self._run(inertia_kg_m2, inputs)

    def ripple(self, cycles_per_m: Floats, position_m: Floats, shaft_m: Floats) -> Floats:
        """Velocity under cosine and sine of each order alone, of 1 N m, rad/s (2·orders, samples)."""
        inputs, inertia_kg_m2 = self._inputs(np.zeros(position_m.size), position_m, Offset())
        velocity = np.empty((2 * cycles_per_m.size, position_m.size))
        for row, torque in zip(velocity, torques(cycles_per_m, shaft_m)):
            inputs[2] = torque
            row[:] = self._run(inertia_kg_m2, inputs)
        return velocity

    def _inputs(self, u: Floats, position_m: Floats, offset: Offset) -> tuple[Floats, float]:
        """Of the engine, and the motor's inertia."""
        factors = np.exp(offset.logarithms)
        inputs = np.zeros((INPUTS, u.size))
        inputs[0], inputs[2] = PLACE_M / self._radius_m, u
        inputs[4] = np.interp(position_m, self._at, self._stiffness * np.exp(offset.stiffness(self._at)))
        inputs[5] = np.interp(position_m, self._at, self._damping) * factors[2]
        inputs[6] = self._load_kg * factors[1]
        return inputs, float(self._inertia_kg_m2 * factors[3])

    def _run(self, inertia_kg_m2: float, inputs: Floats) -> Floats:
        settings = self._settings | {"motor_inertia_kg_m2": inertia_kg_m2}
        wrong = "the baseline's model does not stay finite under this torque"
        velocity = np.asarray(advance(settings, inputs, wrong, "check its signals and units")[1])
        return late(velocity, self._delay_samples)
