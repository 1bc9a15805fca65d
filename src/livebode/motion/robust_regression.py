"""Least squares with a covariance that correlated residuals do not make too small."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from livebode.core import SignalError

Floats = NDArray[np.float64]

_CONDITION = 1e-10  # of the scaled normal matrix
_COSINES = 0.4  # times samples^(2/3): cosines of the long-run covariance
_COSINES_MIN = 4


@dataclass(frozen=True, eq=False)
class Regression:
    """Result of `regress`: values (parameters,), covariance, degrees of freedom, sum of squares, residual's sigma."""

    value: Floats
    covariance: Floats
    dof: int
    squares: float
    residual: float

    @property
    def sigma(self) -> Floats:
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    def displaced(self, at: int, value: float) -> Regression:
        """With the value of a parameter in which the model is not linear, of which a step was fitted."""
        values = self.value.copy()
        values[at] = value
        return replace(self, value=values)


def regress(columns: Floats, target: Floats, used: NDArray[np.bool_]) -> Regression:
    """Ordinary least squares of the used samples, in the order of time.

    The covariance is that of Lazarus, Lewis, Stock and Watson (J. Business & Economic Statistics 36(4), 2018): the
    long-run covariance of the gradient is the mean over the first B = 0.4·n^(2/3) cosines, and the error of a value
    over its sigma has Student's t distribution. Its degrees of freedom are B less the parameters, whose values fit the
    slowest part of the noise too. Samples between that are not used count as zeros, so that the lags remain true.

    Parameters
    ----------
    columns, target, used
        Shapes (samples, parameters), (samples,) and (samples,).

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
    inverse = np.linalg.inv(normal)
    value = inverse @ ((x / scale).T @ y)
    rest = y - (x / scale) @ value
    gradient = np.zeros(columns.shape)
    gradient[used] = x / scale * rest[:, np.newaxis]
    n, many = y.size, columns.shape[1]
    cosines = max(round(_COSINES * n ** (2 / 3)), _COSINES_MIN + many)
    dof = cosines - many
    t = (np.arange(len(columns)) + 0.5) / len(columns)
    sums = np.cos(np.pi * np.arange(1, cosines + 1)[:, np.newaxis] * t) @ gradient
    meat = 2 / dof * sums.T @ sums
    covariance = inverse @ meat @ inverse / np.outer(scale, scale)
    squares = float(rest @ rest)
    return Regression(value / scale, covariance, dof, squares, float(np.sqrt(squares / max(n - many, 1))))
