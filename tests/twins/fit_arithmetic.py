"""Sums, products and linear equations of the fit's NumPy twin, in the order in which C computes them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]
Curve = tuple[Floats, Floats]
"""Real and imaginary parts, (lines,)."""

_LANES = 8


class SingularError(ArithmeticError):
    """A matrix has no inverse, so that the row has no fit."""


def total(x: Floats) -> np.float64:
    """Sum with eight partial sums."""
    lanes = np.zeros(_LANES)
    for part in np.pad(x, (0, -len(x) % _LANES)).reshape(-1, _LANES):
        lanes = lanes + part
    s = lanes
    return np.float64(((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7])))


def product(square: Floats, a: Curve, b: Curve) -> np.float64:
    """Σ square·Re(a·conj(b))."""
    return total(square * (a[0] * b[0] + a[1] * b[1]))


def times(a: Any, b: Any) -> Any:
    """Product of complex numbers as pairs."""
    return a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]


def solve(matrix: Floats, right: Floats) -> Floats:
    """matrix·x = right (n, columns) by Gauss with partial pivoting; SingularError without a solution."""
    matrix, right, n = matrix.copy(), right.copy(), len(matrix)
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            pivot = i if abs(matrix[i, k]) > abs(matrix[pivot, k]) else pivot
        if matrix[pivot, k] == 0:
            raise SingularError
        matrix[[k, pivot]], right[[k, pivot]] = matrix[[pivot, k]], right[[pivot, k]]
        for i in range(k + 1, n):
            share = matrix[i, k] / matrix[k, k]
            matrix[i, k + 1 :] = matrix[i, k + 1 :] - share * matrix[k, k + 1 :]
            right[i] = right[i] - share * right[k]
    for k in reversed(range(n)):
        for i in range(k + 1, n):
            right[k] = right[k] - matrix[k, i] * right[i]
        right[k] = right[k] / matrix[k, k]
    return right


def matrix_product(a: Floats, b: Floats) -> Floats:
    found = np.zeros(a.shape)
    for i in range(len(a)):
        found = found + a[:, i, np.newaxis] * b[i]
    return found
