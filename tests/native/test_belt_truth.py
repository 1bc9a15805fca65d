"""Two masses joined by a belt: the response of the exact discretisation, exact slopes, the motion of the simulator."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import cont2discrete

from livebode.kernel import (
    BeltCourse,
    BeltGrid,
    BeltMasses,
    BeltRows,
    BeltSplines,
    belt_each,
    belt_replay,
    belt_response,
    belt_together,
)
from livebode.simulation import Pair, open_belt

RATE_HZ = 4000.0
Z = np.exp(2j * np.pi * np.arange(20, 141, 20) / RATE_HZ)
GRID = BeltGrid.of(Z, RATE_HZ)
DAMPINGS = [0.005, 0.05, 5.0]  # N m s; the last one does not swing


def belt(damping: float) -> np.ndarray:
    return np.log([0.0028, 2.4e-3, 180.0, damping])


@pytest.mark.parametrize("damping", DAMPINGS)
def test_the_response_is_that_of_the_exact_discretisation(damping: float) -> None:
    motor, load, spring, damper = np.exp(belt(damping))
    a = np.array(
        [[0, 1, -1], [-spring / motor, -damper / motor, damper / motor], [spring / load, damper / load, -damper / load]]
    )
    held_a, held_b, c, _, _ = cont2discrete(
        (a, np.array([[0], [1 / motor], [0]]), np.array([[0, 1, 0]]), np.zeros((1, 1))), 1 / RATE_HZ
    )
    exact = [(c @ np.linalg.solve(z * np.eye(3) - held_a, held_b))[0, 0] for z in Z]
    assert np.allclose(belt_response(GRID, belt(damping)[np.newaxis])[0], exact, rtol=1e-10)


@pytest.mark.parametrize("damping", DAMPINGS)
def test_gradient_and_matrix_are_those_of_the_response(damping: float) -> None:
    rng = np.random.default_rng(1)
    value = belt_response(GRID, belt(damping)[np.newaxis]) * (1 + 0.1 * rng.normal(size=(1, 7)))
    rows, step = BeltRows(value, rng.uniform(1, 2, size=(1, 7))), 1e-5
    around = belt(damping) + step * np.concatenate([np.eye(4), -np.eye(4)])
    response = belt_response(GRID, around)
    slopes = rows.weight * (response[:4] - response[4:]) / (2 * step)
    rest = rows.weight * (belt_response(GRID, belt(damping)[np.newaxis]) - value)
    found = belt_each(GRID, rows, belt(damping)[np.newaxis])
    size = np.sqrt(np.diag((slopes @ slopes.conj().T).real))
    assert np.abs(found.matrix[0] - (slopes @ slopes.conj().T).real).max() < 1e-6 * size.max() ** 2
    assert np.abs(found.gradient[0] - (slopes.conj() @ rest[0]).real).max() < 1e-6 * size.max() * np.linalg.norm(rest)
    assert np.allclose(found.cost, np.linalg.norm(rest) ** 2)


def test_the_gradient_of_all_rows_is_that_of_the_cost() -> None:
    rng = np.random.default_rng(2)
    splines = BeltSplines(rng.dirichlet(np.ones(5), size=30), rng.dirichlet(np.ones(4), size=30))
    unknowns = np.concatenate([belt(0.05)[:2], np.log(rng.uniform(150, 210, 5)), np.log(rng.uniform(0.03, 0.07, 4))])
    unknowns = np.append(unknowns, 0.7)
    rows = BeltRows(belt_response(GRID, np.tile(belt(0.06), (30, 1))), np.ones((30, 7)))
    found = belt_together(GRID, rows, splines, unknowns)
    for k, gradient in enumerate(found.gradient[0]):
        step = 1e-5 * np.eye(unknowns.size)[k]
        cost = [belt_together(GRID, rows, splines, unknowns + s).cost[0] for s in (step, -step)]
        assert gradient == pytest.approx((cost[0] - cost[1]) / 4e-5, rel=1e-5, abs=1e-7 * found.cost[0])


def test_the_motion_is_that_of_the_open_belt() -> None:
    ticks = np.arange(4000)
    stiffness = 5e5 * np.exp(0.3 * np.sin(ticks / 500))
    torque = np.random.default_rng(3).normal(size=ticks.size) + 0.1
    damping = np.full(ticks.size, 100.0)
    found = belt_replay(BeltMasses(0.003, 6.7, 0.019), BeltCourse(RATE_HZ, stiffness, damping, torque))
    motor, cart = open_belt([Pair(0.003, 6.7)], torque, stiffness, damping, rate_hz=RATE_HZ, radius_m=0.019)
    for one, other in zip(found, (motor[0], cart[0])):
        assert np.abs(one - other).max() < 1e-13 * np.abs(other).max()
