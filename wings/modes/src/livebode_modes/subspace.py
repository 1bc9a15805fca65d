"""Covariance-driven stochastic subspace identification (SSI) with bounds by first-order perturbation."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.dataclass import dataclass
from livebode_modes.correlations import hankel

_ROUNDING = 1e-9  # of the largest singular value: smaller ones are rounding


@dataclass(frozen=True, eq=False)
class Poles:
    """The oscillating poles of one model order, by frequency.

    Attributes
    ----------
    order
        Number of states.
    frequency_hz, damping
        Natural frequency |s|/2π and damping ratio −Re s/|s| of each pole s, (poles,).
    covariance
        Of frequency and damping, (poles, 2, 2).
    share
        Power of the mode as a share of that of all outputs, (poles,).
    shape
        Mode shape at the outputs, (poles, outputs).
    """

    order: int
    frequency_hz: Floats
    damping: Floats
    covariance: Floats
    share: Floats
    shape: Complex

    def __len__(self) -> int:
        return len(self.frequency_hz)


class Subspace:
    """Models of rising order from the correlations of the hops of a window.

    The outputs' correlations of a linear system under white noise, and those of its free decay, are sums of its modes:
    the column space of their Hankel matrix is that of the observability matrix (Van Overschee & De Moor 1996; Peeters &
    De Roeck 1999). Bounds follow from the scatter of the hops: each hop's deviation from the mean is a direction, along
    which singular vectors and poles are differentiated (Reynders, Pintelon & De Roeck 2008; Döhler & Mevel 2013).
    A deviation inside the subspace, such as the falling amplitude of a decay, does not change the poles.

    Parameters
    ----------
    correlations
        Shape (hops, lags + 1, outputs, outputs).
    rows
        Block rows and block columns of the Hankel matrix.
    rate_hz
        Samples per second of the outputs.
    """

    def __init__(self, correlations: Floats, rows: int, rate_hz: float) -> None:
        hops, outputs = len(correlations), correlations.shape[-1]
        mean = correlations.mean(axis=0)
        deviations = (correlations - mean) / np.sqrt(hops * (hops - 1))
        self._matrix = hankel(mean, rows)
        self._left, self._values, right = np.linalg.svd(self._matrix)
        self._right = right.T
        self._rank = int(np.count_nonzero(self._values > _ROUNDING * self._values[0]))
        self._outputs, self._rate_hz = outputs, rate_hz
        self._power = float(np.trace(mean[0]))
        directions = hankel(deviations, rows)
        self._forward = self._left.T @ directions @ self._right  # Uᵀ·ΔH·V of each hop

    @property
    def order_max(self) -> int:
        """Largest order that the matrix allows."""
        return int(self._values.size - self._outputs)

    def excess(self, order: int) -> float:
        """Squared sum of the singular values that a model of this order leaves out, relative to that of their scatter.

        It is about 1 if these singular values are noise.
        """
        noise = np.sum(self._forward[:, order:, order:] ** 2)
        return float(np.sum(self._values[order:] ** 2) / noise) if noise > 0 else np.inf

    def poles(self, order: int) -> Poles:
        """The poles of the model with so many states; of fewer if the outputs have no noise that needs more."""
        order = min(order, self._rank)
        observability = self._left[:, :order]
        upper, lower = observability[: -self._outputs], observability[self._outputs :]
        inverse = np.linalg.pinv(upper)
        transition = inverse @ lower
        roots, vectors = np.linalg.eig(transition)
        use = np.flatnonzero(roots.imag > 0)
        s = np.log(roots[use]) * self._rate_hz
        lefts = np.linalg.inv(vectors)[use]
        changes = self._changes(order, inverse, transition, lefts, vectors[:, use])
        slope = changes / roots[use] * self._rate_hz  # ds of each hop and pole
        size = np.abs(s)
        df = np.real(np.conj(s) * slope) / size / (2 * np.pi)
        # ζ = −Re s/|s|: dζ = Im s·(Re s·d Im s − Im s·d Re s)/|s|³
        dz = s.imag * (s.real * slope.imag - s.imag * slope.real) / size**3
        both = np.stack([df, dz], axis=-1)
        covariance = np.einsum("kpi,kpj->pij", both, both)
        shape = observability[: self._outputs] @ vectors[:, use]
        share = self._shares(order, shape, lefts, roots[use])
        order_of_size = np.argsort(size)
        damping = -s.real / size
        return Poles(
            order,
            size[order_of_size] / (2 * np.pi),
            damping[order_of_size],
            covariance[order_of_size],
            share[order_of_size],
            shape.T[order_of_size],
        )

    def _changes(self, order: int, inverse: Floats, transition: Floats, lefts: Complex, vectors: Complex) -> Complex:
        """Change of each root along each hop's deviation, (hops, poles)."""
        s, t = self._values[:order], self._values[order:]
        across = self._forward[:, order:, :order]  # U2ᵀ·ΔH·V1
        back = self._forward[:, :order, order:].swapaxes(1, 2)  # (U1ᵀ·ΔH·V2)ᵀ
        turned = (across * s + t[:, np.newaxis] * back) / (s**2 - t[:, np.newaxis] ** 2)
        moved = self._left[:, order:] @ turned  # of the observability matrix, apart from a change of basis
        upper, lower = moved[:, : -self._outputs], moved[:, self._outputs :]
        observability = self._left[:, :order]
        residual = observability[self._outputs :] - observability[: -self._outputs] @ transition
        gram = inverse @ inverse.T
        change = inverse @ (lower - upper @ transition) + gram @ upper.swapaxes(1, 2) @ residual
        return np.asarray(np.einsum("pi,kij,jp->kp", lefts, change, vectors))

    def _shares(self, order: int, shape: Complex, lefts: Complex, roots: Complex) -> Floats:
        """Share of each conjugate pair of poles in R(0), from R(1) = C·G extrapolated by one lag."""
        control = self._values[:order, np.newaxis] * self._right[: self._outputs, :order].T
        parts = np.einsum("op,pi,io->p", shape, lefts, control) / roots
        return np.asarray(2 * parts.real / self._power)
