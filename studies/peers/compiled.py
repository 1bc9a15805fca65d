"""Numba where it is installed, for loops per sample at the cost of C; else plain Python, slow, with equal results."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

try:
    import numba

    LANGUAGE = "Numba"
except ImportError:
    numba = None
    LANGUAGE = "Python"


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    return function if numba is None else numba.njit(cache=False)(function)
