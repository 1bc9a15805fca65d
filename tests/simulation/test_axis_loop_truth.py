"""Periodic state, no noise: the estimators see the exact sampled plant, and the loop has its exact responses."""

from __future__ import annotations

import control
import numpy as np
import pytest

from livebode.core import Block, as_model
from livebode.estimation import Settings, Tracker
from livebode.simulation import (
    BeltAxis,
    BeltResponse,
    Drive,
    Engine,
    Friction,
    Mechanics,
    Sensor,
    SimulatedAxis,
    Spans,
    Truth,
    TwoMassLoop,
    TwoMassPlant,
    engine_settings,
    linear,
)
from tests.support.axes import LINES, MULTISINE, RATE_HZ

SETTLED_S = 20.0
F_HZ = LINES.frequency_hz


def settled(**options: object) -> tuple[Block, Truth]:
    """Three periods in the periodic state at standstill, on the linear machine."""
    options.setdefault("mechanics", Mechanics(frozen_position_m=0.8))
    axis = BeltAxis(excitation_n_m=MULTISINE, seconds=0.3, run_in_s=SETTLED_S, **options)
    return SimulatedAxis(axis).run()


def error(block: Block, truth: np.ndarray, **options: object) -> float:
    settings = Settings(lines=LINES, output="velocity", input="u", excitation="w", **options)
    return float(np.max(np.abs(Tracker(settings).process(block)[-1].value / truth - 1)))


def spectrum(block: Block, name: str) -> np.ndarray:
    return np.fft.rfft(block[name][-400:])[list(LINES.bins)]


MACHINES = {
    "two masses": {},
    "three masses": {"mechanics": Mechanics(masses=3, frozen_position_m=1.2)},
    "viscous friction": {"friction": Friction(motor_viscous_n_m_s=0.01, load_viscous_n_s_per_m=20.0)},
    "differenced velocity": {"sensor": Sensor(velocity_differenced=True)},
    "two ticks of delay": {"drive": Drive(delay_ticks=2)},
    "position loop every fifth tick": {"drive": Drive(position_rate_hz=800)},
    "both loops slower": {"drive": Drive(velocity_rate_hz=2000, position_rate_hz=1000)},
}


@pytest.mark.parametrize("name", MACHINES)
def test_joint_is_the_sampled_plant_and_the_loop_its_exact_responses(name: str) -> None:
    block, truth = settled(**MACHINES[name])
    assert error(block, truth.sampled(truth.start).response(F_HZ)) < 1e-9
    y, u = truth.closed_loop(truth.start).responses(F_HZ)
    w = spectrum(block, "w")
    assert np.max(np.abs(spectrum(block, "velocity") / w / y - 1)) < 1e-9
    assert np.max(np.abs(spectrum(block, "u") / w / u - 1)) < 1e-9
    loop = truth.closed_loop(truth.start)
    assert np.array_equal(loop.output.response(F_HZ), y)
    assert np.array_equal(loop.input.response(F_HZ), u)


@pytest.mark.parametrize("name", ["two masses", "three masses", "viscous friction", "two ticks of delay"])
def test_indirect_is_the_sampled_plant_through_the_loop_that_the_drive_describes(name: str) -> None:
    block, truth = settled(**MACHINES[name])
    loop = truth.axis.drive.loop()
    assert error(block, truth.sampled(truth.start).response(F_HZ), estimator="indirect", loop=loop) < 1e-5


def test_the_two_mass_loop_is_the_same_machine_at_standstill() -> None:
    block, _ = settled()
    u, y = TwoMassLoop().run(MULTISINE, periods=1)
    for name, values in (("u", u[0]), ("velocity", y[0])):
        expected = np.fft.rfft(values)[list(LINES.bins)]
        assert np.max(np.abs(spectrum(block, name) / expected - 1)) < 1e-8
    at = BeltAxis().linear(0.8).sampled(RATE_HZ)
    assert np.allclose(at.response(F_HZ), TwoMassPlant().response(F_HZ), rtol=1e-10)


def test_a_plant_in_python_control_has_the_same_response() -> None:
    mechanics = Mechanics(masses=3)
    plant = linear(mechanics, Friction(load_viscous_n_s_per_m=5.0), Spans.of(mechanics, 0.5), mechanics.load_kg)
    system = control.ss(plant.a, plant.b[:, None], plant.c[None, :], 0)
    assert np.allclose(plant.response(F_HZ), as_model(system).response(F_HZ), rtol=1e-9)
    discrete = control.c2d(system, 1 / RATE_HZ, "zoh")
    assert np.allclose(plant.sampled(RATE_HZ).response(F_HZ), as_model(discrete).response(F_HZ), rtol=1e-7)


def test_two_masses_and_three_with_a_light_pulley_have_the_response_of_equation_14() -> None:
    for x in (0.35, 0.8, 1.4):
        nominal = Mechanics()
        formula = BeltResponse(0.0028, 6.7, 0.019, float(nominal.stiffness_at(x)), float(nominal.damping_at(x)))
        spans = Spans.of(nominal, x)
        two = linear(nominal, Friction(), spans, 6.7).response(F_HZ)
        assert np.allclose(two, formula.response(F_HZ), rtol=1e-11)
        light = Mechanics(masses=3, pulley_inertia_kg_m2=1e-9)
        assert np.allclose(linear(light, Friction(), spans, 6.7).response(F_HZ), two, rtol=1e-4)


def test_motor_angle_and_cart_are_the_integrals_that_they_should_be() -> None:
    plant = BeltAxis().linear(0.8)
    s = 2j * np.pi * F_HZ
    assert np.allclose(plant.out("position").response(F_HZ) * s, plant.response(F_HZ), rtol=1e-10)
    slow = np.array([0.01])
    assert np.allclose(plant.out("cart").response(slow), 0.019 * plant.out("position").response(slow), rtol=1e-5)


@pytest.mark.parametrize("masses", [2, 3])
@pytest.mark.parametrize("x", [0.25, 0.8, 1.6])
def test_the_linearisation_is_the_derivative_of_the_simulated_motion(masses: int, x: float) -> None:
    axis = BeltAxis(
        mechanics=Mechanics(masses=masses), friction=Friction(motor_viscous_n_m_s=0.01, load_viscous_n_s_per_m=20)
    )
    engine, plant = Engine(engine_settings(axis), x), axis.linear(x)
    now, rest, step = [0, 0, 0, 0, 1, 1, 6.7, 0, 1, 0], np.array(engine.plant), 1e-6
    for i, unit in enumerate(np.eye(len(rest))):
        ahead, behind = (engine.derivative(now, 0.0, list(rest + sign * step * unit)) for sign in (1, -1))
        slope = (np.array(ahead) - np.array(behind)) / (2 * step)
        assert np.allclose(slope, plant.a[:, i], rtol=1e-6, atol=1e-7 * np.max(np.abs(plant.a[:, i])))
    assert np.allclose(engine.derivative(now, 1.0, list(rest)), plant.b, atol=1e-6)
