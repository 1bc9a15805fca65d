"""The mean of matrices of unequal numbers of repetitions is the matrix of all repetitions."""

from __future__ import annotations

import numpy as np
import pytest

from livebode.core import Block, Lines, MatrixResponses
from livebode.excitation import MatrixExcitation
from livebode.fitting import mean_matrix
from livebode_matrix import MatrixSettings, MatrixTracker

LINES = Lines.parse("50:200:50", rate_hz=1000, window=100)
REPETITIONS = 12


@pytest.fixture(scope="module")
def block() -> Block:
    """In open loop, so that the inputs are the same in all repetitions."""
    u = np.tile(MatrixExcitation.orthogonal(LINES, 2).samples, REPETITIONS)
    rng = np.random.default_rng(3)
    y = np.array([[2.0, 1.0], [0.5, 3.0]]) @ u + 0.1 * rng.standard_normal(u.shape)
    return Block(np.vstack([u, y]), ("u1", "u2", "y1", "y2"), rate_hz=1000)


def matrices(block: Block, memory: int) -> MatrixResponses:
    settings = MatrixSettings(
        lines=LINES, output=["y1", "y2"], input=["u1", "u2"], estimator="direct", hop=100, average=True,
        memory=memory,
    )  # fmt: skip
    return MatrixTracker(settings).process(block)


@pytest.mark.parametrize("memory", [9, 6, 5])
def test_weighted_mean_is_the_matrix_of_all_repetitions(block: Block, memory: int) -> None:
    """9 + 3, 6 + 6 and 5 + 5 + 2 repetitions; the noise has nearly the degrees of freedom of a full row."""
    whole = matrices(block, REPETITIONS)[-1:]
    mean = mean_matrix(matrices(block, memory))
    assert np.allclose(mean.value, whole.value, rtol=0, atol=1e-12)
    assert np.allclose(mean.spread, whole.spread, rtol=1e-9)
    assert mean.time_s == pytest.approx(whole.time_s)
    assert 2.0 * (memory - 1) * 0.7 < mean.dof[0] <= 2.0 * (memory - 1)
