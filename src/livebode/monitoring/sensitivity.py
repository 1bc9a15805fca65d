"""A MovingModel driven by the measured torque, and how its motion answers to each of its parameters."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.monitoring.offset import Offset
from livebode.motion import MovingModel
from livebode.motion.replay import INPUTS, PLACE_M, advance, engine, torque_only

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

    def __init__(self, model: MovingModel, rate_hz: float) -> None:
        self._at = np.linspace(model.low_m, model.high_m, _GRID)
        stiffness, damping = model.stiffness_at(self._at), model.damping_at(self._at)
        most = float(stiffness.max()), float(damping.max())
        self._stiffness, self._damping = stiffness / most[0], damping / most[1]
        self._load_kg, self._radius_m = model.load_kg, model.radius_m
        self._settings = engine(model, torque_only(rate_hz), most)
        self._inertia_kg_m2 = model.inertia_kg_m2

    def __call__(self, u: Floats, position_m: Floats, offset: Offset) -> tuple[Floats, Floats]:
        """Velocity of the motor from rest, rad/s (samples,), and its slope by each direction's logarithm (4, samples).

        The model is off its own parameters by `offset`. What is not in u or not in the model, such as friction, makes
        the velocity drift away slowly.
        """
        factors = np.exp(offset.logarithms)
        inputs = np.zeros((INPUTS, u.size))
        inputs[0], inputs[2] = PLACE_M / self._radius_m, u
        inputs[4] = np.interp(position_m, self._at, self._stiffness * np.exp(offset.stiffness(self._at)))
        inputs[5] = np.interp(position_m, self._at, self._damping) * factors[2]
        inputs[6] = self._load_kg * factors[1]
        inertia_kg_m2 = float(self._inertia_kg_m2 * factors[3])
        plain = self._run(inertia_kg_m2, inputs)
        slopes = np.empty((len(DIRECTIONS), u.size))
        for i, row in enumerate((4, 6, 5)):
            moved = inputs.copy()
            moved[row] *= 1.0 + _STEP
            slopes[i] = self._run(inertia_kg_m2, moved)
        slopes[3] = self._run(inertia_kg_m2 * (1.0 + _STEP), inputs)
        return plain, (slopes - plain) / _STEP

    def _run(self, inertia_kg_m2: float, inputs: Floats) -> Floats:
        settings = self._settings | {"motor_inertia_kg_m2": inertia_kg_m2}
        wrong = "the baseline's model does not stay finite under this torque; check its signals and units"
        return np.asarray(advance(settings, inputs, wrong)[1])
