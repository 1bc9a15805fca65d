"""Bounds of singular values compared with the truth, and singular values and responses with python-control."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest

from livebode.core import Lines, MatrixResponses
from livebode_matrix import example_matrix_responses

RUNS, SIGMA = 4000, 0.05
C95 = np.sqrt(np.log(20))


def mixed(size: int, rng: np.random.Generator) -> np.ndarray:
    """A random matrix with singular values from 0.5 to 1.5: noise that is correlated and unequal."""
    turned = np.linalg.qr(rng.normal(size=(size, size)) + 1j * rng.normal(size=(size, size)))[0]
    return np.asarray(turned @ np.diag(np.linspace(0.5, 1.5, size)))


def estimates(values: list[float], dof: int, rng: np.random.Generator) -> MatrixResponses:
    """Estimates of one matrix with these singular values, whose noise is known from `dof` windows."""
    size = len(values)
    truth = np.linalg.qr(mixed(size, rng))[0] @ np.diag(values) @ np.linalg.qr(mixed(size, rng))[0]
    a, b = mixed(size, rng), SIGMA * mixed(size, rng)

    def white(*shape: int) -> np.ndarray:
        return np.asarray((rng.normal(size=shape) + 1j * rng.normal(size=shape)) / np.sqrt(2))

    windows = a @ white(RUNS, size, dof)
    names = tuple("abc"[:size])
    return MatrixResponses(
        Lines((1,), 10, 100.0),
        names,
        names,
        value=(truth + a @ white(RUNS, size, size) @ b.T)[:, np.newaxis],
        noise=(windows @ windows.conj().swapaxes(1, 2) / dof)[:, np.newaxis],
        spread=np.tile(b @ b.conj().T, (RUNS, 1, 1, 1)),
        dof=np.full(RUNS, float(dof)),
        coherence=np.ones((RUNS, 1, size)),
        condition=np.ones((RUNS, 1)),
        reason=np.zeros((RUNS, 1, size), dtype=np.int8),
        first=np.arange(RUNS),
        sample=np.arange(RUNS),
        time_s=np.arange(RUNS) / 100,
    )


@pytest.mark.parametrize(
    ("values", "least"),
    [
        ([2.0, 1.0], (0.94, 0.94)),
        ([1.0, 1.0], (0.925, 0.925)),  # they repel each other
        ([1.0, 0.0], (0.94, 0.94)),
        ([1.0, 0.3, 0.0], (0.94, 0.94, 0.94)),
        ([1.0, 1.0, 1.0], (0.86, 0.94, 0.86)),
    ],
)
def test_the_95_percent_bound_of_singular_values_covers_the_truth(values: list[float], least: tuple[float]) -> None:
    """`pytest -s` prints the table of docs/explanation/mimo.md."""
    found = estimates(values, 12, np.random.default_rng(0))
    error = np.abs(found.singular_values[:, 0] - values)
    shares = [(error <= found.singular_value_bound(c)[:, 0]).mean(axis=0) for c in (1.0, C95)]
    print(
        f"\n| {', '.join(map(str, values))} |", *(", ".join(f"{100 * s:.1f}" for s in share) + " |" for share in shares)
    )
    assert (shares[1] >= least).all()


def test_singular_values_are_those_of_python_control_and_the_frd_has_the_shape_of_its_matrix() -> None:
    responses = example_matrix_responses()
    frd = responses.to_frd()
    assert frd.frdata.shape == (2, 2, 7)
    found = control.singular_values_response(frd, omega=frd.omega)
    assert np.allclose(np.squeeze(found.magnitude), responses.singular_values[-1].T, rtol=1e-12)
    drawn = control.frequency_response(frd, omega=frd.omega)
    assert np.allclose(drawn.magnitude[1, 0], np.abs(responses.value[-1, :, 1, 0]))


def test_an_invalid_column_leaves_no_singular_value_and_no_bound() -> None:
    responses = example_matrix_responses()
    responses.reason[-1, 2, 1] = 2
    assert np.isnan(responses.singular_values[-1, 2]).all()
    assert np.isnan(responses.singular_value_bound()[-1, 2]).all()
    assert np.isfinite(responses.singular_value_bound()[-1, 3]).all()
    assert responses.to_frd().frdata.shape == (2, 2, 6)


def test_a_change_of_all_entries_together_is_within_the_bound() -> None:
    """To first order; each entry turns by any angle."""
    rng, responses = np.random.default_rng(2), example_matrix_responses()
    unknown = replace(responses, noise=0 * responses.noise)
    varied = replace(unknown, variation=1e-5 * np.abs(unknown.value) * rng.uniform(size=unknown.value.shape))
    bound, before = varied.singular_value_bound(1.0), varied.singular_values
    assert np.all(unknown.singular_value_bound(1.0) == 0)
    for _ in range(100):
        moved = varied.value + varied.variation * np.exp(2j * np.pi * rng.uniform(size=varied.value.shape))
        assert np.all(np.abs(replace(varied, value=moved).singular_values - before) <= 1.01 * bound)
    half = varied.transformed([[0.5, 0.5]], np.eye(2), (("y",), ("u1", "u2")))
    np.testing.assert_allclose(half.variation[:, :, 0], varied.variation.mean(axis=2), rtol=1e-12)
