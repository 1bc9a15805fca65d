"""Responses of signals to one reference, and the noise in them: what a window of any excitation gives at each line."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from livebode.arrays import Complex, Floats


@dataclass(frozen=True, eq=False)
class Quotient:
    """Responses of signals to a reference, with a factor of their noise.

    Attributes
    ----------
    gains
        Response of each signal to the reference, shape (signals, lines); NaN where it cannot be determined.
    residual
        Factor F of the noise in the signals' spectra, shape (lines, any, signals): the noise of Σ a_i·S_i has the
        variance |F·a|².
    variance
        Variance of a gain over that of the noise, shape (lines,).
    dof
        Complex degrees of freedom of the noise; the least of all lines.
    power
        Mean |R|² around each line, shape (lines,).
    """

    gains: Complex
    residual: Complex
    variance: Floats
    dof: float
    power: Floats

    def noise(self, weights: Complex) -> Floats:
        """Power of the noise in Σ a_i·S_i, shape (lines,); `weights` has the shape (signals, lines)."""
        return np.asarray(np.sum(np.abs(np.einsum("krs,sk->kr", self.residual, weights)) ** 2, axis=1))


def triangular(equations: Complex) -> Complex:
    """Triangular factor R of equations, R*R = A*A, shape (lines, unknowns, unknowns)."""
    return np.asarray(np.linalg.qr(equations, mode="r"))
