"""From moments to sigma: how far an estimate is likely to be from the truth."""

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

    Feedback carries noise into both; the difference holds only what the plant does not explain, to first order the
    output noise that joint and indirect estimates have in common.
    """
    numerator, denominator = moments.pair
    return np.asarray(moments.unexplained(numerator / denominator) / moments.unbiased[:, np.newaxis])
