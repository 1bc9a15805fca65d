"""Polynomials whose coefficients are numbers or arrays, from the highest power on."""

from __future__ import annotations

from typing import Any


def times(first: list[Any], second: list[Any]) -> list[Any]:
    """Product of two polynomials.

    >>> times([1.0, 2.0], [1.0, 3.0])
    [1.0, 5.0, 6.0]
    """
    product: list[Any] = [0.0] * (len(first) + len(second) - 1)
    for i, a in enumerate(first):
        for j, b in enumerate(second):
            product[i + j] = product[i + j] + a * b
    return product


def plus(first: list[Any], second: list[Any]) -> list[Any]:
    """Sum of two polynomials.

    >>> plus([1.0, 0.0, 2.0], [5.0, 1.0])
    [1.0, 5.0, 3.0]
    """
    short, long = sorted((first, second), key=len)
    offset = len(long) - len(short)
    return [x + (short[i - offset] if i >= offset else 0.0) for i, x in enumerate(long)]
