"""Mechanisms with several motors in their loops, compared with an integration of their equations by SciPy."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from livebode.core import Lines, UsageError
from livebode.excitation import MatrixExcitation
from livebode.simulation import CoreXY, CoreXYLoop, Gantry, GantryLoop, ModalLoop, ModalMachine, MotorLoop
from livebode_matrix import MatrixSettings, MatrixTracker

Floats = NDArray[np.float64]
Forces = Callable[[Floats, Floats, Floats], Floats]
"""Accelerations of positions, speeds and torques."""


def integrated(
    forces: list[Forces], seen: list[Callable[[Floats], Floats]], loop: MotorLoop, w: Floats, noise: Floats
) -> Floats:
    """u and outputs, tick by tick; the equations change at equal parts of the recording."""
    motors, samples = w.shape
    gains, times = np.broadcast_to(loop.gain_n_m_s, motors), np.broadcast_to(loop.integral_time_s, motors)
    state, integral, found = np.zeros(2 * 4), np.zeros(motors), []
    for n in range(samples):
        part = n * len(forces) // samples
        outputs = seen[part](state[4:]) + noise[:, n]
        integral = integral + outputs[:motors] / (loop.rate_hz * times)
        torque = w[:, n] - gains * (outputs[:motors] + integral)
        found.append([*torque, *outputs])

        def slope(_: float, x: Floats, part: int = part, torque: Floats = torque) -> Floats:
            return np.concatenate([x[4:], forces[part](x[:4], x[4:], torque)])

        reached = solve_ivp(slope, (0, 1 / loop.rate_hz), state, method="DOP853", rtol=1e-11, atol=1e-13)
        state = reached.y[:, -1]
    return np.array(found).T


def gantry_forces(g: Gantry) -> Forces:
    def forces(q: Floats, v: Floats, torque: Floats) -> Floats:
        pull = [
            g.stiffness_n_per_m * (g.radius_m * q[i] - q[2] - side * g.half_width_m * q[3])
            + g.damping_n_s_per_m * (g.radius_m * v[i] - v[2] - side * g.half_width_m * v[3])
            for i, side in ((0, 1), (1, -1))
        ]
        motors = [
            (torque[i] - g.radius_m * pull[i] - g.motor_viscous_n_m_s * v[i]) / g.motor_inertia_kg_m2 for i in (0, 1)
        ]
        mass = np.array(
            [
                [g.beam_kg + g.cart_kg, g.cart_kg * g.cart_m],
                [g.cart_kg * g.cart_m, g.beam_inertia_kg_m2 + g.cart_kg * g.cart_m**2],
            ]
        )
        yaw = g.half_width_m * (pull[0] - pull[1]) - g.yaw_stiffness_n_m * q[3] - g.yaw_damping_n_m_s * v[3]
        return np.array([*motors, *np.linalg.solve(mass, [pull[0] + pull[1], yaw])])

    return forces


def corexy_forces(c: CoreXY) -> Forces:
    def forces(q: Floats, v: Floats, torque: Floats) -> Floats:
        a = c.stiffness_a_n_per_m * (c.radius_m * q[0] - q[2] - q[3])
        a += c.damping_n_s_per_m * (c.radius_m * v[0] - v[2] - v[3])
        b = c.stiffness_b_n_per_m * (c.radius_m * q[1] - q[2] + q[3])
        b += c.damping_n_s_per_m * (c.radius_m * v[1] - v[2] + v[3])
        motors = [
            (torque[i] - c.radius_m * pull - c.motor_viscous_n_m_s * v[i]) / c.motor_inertia_kg_m2
            for i, pull in enumerate((a, b))
        ]
        x = (a + b - c.guide_viscous_n_s_per_m * v[2]) / c.cart_kg
        y = (a - b - c.guide_viscous_n_s_per_m * v[3]) / (c.cart_kg + c.bridge_kg)
        return np.array([*motors, x, y])

    return forces


def test_a_corexy_machine_in_its_loop_moves_as_its_integrated_equations() -> None:
    loop = CoreXYLoop(corexy=CoreXY(stiffness_b_n_per_m=1.5e4), rate_hz=1000.0, gain_n_m_s=(0.004, 0.002))
    rng = np.random.default_rng(1)
    w, noise = 0.1 * rng.standard_normal((2, 50)), 0.01 * rng.standard_normal((4, 50))
    own = loop.simulate(w, noise=noise).data[2:]
    theirs = integrated([corexy_forces(loop.corexy)], [lambda v: v], loop, w, noise)
    assert (np.abs(own - theirs).max(axis=1) < 1e-6 * np.abs(theirs).max(axis=1)).all()


def test_a_gantry_whose_cart_goes_to_another_place_moves_as_its_integrated_equations() -> None:
    places = (-0.3, 0.1, 0.4)
    loop = GantryLoop(rate_hz=1000.0, gain_n_m_s=(0.3, 0.2), integral_time_s=(0.05, 0.08))
    rng = np.random.default_rng(2)
    w, noise = rng.standard_normal((2, 60)), 0.01 * rng.standard_normal((3, 60))
    own = loop.simulate_places(w, places, noise=noise).data[2:]
    forces = [gantry_forces(Gantry(cart_m=place)) for place in places]
    seen = [lambda v, place=place: np.array([v[0], v[1], v[2] + place * v[3]]) for place in places]
    theirs = integrated(forces, seen, loop, w, noise)
    assert (np.abs(own - theirs).max(axis=1) < 1e-6 * np.abs(theirs).max(axis=1)).all()


def test_the_modes_of_a_gantry_without_damping_are_a_machine_of_modes_that_moves_alike() -> None:
    gantry = Gantry(damping_n_s_per_m=0.0, motor_viscous_n_m_s=0.0, yaw_damping_n_m_s=0.0)
    mass, _, stiffness = gantry.matrices
    root = np.linalg.inv(np.linalg.cholesky(mass))
    squares, shapes = np.linalg.eigh(root @ stiffness @ root.T)
    shapes = root.T @ shapes
    modes = ModalMachine(
        names=("velocity1", "velocity2", "cart"),
        units=("rad/s", "rad/s", "m/s"),
        frequency_hz=(np.sqrt(np.where(squares > 1, squares, 0)) / (2 * np.pi)).tolist(),
        damping=[0.0] * 4,
        input_shapes=(shapes.T @ gantry.torque_map).tolist(),
        output_shapes=(gantry.output_map @ shapes).T.tolist(),
    )
    w = np.random.default_rng(3).standard_normal((2, 500))
    own, other = (loop.simulate(w).data for loop in (ModalLoop(machine=modes), GantryLoop(gantry=gantry)))
    assert np.abs(own - other).max() < 1e-6 * np.abs(other).max()


def test_travels_are_the_integrals_of_the_outputs() -> None:
    loop = GantryLoop()
    inputs = loop.inputs(np.random.default_rng(4).standard_normal((2, 3000)))
    speeds, travels = loop.signals(inputs)[4:], loop.travels(inputs)
    summed = np.concatenate([np.zeros((3, 1)), np.cumsum((speeds[:, 1:] + speeds[:, :-1]) / 2, axis=1)], axis=1)
    assert np.abs(summed / loop.rate_hz - travels).max() < 0.01 * np.abs(travels).max()


def test_several_runs_at_once_are_those_one_after_the_other() -> None:
    loop = GantryLoop()
    inputs = np.random.default_rng(5).standard_normal((7, 77, 3))
    together = loop.signals(inputs)
    assert np.allclose(together, np.stack([loop.signals(one) for one in np.moveaxis(inputs, 2, 0)], axis=2), atol=1e-12)


def test_the_axes_of_a_corexy_machine_are_measured_by_the_transformation_of_its_motors() -> None:
    """With equal belts x and y do not couple, although the motors do."""
    loop, lines = CoreXYLoop(), Lines.parse("20:80:20", rate_hz=4000, window=200)
    settle = loop.settle_periods(200, 1e-12)
    excitation = MatrixExcitation.orthogonal(lines, 2, 0.05, dwell=settle + 1, settle=settle)
    block = loop.simulate(np.tile(excitation.samples, 2))
    names = {role: [f"{channel}1", f"{channel}2"] for role, channel in
             (("output", "velocity"), ("input", "u"), ("excitation", "w"))}  # fmt: skip
    settings = MatrixSettings(lines=lines, **names, dwell=excitation.dwell, settle=settle, hop=200)
    motors = MatrixTracker(settings).process(block)[-1:]
    axes = motors.transformed(*loop.corexy.to_axes, (("x", "y"), ("Fx", "Fy")))
    truth = loop.corexy.axes_response(lines.frequency_hz, loop.rate_hz)
    assert np.abs(axes.value[0] - truth).max() < 1e-8 * np.abs(truth).max()
    assert np.abs(axes.value[0, :, 0, 1]).max() < 1e-8 * np.abs(truth).max()
    assert np.abs(motors.value[0, :, 0, 1] / motors.value[0, :, 0, 0]).max() > 0.3


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: GantryLoop(gain_n_m_s=(0.3, 0.2, 0.1)),
        lambda: GantryLoop(rate_hz=0.0),
        lambda: CoreXY(cart_kg=0.0),
        lambda: GantryLoop().simulate_places(np.zeros((2, 10)), [0.1, 0.2, 0.3]),
        lambda: GantryLoop().simulate_places(np.zeros((2, 10)), [0.6]),
        lambda: ModalMachine(
            names=("v",), units=("rad/s",), frequency_hz=(1.0, 2.0), damping=(0.1,),
            input_shapes=((1.0,), (1.0,)), output_shapes=((1.0,), (1.0,)),
        ),
        lambda: ModalMachine(
            names=("v",), units=("rad/s",), frequency_hz=(1.0,), damping=(-0.1,),
            input_shapes=((1.0,),), output_shapes=((1.0,),),
        ),
        lambda: ModalMachine(
            names=("v",), units=("rad/s",), frequency_hz=(1.0,), damping=(0.1,),
            input_shapes=((1.0, 2.0),), output_shapes=((1.0,),),
        ),
    ],
)  # fmt: skip
def test_an_impossible_machine_is_rejected(wrong: Callable[[], object]) -> None:
    with pytest.raises(UsageError):
        wrong()
