"""From moments to sigma: the standard deviation of the error of an estimate."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.estimation.moments import Moments

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]


def power(spectrum: Complex) -> Floats:
    """|X|² without the square root that abs takes."""
    return np.asarray(spectrum.real**2 + spectrum.imag**2)


def between_periods(moments: Moments) -> Floats:
    """Variance of numerator − Ĝ·denominator over the periods, for one window, shape (rows, lines).

    Feedback carries noise into both; the difference contains only what the plant does not explain, to first order the
    output noise that joint and indirect estimates have in common.
    """
    numerator, denominator = moments.pair
    return np.asarray(moments.unexplained(numerator / denominator) / moments.unbiased[:, np.newaxis])


def unbiased(coherence: Floats, moments: Moments) -> Floats:
    """γ² without its bias of (1 − γ²)/m over m periods, shape (rows, lines)."""
    return np.asarray(np.maximum(1 - (1 - coherence) / (1 - moments.of_mean[:, np.newaxis]), 0.0))


def contained(sigma: Floats, dof: Floats, distortion: Floats, dof_distortion: float) -> tuple[Floats, Floats]:
    """Sigma (rows, lines) and degrees of freedom (rows,) of noise and distortion together.

    The degrees of freedom are matched in two moments (Satterthwaite 1946); the least of all lines is used. A distortion
    that is not known (NaN) adds nothing.
    """
    noise, added = sigma**2, np.where(np.isfinite(distortion), distortion**2, 0.0)
    together = noise + added
    of_line = together**2 / (noise**2 / dof[:, np.newaxis] + added**2 / dof_distortion)
    least = np.where(np.isfinite(of_line), of_line, np.inf).min(axis=1)
    return np.sqrt(together), np.where((added > 0).any(axis=1), np.fmin(dof, least), dof)
