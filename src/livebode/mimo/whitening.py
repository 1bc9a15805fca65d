"""Residuals of matrices in units of their noise: the full covariance of the entries at each line."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from livebode.core import FitError, MatrixResponses

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

_ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class Weighted:
    """The lines of one matrix where all columns are valid, and the covariance of its entries.

    Attributes
    ----------
    value
        Entries, those of an output after each other, shape (lines, entries).
    covariance
        Estimate of noise ⊗ spread, shape (lines, entries, entries).
    dof, outputs
        Complex degrees of freedom of the noise, and its dimension.
    """

    frequency_hz: Floats
    value: Complex
    covariance: Complex
    dof: float
    outputs: int

    @classmethod
    def of(cls, matrix: MatrixResponses, use: NDArray[np.bool_]) -> Weighted:
        """From a matrix of one row, at the lines of `use` where all columns are valid."""
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
        covariance = matrix.covariance[0, whole]
        entries = covariance.shape[1] * covariance.shape[2]
        return cls(
            matrix.frequency_hz[whole],
            matrix.value[0, whole].reshape(-1, entries),
            covariance.reshape(-1, entries, entries),
            dof,
            outputs,
        )

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

    def at(self, lines: NDArray[np.bool_]) -> Weighted:
        """Some of its lines."""
        return replace(
            self, frequency_hz=self.frequency_hz[lines], value=self.value[lines], covariance=self.covariance[lines]
        )


def stacked(values: Complex) -> Floats:
    """√2 times real parts above imaginary ones along the first axis: their variance is 1 where that of values is."""
    return np.asarray(np.sqrt(2) * np.concatenate([values.real, values.imag]))
