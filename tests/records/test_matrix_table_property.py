"""The rows of matrices become the same matrices, wherever the two tables are cut and whatever damage left out."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from livebode.core import Lines, MatrixResponses
from livebode.records import covariance_rows, matrix_rows
from livebode.records.matrix_table import MatrixShape, matrices
from livebode.tables import Table

ROWS = 7


def responses(outputs: int, inputs: int, lines: int, seed: int) -> MatrixResponses:
    """Random matrices; NaN and reasons at some places."""
    rng = np.random.default_rng(seed)

    def values(*shape: int) -> np.ndarray:
        found = rng.standard_normal((ROWS, *shape))
        found[rng.random(found.shape) < 0.1] = np.nan
        return found

    def covariance(size: int) -> np.ndarray:
        found = values(lines, size, size) + 1j * values(lines, size, size)
        at = np.arange(size)
        found[:, :, at, at] = np.abs(found[:, :, at, at])
        return found

    return MatrixResponses(
        Lines.of_bins(tuple(range(1, lines + 1)), 100, 1000.0),
        tuple(f"y{o}" for o in range(outputs)),
        tuple(f"u{i}" for i in range(inputs)),
        value=values(lines, outputs, inputs) + 1j * values(lines, outputs, inputs),
        noise=covariance(outputs),
        spread=covariance(inputs),
        dof=values(),
        coherence=values(lines, outputs),
        condition=values(lines),
        reason=rng.integers(0, 4, (ROWS, lines, inputs)).astype(np.int8),
        first=np.arange(ROWS) * 10,
        sample=np.arange(ROWS) * 10 + 99,
        time_s=np.arange(ROWS) / 100,
        variation=np.abs(values(lines, outputs, inputs)),
    )


def cut(table: Table, at: list[int], rows: int) -> list[Table]:
    """The table in parts of whole responses, cut before these."""
    return [table.slice(a * rows, (b - a) * rows) for a, b in pairwise([0, *sorted(at), ROWS])]


cuts = st.lists(st.integers(0, ROWS), max_size=4)
sizes = st.integers(1, 3)


@given(sizes, sizes, sizes, cuts, cuts, st.integers(0, 1000))
def test_rows_become_the_same_matrices(
    outputs: int, inputs: int, lines: int, first: list[int], second: list[int], seed: int
) -> None:
    whole = responses(outputs, inputs, lines, seed)
    shape = MatrixShape(whole.lines, whole.outputs, whole.inputs)
    rows = cut(matrix_rows(whole), first, shape.response_rows)
    covariance = cut(covariance_rows(whole), second, shape.covariance_rows)
    assert MatrixResponses.join(list(matrices(rows, covariance, shape))).equals(whole)


@given(st.sets(st.integers(0, ROWS - 1)), st.sets(st.integers(0, ROWS - 1)))
def test_rows_that_are_missing_in_one_table_do_not_move_the_others(lost: set[int], unknown: set[int]) -> None:
    whole = responses(2, 2, 2, 0)
    shape = MatrixShape(whole.lines, whole.outputs, whole.inputs)
    kept, known = ([i for i in range(ROWS) if i not in left_out] for left_out in (lost, unknown))
    rows = [matrix_rows(whole[np.array([i])]) for i in kept]
    covariance = [covariance_rows(whole[np.array([i])]) for i in known]
    parts = list(matrices(rows, covariance, shape))
    for i, part in zip(kept, parts, strict=True):
        one = whole[np.array([i])]
        assert np.array_equal(part.value, one.value, equal_nan=True)
        if i in known:
            assert part.equals(one)
        else:
            assert np.isnan(part.noise).all()
