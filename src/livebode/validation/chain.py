"""Response of a system in s to a long recording, exact behind its hold, without a polynomial in z."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.core import needing
from livebode.fitting import Transfer

with needing("SciPy", "analysis", "a validation"):
    from scipy import linalg, signal


def respond(
    transfer: Transfer, u: Floats, rate_hz: float, delay_ticks: float = 0.0, hold: str = "zero-order"
) -> Floats:
    """Output of the system from rest, its input u held between ticks or, with hold "none", joined by lines.

    The poles form a chain, each driven by the previous one, with the integrators last: x_k = u/Π(s − p_j), j ≤ k. Its
    matrix is triangular, so the exact step over one tick is done state by state, each a recursion of first order.
    Coefficients of the whole denominator would split a double pole at z = 1 by 1e-8, which drifts in a long recording;
    partial fractions lose as many digits where a pole is nearly an integrator.

    Parameters
    ----------
    transfer
        A single system, whose coefficients have no further axes.
    u
        Shape (samples,).
    delay_ticks
        ≥ 0; with hold "none" rounded to whole ticks. Before its first sample u has the first value.
    hold
        "zero-order" or "none".

    Examples
    --------
    >>> respond(Transfer.of([1.0], [1.0, 0.0, 0.0]), np.ones(4), 1.0)
    array([0. , 0.5, 2. , 4.5])
    """
    poles = np.append(transfer.poles(), np.zeros(transfer.integrators)).astype(np.complex128) / rate_hz
    if hold == "none":
        whole = round(delay_ticks)
        step, *pushes = _lines(poles)
        drives = [u, np.append(u[1:], u[-1])]
    else:
        whole = int(np.floor(delay_ticks + 1e-9))
        step, *pushes = _held(poles, max(delay_ticks - whole, 0.0))
        drives = [u, np.append(u[:1], u[:-1])]
    states: list[Complex] = []
    for k, pole in enumerate(np.diag(step)):
        push = sum(push[k] * drive for push, drive in zip(pushes, drives))
        for weight, state in zip(step[k], states):
            push = push + weight * state
        states.append(signal.lfilter([0.0, 1.0], [1.0, -pole], push))
    found = sum(weight * state for weight, state in zip(_weights(transfer, poles * rate_hz, rate_hz), states))
    return np.asarray(np.append(np.zeros(whole), np.real(found)))[: len(u)]


def _held(poles: Complex, late: float) -> list[Complex]:
    """Step of the chain over one tick, and the effect of this input and that of the previous tick."""
    soon, before = _step(poles, 1 - late, 1), _step(poles, late, 1)
    states = len(poles)
    return [
        _step(poles, 1.0, 1)[:states, :states],
        soon[:states, states],
        soon[:states, :states] @ before[:states, states],
    ]


def _lines(poles: Complex) -> list[Complex]:
    """The same for a linear input between ticks: step, and the effect of both ends."""
    whole, states = _step(poles, 1.0, 2), len(poles)
    rising = whole[:states, states + 1]
    return [whole[:states, :states], whole[:states, states] - rising, rising]


def _step(poles: Complex, ticks: float, powers: int) -> Complex:
    """Matrix exponential of the chain with as many powers of time as inputs."""
    states = len(poles)
    chain = np.zeros((states + powers, states + powers), dtype=np.complex128)
    chain[range(states), range(states)] = poles
    chain[range(1, states), range(states - 1)] = 1.0
    chain[0, states] = 1.0
    if powers == 2:
        chain[states, states + 1] = 1.0
    return np.asarray(linalg.expm(chain * ticks))


def _weights(transfer: Transfer, poles: Complex, rate_hz: float) -> Complex:
    """Weights of the chain's states in the output: N(s) in Newton's form, by successive division by each factor."""
    rest = (transfer.numerator / transfer.denominator[0]).astype(np.complex128)
    found = np.zeros(len(poles), dtype=np.complex128)
    for k in range(len(poles) - 1, -1, -1):
        rest, remainder = np.polydiv(rest, np.array([1.0, -poles[k]]))
        found[k] = remainder[-1] / rate_hz ** (k + 1)
    return found
