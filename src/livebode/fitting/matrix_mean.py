"""The mean of many matrices, with its bounds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.core import FitError, MatrixResponses
from livebode.fitting.matrix_drift import MatrixDriftTest, Repetitions, matrix_with_drift


def mean_matrix(responses: MatrixResponses) -> MatrixResponses:
    """The mean of the rows that share no window, from the newest backwards, as one row; it needs at least one row.

    A row that contains all repetitions is retained as it is. Rows of fewer repetitions, as early in a run, have less
    weight: that of value and time is the reciprocal of the row's `spread`, that of `noise` the row's degrees of
    freedom. The noise of rows may be from the same windows, so its degrees of freedom are their mean with these
    weights, or those between the rows if these are more. A column is valid where it is in all rows used.

    A machine that changes is averaged. If its change is significant (`MatrixDriftTest`, on all rows), sigma covers the
    response at a random moment of the record, as that of `mean_response` does, with `variation` as the part of the
    change, and `noise` is the scatter about the course of the response.

    Raises
    ------
    FitError
        If there is no row with a valid column and a known noise.

    Examples
    --------
    >>> from livebode_matrix import example_matrix_responses
    >>> mean_matrix(example_matrix_responses())
    <MatrixResponses: 1 rows, 7 lines, 2 outputs × 2 inputs>
    """
    known = responses.valid.any(axis=(1, 2)) & (responses.dof > 0)
    if not known.any():
        raise FitError(
            "too-few-lines",
            "no matrix has a valid column and a known noise",
            "repeat the experiments: bounds need two repetitions with average, three without it",
            lines=0,
        )
    rows = _without_overlap(responses, np.flatnonzero(known))
    shape = responses.value.shape[1:]
    test = MatrixDriftTest((shape[0], shape[1], shape[2]), responses.lines.rate_hz, Repetitions.of(responses))
    test.add(responses)
    return matrix_with_drift(_weighted(responses[rows]), test.result(whole=True))


def _without_overlap(responses: MatrixResponses, rows: NDArray[np.intp]) -> NDArray[np.intp]:
    """Numbers of the rows that share no window, chosen from the newest backwards; ascending."""
    chosen: list[int] = []
    for row in rows[::-1]:
        if not chosen or responses.sample[row] < responses.first[chosen[-1]]:
            chosen.append(int(row))
    return np.array(chosen[::-1], dtype=np.intp)


def _weighted(of: MatrixResponses) -> MatrixResponses:
    between = (len(of) - 1.0) * len(of.inputs)
    with np.errstate(invalid="ignore"):
        weight = 1.0 / np.einsum("rkii->rk", of.spread).real
        weight = (weight / weight.sum(axis=0))[:, :, np.newaxis, np.newaxis]
        return MatrixResponses(
            of.lines,
            of.outputs,
            of.inputs,
            np.sum(weight * of.value, axis=0, keepdims=True),
            np.average(of.noise, axis=0, weights=of.dof)[np.newaxis],
            np.sum(weight**2 * of.spread, axis=0, keepdims=True),
            np.array([max(float(np.average(of.dof, weights=of.dof)), between)]),
            np.mean(of.coherence, axis=0, keepdims=True),
            np.max(of.condition, axis=0, keepdims=True),
            of.reason.max(axis=0, keepdims=True),
            of.first[:1],
            of.sample[-1:],
            np.array([float(np.average(of.time_s, weights=np.nanmean(weight, axis=(1, 2, 3))))]),
            of.units,
        )
