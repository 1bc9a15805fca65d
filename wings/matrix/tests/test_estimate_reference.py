"""The matrices of the kernel are those of singular values and least squares in NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from livebode.kernel import MatrixHistory, MatrixRows, MatrixStage, MatrixWindows, process_matrices
from livebode_matrix.estimate import MatrixEstimate, Windows, estimate


def by_kernel(stage: MatrixStage, spectrum: np.ndarray) -> MatrixRows:
    rows = spectrum.shape[1]
    windows = MatrixWindows(0, spectrum, np.arange(rows), np.ones(rows, np.bool_))
    found = MatrixRows.empty(stage, rows)
    process_matrices(stage, MatrixHistory.empty(stage, rows), windows, found)
    return found


def by_numpy(stage: MatrixStage, spectrum: np.ndarray, count: int) -> MatrixEstimate:
    """Of the newest of `repetitions` repetitions of the experiments, rows of one place."""
    s = stage
    newest = spectrum[:, ::-1].reshape(-1, s.repetitions, s.experiments, s.lines)
    parts = np.split(newest.transpose(3, 1, 0, 2)[np.newaxis], (s.outputs,), axis=3)
    reference = None if s.means else parts[1]
    return estimate(Windows(*parts, reference, np.array([count])), s.average, s.condition_max)


@pytest.mark.parametrize("average", [False, True])
@pytest.mark.parametrize("means", [False, True])
@pytest.mark.parametrize(("outputs", "inputs", "experiments"), [(1, 1, 1), (2, 2, 2), (3, 2, 2), (8, 8, 8), (2, 2, 5)])
def test_a_matrix_is_that_of_numpy(outputs: int, inputs: int, experiments: int, means: bool, average: bool) -> None:
    stage = MatrixStage(outputs, inputs, 9, 0, experiments, 5, 1, average, means, 1e9, 0)
    rng = np.random.default_rng(inputs)
    once = rng.standard_normal((outputs + inputs, experiments, 9, 2)) @ [1, 1j]
    spectrum = np.tile(once, (1, 5, 1))
    spectrum += 1e-3 * rng.standard_normal((*spectrum.shape, 2)) @ [1, 1j]
    found = by_kernel(stage, spectrum)
    expected = by_numpy(stage, spectrum, 5)
    sure = found.sure[-1]
    assert sure.sum() > 5
    assert (expected.reason[0, sure] == 0).all()
    for name in ("value", "noise", "spread", "coherence"):
        one, other = getattr(found, name)[-1, sure], getattr(expected, name)[0, sure]
        assert np.abs(one - other).max() < 1e-9 * np.abs(other).max(), name
    assert found.dof[-1] == expected.dof[0]
    # Exact for up to two inputs; for more it is the largest that the norms permit.
    ratio = found.condition[-1, sure] / expected.condition[0, sure]
    assert (ratio > 1 - 1e-6).all()
    assert (ratio < (1 + 1e-6 if inputs <= 2 else inputs / 2)).all()


def test_inputs_that_barely_separate_are_decided_by_singular_values() -> None:
    """One input nearly the sum of the others: beyond the limit, and where noise could cause it, it is never sure."""
    rng = np.random.default_rng(3)
    stage = MatrixStage(1, 3, 1, 0, 3, 4, 1, False, False, 1e3, 0)
    for apart in np.geomspace(1e-6, 1, 40):
        once = rng.standard_normal((4, 3, 1, 2)) @ [1, 1j]
        once[3] = once[1] + once[2] + apart * once[3]
        spectrum = np.tile(once, (1, 4, 1))
        spectrum += 1e-3 * rng.standard_normal((*spectrum.shape, 2)) @ [1, 1j]
        found = by_kernel(stage, spectrum)
        exact = by_numpy(stage, spectrum, 4)
        assert not found.sure[-1, 0] or (exact.reason == 0).all()
        assert exact.condition[0, 0] < 1.001 * found.condition[-1, 0]
