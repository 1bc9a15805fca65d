"""Residuals of matrices in units of their noise: the covariance of the entries at each line, and of all lines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import FitError, MatrixResponses
from livebode.dataclass import dataclass
from livebode.fitting import mean_matrix

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


_ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class WeightedMatrix:
    """The lines of a mean matrix where all columns are valid, and the covariance of its entries.

    Attributes
    ----------
    mean
        The mean matrix with all its lines.
    value
        Entries, those of an output after each other, shape (lines, entries).
    noise, spread
        Factors of their covariance, shapes (lines, outputs, outputs) and (lines, inputs, inputs).
    dof
        Complex degrees of freedom of the noise.
    scattered
        Whitened errors of all lines together (`row_scatter`), shape (errors, lines, entries).
    """

    mean: MatrixResponses
    frequency_hz: Floats
    value: Complex
    noise: Complex
    spread: Complex
    dof: float
    scattered: Complex

    @classmethod
    def of(cls, responses: MatrixResponses, band_hz: tuple[float, float] | None) -> WeightedMatrix:
        """From the mean of the rows that share no window, at the lines of a band where all columns are valid."""
        matrix = mean_matrix(responses)
        low, high = band_hz or (0.0, np.inf)
        use = (matrix.frequency_hz >= low) & (matrix.frequency_hz <= high)
        outputs, dof = len(matrix.outputs), float(matrix.dof[0])
        if dof <= outputs + 1:
            raise FitError(
                "too-few-lines",
                f"the noise has {dof:.3g} degrees of freedom, but the covariance of {outputs} outputs needs more than "
                f"{outputs + 1}",
                "repeat the experiments more often",
                dof=dof,
                outputs=outputs,
            )
        whole = use & matrix.valid[0].all(axis=1)
        if not whole.any():
            raise FitError("too-few-lines", "no line has all its columns valid", "see why() for the reasons", lines=0)
        whitening = cls(
            matrix,
            matrix.frequency_hz[whole],
            matrix.value[0, whole].reshape(np.count_nonzero(whole), -1),
            matrix.noise[0, whole],
            matrix.spread[0, whole],
            dof,
            np.empty((0, 0, 0), dtype=np.complex128),
        )
        return replace(whitening, scattered=row_scatter(responses, whole, whitening.part(0.0)[0]))

    @property
    def outputs(self) -> int:
        """Dimension of the noise."""
        return int(self.noise.shape[1])

    @property
    def covariance(self) -> Complex:
        """Estimate of noise ⊗ spread, shape (lines, entries, entries)."""
        entries = self.value.shape[1]
        return np.asarray(np.einsum("kop,kij->koipj", self.noise, self.spread).reshape(-1, entries, entries))

    @property
    def count(self) -> int:
        """Number of real values."""
        return 2 * self.value.size

    @property
    def inflation(self) -> float:
        """E[estimate⁻¹] = this·covariance⁻¹, for a complex Wishart estimate: d/(d − p)."""
        return self.dof / (self.dof - self.outputs)

    @property
    def scatter(self) -> float:
        """Covariance of a least squares fit with estimated weights over that with the true ones.

        With W = N⁻¹ estimated from d degrees of freedom, E[W·N·W]/E[W]² = d·(d − p)/((d − p)² − 1) in units of N, by
        the second moment of an inverse complex Wishart matrix (Maiwald and Kraus, IEE Proc. Radar Sonar Navig. 147(4),
        2000).
        """
        left = self.dof - self.outputs
        return self.dof * left / (left**2 - 1)

    def part(self, epsilon: float) -> tuple[Complex, float]:
        """Inverse of the Cholesky factor of covariance·inflation + (ε|G|)², (lines, entries, entries); and the share of
        noise in it.
        """
        noise = self.covariance * self.inflation
        total = noise + epsilon**2 * np.abs(self.value[:, :, np.newaxis]) ** 2 * np.eye(self.value.shape[1])
        size = np.sqrt(np.einsum("kee->ke", total).real)
        unit = total / (size[:, :, np.newaxis] * size[:, np.newaxis, :])
        inverse = np.linalg.inv(np.linalg.cholesky(unit + _ROUNDING * np.eye(size.shape[1]))) / size[:, np.newaxis, :]
        share = np.einsum("kij,kjl,kil->", inverse, noise, inverse.conj()).real / size.size
        return inverse, float(share)


def stacked(values: Complex) -> Floats:
    """√2 times real parts above imaginary ones along the first axis: their variance is 1 where that of values is."""
    return np.asarray(np.sqrt(2) * np.concatenate([values.real, values.imag]))
