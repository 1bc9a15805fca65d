"""The plant that one controller sees while the others are active: python-control's interconnection, and its bounds."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest

from livebode.analysis import equivalent_plant
from livebode.core import Lines, MatrixLoop, MatrixResponses, Model, as_model
from livebode_matrix import example_matrix_responses

LINES = Lines.parse("2:60:2", rate_hz=4000, window=2000)
TRIALS = 4000


def _plant() -> control.StateSpace:
    """Two coupled carts, from their forces to their speeds."""
    a = [[-0.4, 0.1, -300, 0], [0.1, -0.9, 300, 0], [1, -1, -0.2, 0], [0, 0, 0, -40]]
    return control.ss(a, [[1, 0.2], [0.1, 2], [0, 0], [0, 1]], [[1, 0, 0, 0.3], [0.2, 1, 0, 0]], 0)


CONTROLLERS = control.tf([8, 30], [1, 0]), control.tf([3, 40], [0.01, 1, 0])


def _matrix(value: np.ndarray, noise: np.ndarray, spread: np.ndarray) -> MatrixResponses:
    """The example's responses with these values, one row."""
    like, count = example_matrix_responses()[-1:], len(LINES)
    return replace(
        like, lines=LINES, value=value[np.newaxis], noise=np.tile(noise, (1, count, 1, 1)),
        spread=np.tile(spread, (1, count, 1, 1)), dof=np.array([np.inf]), coherence=np.ones((1, count, 2)),
        condition=np.ones((1, count)), reason=np.zeros((1, count, 2), dtype=np.int8),
        variation=np.full((1, count, 2, 2), np.nan),
    )  # fmt: skip


@pytest.mark.parametrize(("output", "input"), [(0, 0), (1, 1)])
def test_it_is_the_interconnection_of_python_control(output: int, input: int) -> None:
    s = 2j * np.pi * LINES.frequency_hz
    plant = _plant()
    value = np.moveaxis(plant(s), -1, 0)
    other = 1 - output
    parts: list[list[Model | None]] = [[as_model(CONTROLLERS[0]), None], [None, as_model(CONTROLLERS[1])]]
    only, one = control.ss(CONTROLLERS[other]), np.eye(2)[:, [other]]
    around = control.ss(only.A, only.B @ one.T, one @ only.C, one @ only.D @ one.T)
    expected = control.feedback(plant, around)(s)[output, input]
    like = example_matrix_responses()
    found = equivalent_plant(
        _matrix(value, np.zeros((2, 2)), np.zeros((2, 2))), MatrixLoop(feedback=parts), like.outputs[output],
        like.inputs[input],
    )  # fmt: skip
    np.testing.assert_allclose(found.value[0], expected, rtol=1e-9)
    assert np.max(np.abs(value[:, output, input] / expected - 1)) > 0.5  # the other loop matters


def test_its_sigma_is_the_scatter_of_noisy_matrices() -> None:
    """Within 5 % of the sample deviation of 4000 draws, whose own error is 0.8 %; noise of 1 % of the matrix."""
    rng = np.random.default_rng(3)
    value = np.moveaxis(_plant()(2j * np.pi * LINES.frequency_hz), -1, 0)
    size = 0.01 * np.abs(value).min()
    left, right = (
        rng.standard_normal((2, 2)) + 1j * rng.standard_normal((2, 2)) for _ in range(2)
    )  # of noise = left·left*, spread = right·right*
    left *= size
    noise, spread = left @ left.conj().T, right @ right.conj().T
    loop = MatrixLoop(feedback=[[as_model(CONTROLLERS[0]), None], [None, as_model(CONTROLLERS[1])]])
    like = example_matrix_responses()
    names = like.outputs[0], like.inputs[0]
    sigma = equivalent_plant(_matrix(value, noise, spread), loop, *names).sigma[0]
    white = (rng.standard_normal((TRIALS, 2, 2)) + 1j * rng.standard_normal((TRIALS, 2, 2))) / np.sqrt(2)
    drawn = left @ white @ right.T  # E δ(o,i)·conj(δ(p,j)) = noise(o,p)·spread(i,j)
    one = _matrix(value, noise, spread)
    many = replace(
        one, **{name: np.repeat(getattr(one, name), TRIALS, axis=0) for name in
                ("value", "noise", "spread", "coherence", "condition", "reason", "first", "sample", "time_s", "dof",
                 "variation")}
    )  # fmt: skip
    many = replace(many, value=many.value + drawn[:, np.newaxis])
    scatter = equivalent_plant(many, loop, *names).value.std(axis=0)
    np.testing.assert_allclose(scatter, sigma, rtol=0.05)


def test_it_is_the_entry_where_no_other_controller_is_active_and_invalid_with_any_column() -> None:
    value = np.moveaxis(_plant()(2j * np.pi * LINES.frequency_hz), -1, 0)
    one = _matrix(value, np.eye(2), np.eye(2))
    one.reason[0, 3, 1] = 3
    alone = MatrixLoop(feedback=[[as_model(CONTROLLERS[0]), None], [None, None]])
    found = equivalent_plant(one, alone, one.outputs[0], one.inputs[0])
    assert not found.valid[0, 3]
    np.testing.assert_allclose(found.value[0, :3], value[:3, 0, 0], rtol=1e-12)
    np.testing.assert_allclose(found.sigma[0, :3], one.sigma[0, :3, 0, 0], rtol=1e-12)


def test_a_change_of_all_entries_together_is_within_its_bound() -> None:
    """To first order; each entry turns by any angle."""
    rng = np.random.default_rng(1)
    value = np.moveaxis(_plant()(2j * np.pi * LINES.frequency_hz), -1, 0)
    one = _matrix(value, 1e-30 * np.eye(2), np.eye(2))
    one = replace(one, variation=1e-5 * np.abs(one.value) * rng.uniform(size=one.value.shape))
    loop = MatrixLoop(feedback=[[as_model(CONTROLLERS[0]), None], [None, as_model(CONTROLLERS[1])]])
    found = equivalent_plant(one, loop, *(names[0] for names in (one.outputs, one.inputs)))
    np.testing.assert_allclose(found.variation, found.sigma, rtol=1e-9)
    for _ in range(100):
        moved = replace(one, value=one.value + one.variation * np.exp(2j * np.pi * rng.uniform(size=one.value.shape)))
        change = np.abs(equivalent_plant(moved, loop, one.outputs[0], one.inputs[0]).value - found.value)
        assert np.all(change <= found.variation * 1.01)
