"""The torque noise of a quantised encoder, predicted for a proposal and simulated with it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from livebode.core import UsageError
from livebode.simulation import BeltAxis, Drive, Friction, Mechanics, Sensor, SimulatedAxis
from livebode_control.tuning import LoopSpecification, tune
from studies.tune_steps import LIMITS, PLACES_M, RATE_HZ, Speeds, applied, measured

COUNTS = 1 << 13
AXIS = BeltAxis(
    mechanics=Mechanics(frozen_position_m=1.0),
    friction=Friction(motor_viscous_n_m_s=0.005),
    drive=Drive(position_rate_hz=RATE_HZ, position_gain_per_s=10.0),
    sensor=Sensor(encoder_counts_per_turn=COUNTS),
)
STEP = 2 * np.pi / COUNTS


def simulated_rms_n_m(axis: BeltAxis) -> float:
    """Of the torque with the encoder less that with an exact one, in motion: over six speeds, which differ by up to one
    count in a tick, because at one speed the rounding follows a pattern that depends on it."""
    powers = []
    for speed in 0.11 + STEP * RATE_HZ * axis.mechanics.radius_m * (np.arange(6) + 0.5) / 6:
        motion = Speeds(PLACES_M[1], ((speed, 0.5), (speed, 0.5)))
        shaken = replace(axis, drive=replace(axis.drive, torque_noise_n_m=0.1), motion=motion, seconds=1.0, seed=1)
        rounded, exact = (SimulatedAxis(replace(shaken, sensor=s)).run()[0]["u"] for s in (axis.sensor, Sensor()))
        powers.append(np.var((rounded - exact)[round(0.5 * RATE_HZ) :]))
    return float(np.sqrt(np.mean(powers)))


def test_the_torque_noise_of_the_encoder_is_as_predicted_and_kept() -> None:
    responses = measured(AXIS, line_n_m=0.1)
    free = replace(LIMITS, encoder_step=STEP)
    loop = AXIS.drive.loop()
    highest = tune(responses, loop, free, loop_checked=True)
    limit = 0.12  # N m: with less the loop is slower than the lines cover
    quiet = tune(responses, loop, replace(free, input_noise=limit), loop_checked=True)
    assert quiet.noise[1] == pytest.approx(limit, rel=0.02)
    assert any("input noise" in words for words in quiet.limited_by)
    for found in (highest, quiet):
        rms = simulated_rms_n_m(applied(AXIS, found))
        assert rms == pytest.approx(found.noise[1], rel=0.15)
    assert simulated_rms_n_m(AXIS) == pytest.approx(highest.noise[0], rel=0.15)


def test_a_limit_without_an_encoder_is_refused() -> None:
    with pytest.raises(UsageError, match="specify encoder_step"):
        LoopSpecification(input_noise=0.1)
