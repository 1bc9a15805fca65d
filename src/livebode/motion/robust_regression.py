"""Least squares with a covariance that correlated residuals do not make too small."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import SignalError
from livebode.dataclass import dataclass

_CONDITION = 1e-10  # of the scaled normal matrix
_COSINES = 0.4  # times samples^(2/3): cosines of the long-run covariance
_COSINES_MIN, _COSINES_MAX = 8, 200  # more bring nothing, and take memory


@dataclass(frozen=True, eq=False)
class Regression:
    """Result of `regress`.

    Values, their covariance and degrees of freedom, shapes (parameters,), (parameters, parameters) and (parameters,);
    the sum of squares, and sigma of the residual.
    """

    value: Floats
    covariance: Floats
    dof: NDArray[np.int64]
    squares: float
    residual: float

    @property
    def sigma(self) -> Floats:
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    def displaced(self, index: int, value: float) -> Regression:
        """With the value of a parameter in which the model is not linear, of which a step was fitted."""
        values = self.value.copy()
        values[index] = value
        return replace(self, value=values)


def regress(columns: Floats, target: Floats, used: NDArray[np.bool_], correlation: Floats) -> Regression:
    """Ordinary least squares of the used samples, in the order of time.

    The covariance is that of Lazarus, Lewis, Stock and Watson (J. Business & Economic Statistics 36(4), 2018): the
    long-run covariance of the gradient is the mean over the first B = 0.4·n^(2/3) cosines. The fitted values take a
    part of the noise out of the residuals, most where few samples determine a value. So each variance is corrected by
    its expectation for noise of the given correlation, and its degrees of freedom are those of Satterthwaite for the
    same noise (Bell and McCaffrey, Survey Methodology 28(2), 2002). Samples between that are not used count as zeros,
    so that the lags remain true.

    Parameters
    ----------
    columns, target, used
        Shapes (samples, parameters), (samples,) and (samples,).
    correlation
        Of the noise, at lags of 0, 1, … samples; shape (lags,), zero beyond.

    Raises
    ------
    SignalError
        If the columns do not determine the parameters.
    """
    x, y = columns[used], target[used]
    scale = np.sqrt(np.sum(x**2, axis=0))
    scale[scale == 0] = 1.0
    normal = (x / scale).T @ (x / scale)
    if np.linalg.eigvalsh(normal)[0] < _CONDITION:
        raise SignalError(
            "too-short",
            "inertia, viscous and Coulomb friction cannot be separated, because the axis moves at one speed only",
            "record strokes at several speeds, or with longer accelerations",
        )
    influence = (x / scale) @ np.linalg.inv(normal) / scale  # of each sample on each value
    value = influence.T @ y
    residual = y - x @ value
    cosines = _cosines(used)
    covariance, dof = _covariance(influence, residual, used, cosines, correlation)
    squares = float(residual @ residual)
    return Regression(value, covariance, dof, squares, float(np.sqrt(squares / max(y.size - x.shape[1], 1))))


def _cosines(used: NDArray[np.bool_]) -> Floats:
    """The slowest cosines over the whole time at the used samples, shape (used samples, cosines)."""
    many = int(np.clip(round(_COSINES * np.count_nonzero(used) ** (2 / 3)), _COSINES_MIN, _COSINES_MAX))
    t = (np.flatnonzero(used) + 0.5) / used.size
    return np.asarray(np.cos(np.pi * t[:, np.newaxis] * np.arange(1, many + 1)))


def _covariance(
    influence: Floats, residual: Floats, used: NDArray[np.bool_], cosines: Floats, correlation: Floats
) -> tuple[Floats, NDArray[np.int64]]:
    """Covariance of the values, corrected for what the fit took out of the residuals, and degrees of freedom."""
    sums = cosines.T @ (influence * residual[:, np.newaxis])
    covariance = 2 / cosines.shape[1] * sums.T @ sums
    basis, _ = np.linalg.qr(influence)
    factor, dof = np.empty(influence.shape[1]), np.empty(influence.shape[1])
    for i, column in enumerate(influence.T):
        seen = cosines * column[:, np.newaxis]
        seen -= basis @ (basis.T @ seen)
        gram = seen.T @ _correlated(seen, used, correlation)
        true = column @ _correlated(column[:, np.newaxis], used, correlation)[:, 0]
        factor[i] = np.sqrt(true / (2 / cosines.shape[1] * np.trace(gram)))
        dof[i] = np.trace(gram) ** 2 / np.sum(gram**2)
    return covariance * np.outer(factor, factor), np.maximum(np.rint(dof), 1).astype(np.int64)


def _correlated(values: Floats, used: NDArray[np.bool_], correlation: Floats) -> Floats:
    """The correlation matrix of the used samples times these columns."""
    whole = np.zeros((used.size, values.shape[1]))
    whole[used] = values
    product = correlation[0] * whole
    for lag, size in enumerate(correlation[1:], 1):
        product[lag:] += size * whole[:-lag]
        product[:-lag] += size * whole[lag:]
    return np.asarray(product[used])
