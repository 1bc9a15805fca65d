"""Products of complex numbers by real operations, which round in one way wherever a number is in an array."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Complex, Floats


def power(spectrum: Complex) -> Floats:
    """|X|² without the square root that abs takes."""
    return np.asarray(spectrum.real**2 + spectrum.imag**2)


def magnitude(spectrum: Complex) -> Floats:
    """|X|, from its power: the last bit of abs depends on the processor."""
    return np.asarray(np.sqrt(power(spectrum)))


def times(factor: Complex, other: Complex) -> Complex:
    """Product by real operations: NumPy's of complex numbers rounds otherwise in the last elements of an array."""
    product = np.empty(np.broadcast_shapes(factor.shape, other.shape), dtype=np.complex128)
    product.real = factor.real * other.real - factor.imag * other.imag
    product.imag = factor.real * other.imag + factor.imag * other.real
    return product


def scaled(number: Complex, factor: Floats | float) -> Complex:
    """Product with a real number."""
    product = np.empty(number.shape, dtype=np.complex128)
    product.real, product.imag = number.real * factor, number.imag * factor
    return product


def divided(dividend: Complex, divisor: Complex) -> Complex:
    """Quotient without overflow of |other|² (R. L. Smith, 1962), as NumPy divides where products are rounded."""
    a, b, c, d = dividend.real, dividend.imag, divisor.real, divisor.imag
    re, im = np.abs(c), np.abs(d)
    wide, zero = re >= im, (re == 0) & (im == 0)
    ratio = np.where(wide, d / c, c / d)
    scale = 1 / np.where(wide, c + d * ratio, d + c * ratio)
    quotient = np.empty(np.broadcast_shapes(dividend.shape, divisor.shape), dtype=np.complex128)
    quotient.real = np.where(zero, a / re, np.where(wide, a + b * ratio, a * ratio + b) * scale)
    quotient.imag = np.where(zero, b / re, np.where(wide, b - a * ratio, b * ratio - a) * scale)
    return quotient
