"""One matrix from many: the mean of rows that share no window."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.core import FitError, MatrixResponses


def mean_matrix(responses: MatrixResponses) -> MatrixResponses:
    """The mean of the rows that share no window, from the newest backwards, as one row; it needs at least one row.

    A row that contains all repetitions is retained as it is. `noise` is the mean of that of the rows used. Its degrees
    of freedom are those of one row, or those between the rows if these are more. A column is valid where it is in all
    rows used.

    Raises
    ------
    FitError
        If there is no row with a valid column and a known noise.

    Examples
    --------
    >>> from livebode.mimo import example_matrix_responses
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
    rows = apart(responses, np.flatnonzero(known))
    return _mean(responses[rows])


def apart(responses: MatrixResponses, rows: NDArray[np.intp]) -> NDArray[np.intp]:
    """Those of these rows that share no window, from the newest backwards; ascending."""
    chosen: list[int] = []
    for row in rows[::-1]:
        if not chosen or responses.sample[row] < responses.first[chosen[-1]]:
            chosen.append(int(row))
    return np.array(chosen[::-1], dtype=np.intp)


def _mean(of: MatrixResponses) -> MatrixResponses:
    number = len(of)
    reason = of.reason.max(axis=0, keepdims=True)
    between = (number - 1.0) * len(of.inputs)
    with np.errstate(invalid="ignore"):
        return MatrixResponses(
            of.lines,
            of.outputs,
            of.inputs,
            np.mean(of.value, axis=0, keepdims=True),
            np.mean(of.noise, axis=0, keepdims=True),
            np.mean(of.spread, axis=0, keepdims=True) / number,
            np.array([max(float(of.dof.min()), between)]),
            np.mean(of.coherence, axis=0, keepdims=True),
            np.max(of.condition, axis=0, keepdims=True),
            reason,
            of.first[:1],
            of.sample[-1:],
            np.array([float(np.mean(of.time_s))]),
        )
