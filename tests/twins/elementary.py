"""exp, expm1, log, sin and cos of the fit from IEEE 754 operations alone, in NumPy: the bits of C.

Argument reduction in two parts (Cody and Waite), then Taylor's series.
"""

from __future__ import annotations

from math import factorial, frexp
from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Number = Any
"""np.float64 or an array of it."""

_LN2 = 6.93147180369123816490e-01, 1.90821492927058770002e-10
_HALF_PI = 1.57079632673412561417, 6.07710050650619224932e-11
_EXP_MAX, _TURN_MAX, _SMALL = 700.0, 1e6, 0.5
_EXP = [1 / factorial(k) for k in range(13, -1, -1)]
_EXPM1 = [1 / factorial(k) for k in range(15, 0, -1)]
_SINE = [(-1) ** k / factorial(2 * k + 1) for k in range(8, 0, -1)]
_COSINE = [(-1) ** k / factorial(2 * k) for k in range(9, 0, -1)]


def exp(x: np.float64) -> np.float64:
    """e^x; infinite or zero beyond ±700."""
    if not abs(x) < _EXP_MAX:
        return x if np.isnan(x) else np.float64(np.inf if x > 0 else 0.0)
    k = np.floor(x * np.float64(1.4426950408889634) + 0.5)
    return np.float64(np.ldexp(_horner(_EXP, (x - k * _LN2[0]) - k * _LN2[1]), int(k)))


def expm1(x: np.float64) -> np.float64:
    """e^x − 1."""
    if not abs(x) < _SMALL:
        return exp(x) - 1.0
    return np.float64(_horner(_EXPM1, x) * x)


def log(x: np.float64) -> np.float64:
    """ln x; −∞ below the least normal number, NaN for a negative one."""
    if not x >= np.finfo(np.float64).tiny:
        return np.float64(-np.inf if x >= 0 else np.nan)
    if np.isinf(x):
        return x
    m, e = frexp(x)
    if m < 0.7071067811865476:
        m, e = m * 2.0, e - 1
    s = np.float64(m - 1.0) / (m + 1.0)
    z = s * s
    p = np.float64(1.0 / 23.0)
    for odd in range(21, 0, -2):
        p = p * z + 1.0 / odd
    return np.float64(e * _LN2[0] + (e * _LN2[1] + 2.0 * s * p))


def turned(x: Number) -> tuple[Number, Number]:
    """cos x and sin x for |x| below 1e6; NaN beyond."""
    x = np.where(np.abs(x) < _TURN_MAX, x, np.nan)
    k = np.floor(x * 0.6366197723675814 + 0.5)
    r = (x - k * _HALF_PI[0]) - k * _HALF_PI[1]
    z = r * r
    sine = r + r * (z * _horner(_SINE, z))
    cosine = 1.0 + z * _horner(_COSINE, z)
    quarter = np.where(np.isnan(k), 0.0, k).astype(np.int64) & 3
    return (
        np.choose(quarter, [cosine, -sine, -cosine, sine]),
        np.choose(quarter, [sine, cosine, -sine, -cosine]),
    )


def expm1_of(a: np.float64, b: np.float64) -> tuple[np.float64, np.float64]:
    """Real and imaginary part of e^(a + jb) − 1."""
    (_, half), (cosine, sine) = turned(0.5 * b), turned(b)
    return np.float64(expm1(a) * cosine - 2.0 * half * half), np.float64(exp(a) * sine)


def _horner(coefficients: list[float], x: Number) -> Number:
    value: Number = coefficients[0]
    for c in coefficients[1:]:
        value = value * x + c
    return value
