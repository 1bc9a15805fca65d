"""Errors of all lines together, from the scatter of the matrices of a recording."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex
from livebode.core import MatrixResponses

ROWS_LEAST = 6
_ROWS_MAX = 64
_VALUES_EACH = 10  # values of a matrix for each row, at least: of fewer, vectors at right angles hide what is alike
_RANK = 1e-3


def row_scatter(responses: MatrixResponses, use: NDArray[np.bool_], inverse: Complex) -> Complex:
    """Independent errors of unit power as the noise gives them, all lines together, shape (errors, lines, entries).

    A window begins and ends with different states. What this adds to a spectrum (leakage) is a smooth function of
    frequency, so that the errors of neighbouring lines beside a mode are alike. A covariance of each line does not show
    that, but the matrices of a recording do: they are mixtures of the same independent windows. Their singular vectors
    are such mixtures too, with equal power.

    Parameters
    ----------
    responses
        Rows of one recording; they may share windows. Those are used whose windows begin at the same place of a period
        as the last one's, because leakage depends on that place, at most the newest 64.
    use
        The lines, shape (lines,).
    inverse
        By which errors of the entries become uncorrelated, shape (lines used, entries, entries).

    Returns
    -------
    Complex
        One less than rows; none if there are fewer than six.
    """
    none = np.empty((0, *inverse.shape[:2]), dtype=np.complex128)
    whole = responses.valid[:, use].all(axis=(1, 2))
    aligned = (responses.sample - responses.sample[-1]) % responses.lines.window == 0
    rows = np.flatnonzero(whole & aligned)[-min(_ROWS_MAX, inverse[:, 0].size // _VALUES_EACH) :]
    if rows.size < ROWS_LEAST:
        return none
    value = responses.value[rows][:, use].reshape(rows.size, *inverse.shape[:2])
    apart = np.einsum("kij,rkj->rki", inverse, value - value.mean(axis=0)).reshape(rows.size, -1)
    _, size, vectors = np.linalg.svd(apart, full_matrices=False)
    kept = vectors[size > _RANK * size[0]]
    if len(kept) < ROWS_LEAST - 1:
        return none
    return np.asarray((np.sqrt(apart.shape[1]) * kept).reshape(-1, *inverse.shape[:2]))
