"""Models behind a hold: against python-control, against closed form, and there and back."""

from __future__ import annotations

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import FitError, UsageError
from livebode.fitting import EvaluationGrid, Parameter, Rigid, ThreeMass, Transfer, TwoMass, TwoMassGain, two_masses
from livebode.fitting.modal import chain_of
from livebode.fitting.transfer import roots, to_continuous, to_discrete
from livebode.simulation import BeltAxis, Mechanics
from tests.support.errors import refused
from tests.support.fitted import Pendulum

RATE_HZ = 4000.0
F_HZ = np.arange(20.0, 141.0, 20.0)
GRID = EvaluationGrid(F_HZ, RATE_HZ)
BELT = np.array([0.0028, 6.7, 5.0e5, 130.0, 0.0, 0.0, 0.0])


def held(system: control.StateSpace, frequency_hz: np.ndarray = F_HZ, rate_hz: float = RATE_HZ) -> np.ndarray:
    sampled = control.sample_system(control.ss(system), 1 / rate_hz, "zoh")
    return np.array([complex(sampled(np.exp(2j * np.pi * f / rate_hz))) for f in frequency_hz])


def chain(masses: np.ndarray, springs: np.ndarray, dampers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A and B of masses in a row, positions first, the torque on the first."""
    n = len(masses)
    tie = np.diff(np.eye(n), axis=0)
    k, d = (tie.T @ np.diag(x) @ tie / masses[:, None] for x in (springs, dampers))
    a = np.block([[np.zeros((n, n)), np.eye(n)], [-k, -d]])
    b = np.zeros((2 * n, 1))
    b[n] = 1 / masses[0]
    return a, b


def test_two_masses_are_those_of_the_axis_and_of_equation_14() -> None:
    found = TwoMass(radius_m=0.019).at(BELT, GRID)
    axis = BeltAxis(mechanics=Mechanics())
    assert np.allclose(found, axis.linear(0.8).sampled(RATE_HZ).response(F_HZ), rtol=1e-9)
    js, load, keff, bs = BELT[:4]
    s, total = 2j * np.pi * F_HZ, js + load * 0.019**2
    by_14 = (load * s**2 + bs * s + keff) / (js * load / total * s**2 + bs * s + keff) / (total * s)
    assert np.allclose(TwoMass(radius_m=0.019).at(BELT, GRID._replace(hold="none")), by_14, rtol=1e-12)
    shaft = np.log(BELT[:4] * [1, 0.019**2, 0.019**2, 0.019**2])
    assert np.allclose(found, two_masses.sampled(shaft, np.exp(s / RATE_HZ), RATE_HZ), rtol=1e-12)


@pytest.mark.parametrize("side", ["motor", "load"])
@pytest.mark.parametrize("output", ["velocity", "position"])
def test_masses_in_a_row_are_their_equations_of_motion_behind_a_hold(side: str, output: str) -> None:
    for model, masses, springs, dampers in (
        (TwoMass, [0.003, 0.002], [300.0], [0.02]),
        (ThreeMass, [0.003, 0.001, 0.002], [200.0, 100.0], [0.02, 0.01]),
    ):
        a, b = chain(np.array(masses), np.array(springs), np.array(dampers))
        n = len(masses)
        c = np.zeros((1, 2 * n))
        c[0, (n if output == "velocity" else 0) + (0 if side == "motor" else n - 1)] = 1
        values = np.array([*masses, *springs, *dampers] + [0.0] * (len(model().names) - 3 * n + 2))
        found = model(side=side, output=output).at(values, GRID)
        assert np.allclose(found, held(control.ss(a, b, c, 0)), rtol=1e-9)


def test_friction_is_in_the_equations_of_motion() -> None:
    a, b = chain(np.array([0.003, 0.002]), np.array([300.0]), np.array([0.02]))
    a[2, 2] -= 0.05 / 0.003
    a[3, 3] -= 0.04 / 0.002
    for side, c in (("motor", [0, 0, 1, 0]), ("load", [0, 0, 0, 1])):
        found = TwoMass(side=side).at([0.003, 0.002, 300.0, 0.02, 0.05, 0.04, 0.0], GRID)
        assert np.allclose(found, held(control.ss(a, b, [c], 0)), rtol=1e-9)
    assert np.allclose(Rigid().at([0.003, 0.05, 0.0], GRID), held(control.tf([1], [0.003, 0.05])), rtol=1e-9)


@pytest.mark.parametrize("output", ["velocity", "position"])
def test_a_friction_that_vanishes_ends_in_an_integrator(output: str) -> None:
    """Rows with and without friction, together: each is the response of its equations of motion."""
    friction = np.array([1e-2, 1e-4, 1e-6, 1e-7, 1e-8, 1e-9, 1e-12, 1e-200, 0.0])
    values = np.tile([0.003, 0.002, 300.0, 0.02, 0.0, 0.0, 1.3 / RATE_HZ], (len(friction), 1))
    values[:, 4] = values[:, 5] = friction
    c = [1, 0, 0, 0] if output == "position" else [0, 0, 1, 0]
    for value, found in zip(friction, TwoMass(output=output).at(values, GRID)):
        a, b = chain(np.array([0.003, 0.002]), np.array([300.0]), np.array([0.02]))
        a[2, 2] -= value / 0.003
        a[3, 3] -= value / 0.002
        alone = TwoMass(output=output).at([*values[0, :4], value, value, 0.0], GRID)
        assert np.allclose(alone, held(control.ss(a, b, [c], 0)), rtol=1e-6)
        shifted = TwoMass(output=output).at([*values[0, :4], value, value, 1.3 / RATE_HZ], GRID)
        assert np.allclose(found, shifted, rtol=1e-9)
    none = EvaluationGrid(np.empty(0), RATE_HZ)
    assert TwoMass(output=output).at(values, none).shape == (len(friction), 0)


def test_a_belt_moves_its_load_in_metres() -> None:
    belt, shaft = TwoMass(radius_m=0.019, side="load"), TwoMass(side="load")
    turned = BELT * [1, 0.019**2, 0.019**2, 0.019**2, 1, 1, 1]
    assert np.allclose(belt.at(BELT, GRID), 0.019 * shaft.at(turned, GRID), rtol=1e-12)


@given(delay=st.floats(0, 3e-3))
@settings(max_examples=40, deadline=None)
def test_a_delay_of_any_length_is_exact(delay: float) -> None:
    """Against the same hold in steps a hundredth of the tick, on which the delay is rounded to whole steps."""
    steps = 100
    delay = round(delay * RATE_HZ * steps) / (RATE_HZ * steps)
    a, b = chain(np.array([0.003, 0.002]), np.array([300.0]), np.array([0.02]))
    fine = control.sample_system(control.ss(a, b, [[0, 0, 1, 0]], 0), 1 / (RATE_HZ * steps), "zoh")
    late = round(delay * RATE_HZ * steps)
    power = [np.linalg.matrix_power(fine.A, i) @ fine.B for i in range(steps)]
    whole, part = divmod(late, steps)
    now, before = sum(power[: steps - part]), sum(power[steps - part :], np.zeros_like(fine.B))
    tick = np.linalg.matrix_power(fine.A, steps)
    z = np.exp(2j * np.pi * F_HZ / RATE_HZ)
    exact = [(fine.C @ np.linalg.solve(x * np.eye(4) - tick, now + before / x))[0, 0] / x**whole for x in z]
    assert np.allclose(TwoMass().at([0.003, 0.002, 300.0, 0.02, 0, 0, delay], GRID), exact, rtol=1e-7)


@given(
    hz=st.floats(20, 300), damping=st.floats(0.01, 0.9), zero=st.floats(1.0, 100.0), kind=st.integers(0, 2),
    gain=st.floats(1e-3, 1e3),
)  # fmt: skip
@settings(max_examples=60, deadline=None)
def test_continuous_to_discrete_and_back(hz: float, damping: float, zero: float, kind: int, gain: float) -> None:
    w = 2 * np.pi * hz
    numerator, denominator = [gain, gain * zero * w], [1.0, 2 * damping * w, w * w] + [0.0] * kind
    transfer = Transfer.of(numerator, denominator)
    b, a = to_discrete(transfer, 2000.0)
    back = to_continuous(b, a, 2000.0)
    s = 2j * np.pi * np.geomspace(hz / 3, hz * 3, 5)
    assert back.integrators == kind
    assert np.allclose(back.response(s), transfer.response(s), rtol=1e-4)
    z = np.exp(s / 2000.0)
    assert np.allclose(np.polyval(b, z) / np.polyval(a, z), transfer.sampled(z, 2000.0), rtol=1e-6)


def test_a_discrete_system_is_that_of_python_control_and_delays_by_poles_at_zero() -> None:
    transfer = TwoMass(radius_m=0.019).continuous(BELT)
    b, a = to_discrete(transfer, RATE_HZ)
    system = control.tf(transfer.numerator, [*transfer.denominator, 0.0])
    theirs = control.sample_system(control.ss(system), 1 / RATE_HZ, "zoh")
    z = np.exp(2j * np.pi * F_HZ / RATE_HZ)
    assert np.allclose(np.polyval(b, z) / np.polyval(a, z), [complex(theirs(x)) for x in z], rtol=1e-8)
    late, below = to_discrete(transfer, RATE_HZ, 2.4 / RATE_HZ)
    assert len(below) == len(a) + 3
    assert np.allclose(
        np.polyval(late, z) / np.polyval(below, z), transfer.sampled(z, RATE_HZ, 2.4 / RATE_HZ), rtol=1e-8
    )


def test_discrete_models_without_a_continuous_one_are_refused() -> None:
    with refused(FitError, "no-continuous-model", pole=pytest.approx(-0.5)):
        to_continuous([1.0], [1.0, 0.5], 100.0)
    with refused(FitError, "not-proper", numerator_degree=1, denominator_degree=1):
        to_continuous([1.0, 0.0], [1.0, -0.5], 100.0)
    with refused(FitError, "not-causal", delay_s=-1e-3):
        to_discrete(Transfer.of([1.0], [1.0, 1.0]), 100.0, -1e-3)
    with refused(FitError, "not-proper", numerator_degree=1, denominator_degree=1, integrators=0):
        Transfer.of([1.0, 0.0], [1.0, 1.0])
    with refused(FitError, "not-proper", integrators=3):
        Transfer.of([1.0], [1.0, 0.0, 0.0, 0.0])


@given(st.lists(st.floats(-9, 9).filter(lambda x: abs(x) > 1e-3), min_size=3, max_size=6))
@settings(max_examples=60, deadline=None)
def test_roots_are_those_of_numpy(coefficients: list[float]) -> None:
    found = roots(np.array(coefficients))
    values = np.polyval(coefficients, found)
    slack = np.polyval(np.abs(coefficients), np.abs(found))
    assert np.all(np.abs(values) <= 1e-9 * slack)
    assert np.isclose(found.sum(), -coefficients[1] / coefficients[0], rtol=1e-6, atol=1e-6)


def test_two_equal_poles_are_sampled() -> None:
    critical = Transfer.of([100.0], [1.0, 20.0, 100.0])
    z = np.exp(2j * np.pi * F_HZ / RATE_HZ)
    assert np.allclose(
        critical.sampled(z, RATE_HZ), held(control.ss(control.tf([100.0], [1.0, 20.0, 100.0]))), rtol=1e-6
    )


@given(st.lists(st.floats(0.1, 10), min_size=3, max_size=3), st.lists(st.floats(10, 1e4), min_size=2, max_size=2))
@settings(max_examples=40, deadline=None)
def test_modes_at_the_first_mass_give_the_chain_back(masses: list[float], springs: list[float]) -> None:
    m = np.array(masses)
    a, _ = chain(m, np.array(springs), np.zeros(2))
    root = np.sqrt(m)
    squares, shapes = np.linalg.eigh(-a[3:, :3] * root[:, None] / root)
    weights = shapes[0] ** 2 / m[0]
    if weights.min() < 1e-3 * weights.max():
        return  # a mode that the first mass does not see tells nothing
    inertia, spring, _ = chain_of(weights, np.sqrt(squares[1:]))
    assert np.allclose(inertia, m, rtol=1e-5)
    assert np.allclose(spring, springs, rtol=1e-5)


def test_derived_quantities_follow_from_the_parameters() -> None:
    model = TwoMass(radius_m=0.019)
    found = dict(zip(model.derived_names, model.derived(BELT)))
    js, load, keff, bs = BELT[:4] * [1, 0.019**2, 0.019**2, 0.019**2]
    reduced = js * load / (js + load)
    assert found["resonance"] == pytest.approx(np.sqrt(keff / reduced) / (2 * np.pi))
    assert found["antiresonance"] == pytest.approx(np.sqrt(keff / load) / (2 * np.pi))
    assert found["resonance_damping"] == pytest.approx(bs / (2 * np.sqrt(keff * reduced)))
    assert found["antiresonance_q"] == pytest.approx(np.sqrt(keff * load) / bs)
    assert found["inertia_ratio"] == pytest.approx(load / js)
    gained = TwoMassGain()
    values = [1 / (js + load), *(found[n] for n in ("antiresonance", "resonance")), 0, 0, 0]
    values[3:5] = found["antiresonance_damping"], found["resonance_damping"]
    assert np.allclose(gained.at(values, GRID), model.at(BELT, GRID), rtol=1e-9)
    assert gained.derived(np.array(values))[-1] == pytest.approx(load / js)


def test_a_users_model_is_sampled_and_derived_like_the_others() -> None:
    model = Pendulum()
    values = [0.02, 0.3, 900.0, 0.0]
    assert np.allclose(model.at(values, GRID), held(control.tf([1.0], [0.02, 0.3, 900.0])), rtol=1e-9)
    assert model.derived(np.array(values))[0] == pytest.approx(np.sqrt(900 / 0.02) / (2 * np.pi))
    with refused(UsageError, "out-of-range", argument="start", parameter="J", value=10.0):
        Parameter("J", "kg m²", start=10.0, low=1.0, high=2.0)


@pytest.mark.parametrize("delay_ticks", [0.0, 1.3])
def test_numerators_that_share_a_denominator_are_sampled_as_each_alone(delay_ticks: float) -> None:
    a1, a0, z = np.array([3.0, 40.0, 0.5]), np.array([1e4, 400.0, 2e5]), np.exp(2j * np.pi * F_HZ / RATE_HZ)
    above = [np.tile([0.0, 1.0], (3, 1)), np.tile([1.0, 0.0], (3, 1))]
    below = [np.ones((3, 1)), a1[:, np.newaxis], a0[:, np.newaxis]]
    both = Transfer.of(above, below).sampled(z, RATE_HZ, delay_ticks / RATE_HZ)
    alone = [
        Transfer.of(n, [np.ones(3), a1, a0]).sampled(z, RATE_HZ, delay_ticks / RATE_HZ) for n in ([1.0], [1.0, 0.0])
    ]
    np.testing.assert_allclose(both, np.stack(alone, axis=1), rtol=1e-12)
