"""Products of complex numbers by real operations, which round in one way wherever a number is in an array."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]


def power(spectrum: Complex) -> Floats:
    """|X|² without the square root that abs takes."""
    return np.asarray(spectrum.real**2 + spectrum.imag**2)


def times(one: Complex, other: Complex) -> Complex:
    """Product by real operations: NumPy's of complex numbers rounds otherwise in the last elements of an array."""
    product = np.empty(np.broadcast_shapes(one.shape, other.shape), dtype=np.complex128)
    product.real = one.real * other.real - one.imag * other.imag
    product.imag = one.real * other.imag + one.imag * other.real
    return product
