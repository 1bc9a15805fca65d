"""Roots and minima of functions of one variable within brackets, for many rows at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from livebode.arrays import Floats

Function = Callable[[Floats], Floats]

_STEPS_MAX = 200  # each halves a bracket: enough for any two numbers that are not 1e60 apart
_GOLDEN = (5**0.5 - 1) / 2


def find_roots(function: Function, low: Floats, high: Floats, tolerance: float) -> Floats:
    """Roots between ends of opposite signs, (rows,), by Ridders' method (IEEE Trans. Circuits Syst. 26, 1979).

    It halves the bracket in each step, and converges quadratically where the function is smooth. The value at an end
    may be infinite.

    Parameters
    ----------
    function
        Value of each row at one place each, (rows,) to (rows,).
    tolerance
        Of the root, relative.

    Examples
    --------
    >>> find_roots(lambda x: x**2 - np.array([2.0, 9.0]), np.array([1.0, 1.0]), np.array([2.0, 5.0]), 1e-12).round(9)
    array([1.41421356, 3.        ])
    """
    at_low, at_high = function(low), function(high)
    found = high
    with np.errstate(all="ignore"):
        for _ in range(_STEPS_MAX):
            middle = (low + high) / 2
            level = function(middle)
            step = (middle - low) * np.sign(at_low - at_high) * level / np.sqrt(level**2 - at_low * at_high)
            last, found = found, middle + np.where(np.isfinite(step), step, 0.0)
            value = function(found)
            for x, y in ((middle, level), (found, value)):
                inside = (x > low) & (x < high)
                below = inside & ((y > 0) == (at_low > 0))
                above = inside & ~below
                low, at_low = np.where(below, x, low), np.where(below, y, at_low)
                high, at_high = np.where(above, x, high), np.where(above, y, at_high)
            if ((np.abs(found - last) <= tolerance * np.abs(found)) | (value == 0)).all():
                break
    return found


def find_minima(function: Function, low: Floats, high: Floats, width: float) -> Floats:
    """Minima between ends, (rows,), by golden sections to this width, and then by a parabola.

    The parabola is more accurate than any section: near a minimum values differ by rounding only.

    Examples
    --------
    >>> find_minima(lambda x: (x - np.array([0.2, 0.7])) ** 2, np.zeros(2), np.ones(2), 1e-4).round(8)
    array([0.2, 0.7])
    """
    left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    at_left, at_right = function(left), function(right)
    while (high - low).max(initial=0.0) > width:
        lower = at_left < at_right
        low, high = np.where(lower, low, left), np.where(lower, right, high)
        new = np.where(lower, high - _GOLDEN * (high - low), low + _GOLDEN * (high - low))
        value = function(new)
        left, right = np.where(lower, new, right), np.where(lower, left, new)
        at_left, at_right = np.where(lower, value, at_right), np.where(lower, at_left, value)
    middle, quarter = (low + high) / 2, (high - low) / 4
    before, at, after = (function(x) for x in (low, middle, high))
    bend = before - 2 * at + after
    share = np.divide(before - after, bend, out=np.zeros_like(bend), where=bend > 0).clip(-2, 2)
    return np.asarray(middle + quarter * share)
