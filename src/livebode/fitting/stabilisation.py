"""Stabilisation chart: poles of subspace models of increasing order, and those that stay from order to order."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.dataclass import dataclass
from livebode.fitting.physical import EvaluationGrid
from livebode.fitting.problem import MeasuredRows
from livebode.fitting.weights import weights

_ROWS_MAX, _ROWS_OF_ALL = 160, 480  # of powers of z, and times the number of outputs
_ORDER_MAX, _STEP = 80, 2  # poles of a model
_FLOOR = 1e-3  # of the largest variance of the noise, below which it is not whitened
_STAYS = 0.3  # of a half-width, by which a stable pole may differ from order to order
_APART = 0.05  # of the spacing of lines, to which no half-width is seen


@dataclass(frozen=True, eq=False)
class Chart:
    """Poles of models of increasing order, in rad/s with a positive imaginary part, and whether each is stable.

    Attributes
    ----------
    orders
        Number of poles of each model, conjugate ones included.
    poles, stable
        Of each model, (poles,). A pole is stable if it is damped and the models of the next lower and the next higher
        order have it too, within 0.3 of its half-width.
    """

    orders: tuple[int, ...]
    poles: tuple[Complex, ...]
    stable: tuple[NDArray[np.bool_], ...]


def stabilisation_chart(measured: MeasuredRows, grid: EvaluationGrid) -> Chart:
    """Poles of subspace models of the responses, without start values.

    The lines are mapped to an arc of the unit circle, on which a system in s, or sampled behind a hold, remains one of
    the same order with real coefficients (bilinear map). Powers z^i·G(z) without the part that powers of z alone
    explain have the range of the observability matrix (McKelvey, Akçay and Ljung, IEEE Trans. Autom. Control 41(7),
    1996, algorithm 2), lines weighted by their sigma, rows by the covariance of the noise. One
    singular value decomposition serves all orders.

    Bias: that of least squares where the noise has another covariance than its sigma; the poles are starts of a fit.
    """
    use = measured.use.all(axis=0)
    lines, count = int(np.count_nonzero(use)), len(measured.value)
    rows = min(2 * lines // 3, _ROWS_MAX, _ROWS_OF_ALL // count)
    highest = min(_ORDER_MAX, (rows - 2) * count)
    if rows < 4:
        return Chart((), (), ())
    arc = _Arc(grid)
    z, value = arc.z[use], measured.value[:, use]
    each = weights(measured.sigma[:, use], np.abs(value), np.zeros(count))
    each = np.where(each > 0, each, 1 / np.maximum(np.abs(value), 1e-300))
    each = each / np.sqrt(np.mean(np.abs(each * value) ** 2, axis=1, keepdims=True))
    common = 1 / np.sqrt(np.mean(1 / each**2, axis=0))
    scale = np.sqrt(np.mean(np.abs(value * common) ** 2, axis=1, keepdims=True))
    powers: Complex = np.asarray(z ** np.arange(rows)[:, np.newaxis], dtype=np.complex128)
    weighted = powers * common
    whole = _real((weighted[:, np.newaxis] * (value / scale)).reshape(rows * count, lines))
    basis, _ = np.linalg.qr(_real(weighted).T)
    rest = whole - (whole @ basis) @ basis.T
    root, inverse = (np.kron(part, np.eye(count)) for part in _roots(_real(powers)))
    directions = root @ np.linalg.svd(inverse @ rest, full_matrices=False)[0]
    orders = tuple(range(_STEP, highest + 1, _STEP))
    poles = [arc.poles(_shifted(directions[:, :order], count)) for order in orders]
    seen = [of[of.imag > 0] for of in poles]
    least = _APART * 2 * np.pi * float(np.min(np.diff(grid.frequency_hz), initial=np.inf))
    stable = [
        (of.real < 0) & _near(of, before, least) & _near(of, after, least)
        for of, before, after in zip(seen, [seen[0], *seen[:-1]], [*seen[1:], seen[-1]])
    ]
    return Chart(orders, tuple(seen), tuple(stable))


class _Arc:
    """s to z = (β + x)/(β − x), with x = s or its image behind a hold, and β so that the lines fill the circle best."""

    def __init__(self, grid: EvaluationGrid) -> None:
        self._hold, self._rate_hz = grid.hold, grid.rate_hz
        omega = 2 * np.pi * grid.frequency_hz
        if self._hold != "none":
            omega = 2 * self._rate_hz * np.tan(omega / 2 / self._rate_hz)
        self._middle = float(np.median(omega))
        self.z = (self._middle + 1j * omega) / (self._middle - 1j * omega)

    def poles(self, z: Complex) -> Complex:
        """In s."""
        x = self._middle * (z - 1) / (z + 1)
        if self._hold == "none":
            return np.asarray(x)
        double = 2 * self._rate_hz
        return np.asarray(self._rate_hz * np.log((double + x) / (double - x)))


def _roots(powers: Floats) -> tuple[Floats, Floats]:
    """Square root, and its inverse, of the covariance that white noise at the lines gives the rows."""
    size, axes = np.linalg.eigh(powers @ powers.T)
    root = np.sqrt(np.maximum(size, _FLOOR * size[-1]))
    return (axes * root) @ axes.T, (axes / root) @ axes.T


def _shifted(directions: Floats, outputs: int) -> Complex:
    """Eigenvalues of the matrix that shifts an observability matrix by one block of rows."""
    matrix = np.linalg.lstsq(directions[:-outputs], directions[outputs:], rcond=None)[0]
    return np.asarray(np.linalg.eigvals(matrix), dtype=np.complex128)


def _near(poles: Complex, others: Complex, least: float) -> NDArray[np.bool_]:
    apart = np.abs(poles[:, np.newaxis] - others).min(axis=1, initial=np.inf)
    return np.asarray(apart < np.maximum(_STAYS * np.abs(poles.real), least))


def _real(values: Complex) -> Floats:
    return np.concatenate([values.real, values.imag], axis=1)
