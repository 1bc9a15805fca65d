"""Pairs of masses under a torque: compared with the simulated axis, SciPy's matrix exponential, and each other."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from livebode.core import SimulationError
from livebode.simulation import BeltAxis, Drive, Engine, Mechanics, Pair, Standstill, engine_settings, open_belt
from tests.support.errors import refused

RATE_HZ, RADIUS_M = 4000.0, 0.019
RNG = np.random.default_rng(16)
TORQUE = RNG.normal(size=2000)
STIFFNESS = np.linspace(4e5, 6e5, TORQUE.size)
DAMPING = np.full(TORQUE.size, 130.0)
PAIRS = [Pair(0.0028 * (1 + 0.02 * i), 6.7 - 0.1 * i, 1 + 0.01 * i, 1 - 0.02 * i) for i in range(11)]


def test_each_pair_moves_as_the_simulated_axis_does() -> None:
    motor, cart = open_belt(PAIRS, TORQUE, STIFFNESS, DAMPING, rate_hz=RATE_HZ, radius_m=RADIUS_M)
    drive = Drive(rate_hz=RATE_HZ, velocity_rate_hz=RATE_HZ, position_rate_hz=RATE_HZ, velocity_gain_n_m_s=0.0,
                  position_gain_per_s=0.0)  # fmt: skip
    for pair, speeds in zip(PAIRS, zip(motor, cart)):
        mechanics = Mechanics(
            inertia_kg_m2=pair.inertia_kg_m2, pulley_inertia_kg_m2=pair.inertia_kg_m2 / 4, load_kg=pair.load_kg,
            radius_m=RADIUS_M, stiffness_n_per_m=STIFFNESS[0], damping_n_s_per_m=DAMPING[0], nominal_position_m=1.0,
            frozen_position_m=1.0,
        )  # fmt: skip
        settings = engine_settings(BeltAxis(mechanics=mechanics, drive=drive, motion=Standstill(position_m=1.0)))
        inputs = np.zeros((10, TORQUE.size))
        inputs[0], inputs[2], inputs[6] = 1.0 / RADIUS_M, TORQUE, pair.load_kg
        inputs[4], inputs[5] = pair.stiffness * STIFFNESS / STIFFNESS[0], pair.damping * DAMPING / DAMPING[0]
        expected = np.empty((7, TORQUE.size))
        assert Engine(settings, 1.0).advance(inputs, expected) == TORQUE.size
        for found, row in zip(speeds, (1, 6)):
            assert np.abs(found - expected[row]).max() <= 1e-10 * np.abs(expected[row]).max()


def test_a_step_is_the_matrix_exponential() -> None:
    pair, k, b = PAIRS[3], 5e5, 130.0
    j, m, r = pair.inertia_kg_m2, pair.load_kg, RADIUS_M
    k1, b1 = k * pair.stiffness, b * pair.damping
    rate = np.array([0.0, r, -1.0])
    force = k1 * np.array([1.0, 0, 0]) + b1 * rate
    system = np.zeros((4, 4))
    system[:3, :3] = [rate, -r * force / j, force / m]
    system[1, 3] = 1 / j
    step = expm(system / RATE_HZ)
    state = np.zeros(4)
    expected = []
    for torque in TORQUE[:200]:
        expected.append(state[1:3])
        state = step @ np.append(state[:3], torque)
    ones = np.ones(200)
    found = open_belt([pair], TORQUE[:200], k * ones, b * ones, rate_hz=RATE_HZ, radius_m=r)
    assert np.allclose(np.stack([one[0] for one in found], axis=1), expected, rtol=0, atol=1e-11)


@pytest.mark.parametrize("pairs", [2, 8, 9])
def test_a_pair_moves_the_same_in_any_company_and_under_a_torque_of_its_own(pairs: int) -> None:
    alone = [open_belt([one], TORQUE, STIFFNESS, DAMPING, rate_hz=RATE_HZ, radius_m=RADIUS_M)[0][0] for one in PAIRS]
    torques = np.tile(TORQUE, (pairs, 1))
    torques[0] *= 2
    motor, _ = open_belt(PAIRS[:pairs], torques, STIFFNESS, DAMPING, rate_hz=RATE_HZ, radius_m=RADIUS_M)
    assert np.array_equal(motor[0], 2 * alone[0])
    assert np.array_equal(motor[1:], alone[1:pairs])


def test_a_pair_that_diverges_is_refused_with_the_sample() -> None:
    with refused(SimulationError, "diverged"):
        open_belt([Pair(1e-12, 6.7)], TORQUE, STIFFNESS, DAMPING, rate_hz=RATE_HZ, radius_m=RADIUS_M)
