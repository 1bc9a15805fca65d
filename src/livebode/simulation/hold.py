"""Zero-order hold: the state equation from tick to tick."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats

_TERMS = 18  # of the series: the rest is below 1e-21 for a norm of at most 1/2


def held(a: Floats, b: Floats, seconds: float) -> tuple[Floats, Floats]:
    """A and b of x(n+1) = A·x(n) + b·u(n) for x' = a·x + b·u with u constant over a tick, (n, n) and (n,).

    Both are in the exponential of [[a, b], [0, 0]]·seconds (Van Loan, IEEE Trans. Autom. Control 23(3), 1978): its
    series for a tick that is halved until it is short, then squared as often.

    >>> held(np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([0.0, 1.0]), 2.0)
    (array([[1., 2.],
           [0., 1.]]), array([2., 2.]))
    """
    n = len(b)
    block = np.zeros((n + 1, n + 1))
    block[:n, :n], block[:n, n] = a, b
    block *= seconds
    halvings = max(int(np.frexp(np.abs(block).sum(axis=0).max())[1]) + 1, 0)
    block /= 2.0**halvings
    step = np.eye(n + 1)
    for order in range(_TERMS, 0, -1):
        step = np.eye(n + 1) + block @ step / order
    for _ in range(halvings):
        step = step @ step
    return step[:n, :n], step[:n, n]
