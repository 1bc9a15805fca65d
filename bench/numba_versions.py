"""The sliding DFT that one would write with Numba: the better of a complex and of a planar fast-math version.

Both are the plain recursion (Nevaranta 2016, eq. (4)), the least work there is: no table, no renewal. They start from a
full delay line, and are compiled before the clock runs.
"""

import numba
import numpy as np

from bench.contenders import Task
from bench.work import Array


@numba.njit(fastmath=True)  # type: ignore[untyped-decorator]
def _complex_dense(x, line, state, turn, out):  # type: ignore[no-untyped-def]
    index = 0
    for n in range(len(x)):
        delta = x[n] - line[index]
        line[index] = x[n]
        index = index + 1 if index + 1 < len(line) else 0
        for k in range(len(state)):
            value = (state[k] + delta) * turn[k]
            state[k] = value
            out[n, k] = value


@numba.njit(fastmath=True)  # type: ignore[untyped-decorator]
def _complex_hop(x, line, state, turn, hop, out):  # type: ignore[no-untyped-def]
    index, row, due = 0, 0, 1
    for n in range(len(x)):
        delta = x[n] - line[index]
        line[index] = x[n]
        index = index + 1 if index + 1 < len(line) else 0
        for k in range(len(state)):
            state[k] = (state[k] + delta) * turn[k]
        due -= 1
        if due == 0:
            out[row, :] = state
            row += 1
            due = hop


@numba.njit(fastmath=True)  # type: ignore[untyped-decorator]
def _planar_dense(x, line, re, im, cosine, sine, out_re, out_im):  # type: ignore[no-untyped-def]
    index = 0
    for n in range(len(x)):
        delta = x[n] - line[index]
        line[index] = x[n]
        index = index + 1 if index + 1 < len(line) else 0
        for k in range(len(re)):
            a = re[k] + delta
            b = im[k]
            real = a * cosine[k] - b * sine[k]
            imaginary = a * sine[k] + b * cosine[k]
            re[k] = real
            im[k] = imaginary
            out_re[n, k] = real
            out_im[n, k] = imaginary


@numba.njit(fastmath=True)  # type: ignore[untyped-decorator]
def _planar_hop(x, line, re, im, cosine, sine, hop, out_re, out_im):  # type: ignore[no-untyped-def]
    index, row, due = 0, 0, 1
    for n in range(len(x)):
        delta = x[n] - line[index]
        line[index] = x[n]
        index = index + 1 if index + 1 < len(line) else 0
        for k in range(len(re)):
            a = re[k] + delta
            b = im[k]
            re[k] = a * cosine[k] - b * sine[k]
            im[k] = a * sine[k] + b * cosine[k]
        due -= 1
        if due == 0:
            out_re[row, :] = re
            out_im[row, :] = im
            row += 1
            due = hop


def _started(x: Array, window: int, bins: list[int]) -> tuple[Array, Array, Array, Array]:
    """New samples, the delay line and state before them, and the turn per sample."""
    line = np.concatenate([[0.0], x[: window - 1]])
    turn = np.exp(2j * np.pi * np.array(bins) / window)
    return x[window - 1 :], line, np.fft.fft(line)[bins], turn


def by_numba_complex(x: Array, window: int, bins: list[int], hop: int) -> Task:
    new, line, start, turn = _started(x, window, bins)
    out = np.empty(((len(new) - 1) // hop + 1, len(bins)), complex)

    def task() -> Array:
        ring, state = line.copy(), start.copy()
        if hop == 1:
            _complex_dense(new, ring, state, turn, out)
        else:
            _complex_hop(new, ring, state, turn, hop, out)
        return out

    return task


def by_numba_planar(x: Array, window: int, bins: list[int], hop: int) -> Task:
    """Its rows stay planar, (2, rows, bins): it is not made to pay for interleaving them."""
    new, line, start, turn = _started(x, window, bins)
    cosine, sine = turn.real.copy(), turn.imag.copy()
    out = np.empty((2, (len(new) - 1) // hop + 1, len(bins)))

    def task() -> Array:
        ring, re, im = line.copy(), start.real.copy(), start.imag.copy()
        if hop == 1:
            _planar_dense(new, ring, re, im, cosine, sine, out[0], out[1])
        else:
            _planar_hop(new, ring, re, im, cosine, sine, hop, out[0], out[1])
        return out

    return task
