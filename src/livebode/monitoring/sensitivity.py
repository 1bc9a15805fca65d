"""A MovingModel driven by the measured torque, and how its motion answers to each of its parameters."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.monitoring.offset import Offset
from livebode.motion import MovingModel
from livebode.nouns import InputError
from livebode.simulation._axis import Engine
from livebode.simulation.configuration import BeltAxis, engine_settings
from livebode.simulation.mechanics import Mechanics
from livebode.simulation.motion import Standstill
from livebode.simulation.settings import Drive

Floats = NDArray[np.float64]

DIRECTIONS = ("stiffness", "load", "damping", "inertia")
"""What a change is told apart into: Keff, mL, bs, Js; each as a small change of its logarithm."""

_STATES = 4
_STEP = 1e-3  # of a logarithm; the change is linear to a twentieth of a percent
_GRID = 4096
_PLACE_M = 1.0  # where the small motion is simulated; the belt is set tick by tick
_ANYWHERE_M = 1e12


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
        mechanics = Mechanics(
            inertia_kg_m2=model.inertia_kg_m2,
            pulley_inertia_kg_m2=model.inertia_kg_m2 / 4,  # part of Js with two masses
            load_kg=model.load_kg,
            radius_m=model.radius_m,
            stiffness_n_per_m=most[0],
            damping_n_s_per_m=most[1],
            nominal_position_m=_PLACE_M,
            frozen_position_m=_PLACE_M,
        )
        drive = Drive(rate_hz=rate_hz, velocity_rate_hz=rate_hz, position_rate_hz=rate_hz, velocity_gain_n_m_s=0.0,
                      position_gain_per_s=0.0)  # fmt: skip
        axis = BeltAxis(mechanics=mechanics, drive=drive, motion=Standstill(position_m=_PLACE_M))
        self._settings = engine_settings(axis) | {"position_m_min": -_ANYWHERE_M, "position_m_max": _ANYWHERE_M}
        self._inertia_kg_m2 = model.inertia_kg_m2

    def __call__(self, u: Floats, position_m: Floats, offset: Offset) -> tuple[Floats, Floats]:
        """Velocity of the motor from rest, rad/s (samples,), and its slope by each direction's logarithm (4, samples).

        The model is off its own parameters by `offset`. What is not in u or not in the model, such as friction, makes
        the velocity drift away slowly.
        """
        factors = np.exp(offset.logarithms)
        inputs = np.zeros((8, u.size))
        inputs[0], inputs[2] = _PLACE_M / self._radius_m, u
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
        output = np.empty((3 + _STATES, inputs.shape[1]))
        engine = Engine(self._settings | {"motor_inertia_kg_m2": inertia_kg_m2}, _PLACE_M)
        if engine.advance(inputs, output) < inputs.shape[1]:
            raise InputError("the baseline's model does not stay finite under this torque; check its signals and units")
        return np.asarray(output[1])
