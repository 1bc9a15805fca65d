"""The controllers as a series over the logarithm of the frequency, for the kernel."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.kernel import FeedbackSeries

_DEGREE = 15
_PIECES, _PIECES_MAX = 128, 4096
_ERROR_MAX = 1e-12  # of the largest |F| in a piece
_ROUNDING = 2e-15  # of z − 1, by which sampled integrators are inexact, times the rate over the frequency


def series_of(response: Callable[[Floats], Complex], low_hz: float, high_hz: float) -> FeedbackSeries | None:
    """Chebyshev series of degree 15 in pieces, as many as it takes to be exact to 1e-12 (at low
    frequencies to the rounding of `response`); None if 4096 are too few.

    Examples
    --------
    >>> series_of(lambda f: np.exp(-2j * np.pi * f / 500), 0.01, 2000.0).coefficients.shape
    (128, 16)
    >>> series_of(lambda f: np.where(f < 100, 1.0, 2.0 + 0j), 0.01, 2000.0) is None
    True
    """
    begin, end = np.log([low_hz, high_hz])
    order = np.arange(_DEGREE + 1)
    angle = np.pi * (order + 0.5) / (_DEGREE + 1)
    to_series = 2 / (_DEGREE + 1) * np.cos(order[:, np.newaxis] * angle)
    to_series[0] /= 2
    tested = np.array([-1.0, -0.95, -0.31, 0.05, 0.52, 0.97, 1.0])
    polynomials = np.cos(order[:, np.newaxis] * np.arccos(tested))
    pieces = _PIECES
    while pieces <= _PIECES_MAX:
        width = (end - begin) / pieces
        middle = begin + width * (np.arange(pieces) + 0.5)[:, np.newaxis]
        sampled, expected = (
            response(np.exp(middle + width / 2 * x).ravel()).reshape(pieces, -1) for x in (np.cos(angle), tested)
        )
        coefficients = np.asarray(sampled @ to_series.T, dtype=np.complex128)
        error = np.abs(coefficients @ polynomials - expected).max(axis=1)
        permitted = _ERROR_MAX + _ROUNDING * high_hz / np.exp(middle[:, 0])
        if (error <= permitted * np.abs(expected).max(axis=1)).all():
            return FeedbackSeries(float(begin), float(width), np.ascontiguousarray(coefficients))
        pieces *= 2
    return None
