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
    ratio = moments.mean[0] / moments.mean[1]
    shared = (ratio.conj() * moments.cross[0]).real
    total = moments.scatter[0] - 2 * shared + power(ratio) * moments.scatter[1]
    unbiased = moments.unbiased[:, np.newaxis]
    # What rounding leaves below zero is zero.
    return np.where(unbiased > 1e-9, np.maximum(total, 0.0) / unbiased, np.nan)


def coherence(moments: Moments) -> Floats:
    """γ² = |S_ry|²/(S_rr·S_yy), Nevaranta 2016, eq. (18), shape (rows, lines); 1 for a single window."""
    return np.asarray(power(moments.mean[0]) / (moments.power[0] * moments.power[1]))
