"""Cubic splines over a position, in C, with the bits of SciPy's BSpline."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from livebode.arrays import Floats
from livebode.kernel import _native


class CurveShape(NamedTuple):
    """A curve between its first and its last knot; beyond them it continues straight, and is constant from `reach` on.

    Attributes
    ----------
    knots, weights
        Of the cubic splines, shape (splines + 4,) and (splines,); each end is four times among the knots.
    reach
        Length of the straight continuations.
    slope_before, slope_beyond
        Of these.
    """

    knots: Floats
    weights: Floats
    reach: float
    slope_before: float
    slope_beyond: float


def curve_at(shape: CurveShape, x: Floats) -> Floats:
    """Value at each place, shape (places,)."""
    values = np.empty(len(x))
    _native.curve_at(shape, x, values)
    return values


def curve_splines(knots: Floats, x: Floats) -> Floats:
    """Value of every spline at each place, shape (places, splines); a place beyond the ends is taken as the end."""
    values = np.empty((len(x), len(knots) - 4))
    _native.curve_splines(knots, x, values)
    return values
