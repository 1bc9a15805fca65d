"""Drive models fitted to rows of responses, in C; `tests/twins/fit.py` defines it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from livebode.arrays import Complex, Flags, Floats, Integers
from livebode.kernel import _native

RIGID, TWO_MASS, TWO_MASS_GAIN = range(3)


class FitModel(NamedTuple):
    """A model behind a zero-order hold, whose frictions are fixed.

    Attributes
    ----------
    kind
        RIGID, TWO_MASS or TWO_MASS_GAIN.
    integrators
        1 for a velocity, 2 for a position.
    at_load
        Whether the output is that of the last mass.
    lever
        Of the output, m/rad or 1.
    arm
        r² from load to shaft, or 1.
    ratio
        Load's inertia over the motor's; 0 if not known, so that the load is a parameter.
    table
        Start, low, high, scale and fixed value (NaN: free) of each parameter, shape (5, parameters).
    """

    kind: int
    integrators: int
    at_load: bool
    lever: float
    arm: float
    ratio: float
    table: Floats


class FitRows(NamedTuple):
    """Measured rows.

    Attributes
    ----------
    value, sigma, use
        Shape (rows, lines); E|e|² = sigma², NaN where it is not known; lines that are used.
    noise_dof
        Degrees of freedom of the sigmas, shape (rows,).
    start
        Where the search begins, shape (rows, parameters); None: at a scan.
    epsilon
        Error of the model as a share of |G|, shape (rows,); None: that of each row's own residuals.
    """

    value: Complex
    sigma: Floats
    use: Flags
    noise_dof: Floats
    start: Floats | None
    epsilon: Floats | None


class FitFound(NamedTuple):
    """Results; values, covariance and epsilon are NaN where the status is not 0.

    Attributes
    ----------
    values, covariance
        Shape (rows, parameters) and (rows, parameters, parameters).
    status
        Shape (rows,): 0 fitted; 1 too few lines; 2 no minimum; 3 a parameter at its bound; 4 one uncertain by more
        than half; 5 an error of the model above half of |G|; 6 one above 3 %, of which a viscous friction explains more
        than half.
    epsilon, chi2, dof
        Shape (rows,); chi2 by sigma alone.
    response
        Of the model, shape (rows, lines), also where the fit failed.
    ended
        Where the search ended, shape (rows, parameters).
    """

    values: Floats
    covariance: Floats
    status: Integers
    epsilon: Floats
    chi2: Floats
    dof: Floats
    response: Complex
    ended: Floats

    @classmethod
    def empty(cls, rows: int, lines: int, parameters: int) -> FitFound:
        return cls(
            np.empty((rows, parameters)),
            np.empty((rows, parameters, parameters)),
            np.empty(rows, np.int64),
            np.empty(rows),
            np.empty(rows),
            np.empty(rows),
            np.empty((rows, lines), np.complex128),
            np.empty((rows, parameters)),
        )


def fit(model: FitModel, frequency_hz: Floats, rate_hz: float, rows: FitRows) -> FitFound:
    """Weighted least squares of each row by itself (docs/explanation/fits.md); frequencies of shape (lines,)."""
    count, lines = rows.value.shape
    fits = FitFound.empty(count, lines, model.table.shape[1])
    arrays = tuple(None if x is None else np.ascontiguousarray(x) for x in rows)
    _native.fit(model, frequency_hz, rate_hz, arrays, fits)
    return fits


def fit_epsilon(residual: Floats, noise: Floats, size: Floats, dof: Floats) -> Floats:
    """ε ≥ 0 with Σ 2·residual/(noise + ε²·size) = dof, (rows,); all are squares, (rows, lines), zero where not used.

    Zero where noise alone explains the residuals: Σ 2·residual/noise ≤ dof.
    """
    epsilon = np.empty(len(residual))
    _native.fit_epsilon(residual, noise, size, dof, epsilon)
    return epsilon


def fit_response(model: FitModel, rate_hz: float, values: Floats, frequency_hz: Floats) -> Complex:
    """Response (rows, lines) for values (rows, parameters) at frequencies (lines,) or (rows, lines)."""
    response = np.empty((len(values), frequency_hz.shape[-1]), np.complex128)
    _native.fit_response(model, rate_hz, values, frequency_hz, frequency_hz.ndim == 1, response)
    return response


class FeedbackSeries(NamedTuple):
    """F over ln f: pieces of equal `width` from `begin` on, each a series of Chebyshev polynomials, (pieces, 16)."""

    begin: float
    width: float
    coefficients: Complex


class MarginGrid(NamedTuple):
    """Frequencies at which a loop is searched, ascending to half the rate, and F there, shape (points,)."""

    frequency_hz: Floats
    feedback: Complex
    rate_hz: float


class MarginRows(NamedTuple):
    """Margins in the order of `analysis.MARGIN_NAMES`, shape (rows, 6), and stable rows (rows,); else NaN."""

    value: Floats
    sigma: Floats
    frequency_hz: Floats
    frequency_sigma_hz: Floats
    stable: Flags


def fit_margins(
    model: FitModel, feedback: FeedbackSeries, grid: MarginGrid, values: Floats, covariance: Floats
) -> MarginRows:
    """Margins of L = F·G for values (rows, parameters) and their covariance (rows, parameters, parameters)."""
    value, sigma, at_hz, at_sigma_hz = (np.empty((len(values), 6)) for _ in range(4))
    margins = MarginRows(value, sigma, at_hz, at_sigma_hz, np.empty(len(values), np.bool_))
    _native.fit_margins(model, feedback, grid, np.ascontiguousarray(values), np.ascontiguousarray(covariance), margins)
    return margins
