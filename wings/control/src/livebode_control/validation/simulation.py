"""A fitted model driven by a recording: simulated output, and its slopes by the parameters."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.core import FitError, SignalError, needing
from livebode.fitting import DELAY, Fit, Transfer

with needing("SciPy", "analysis", "a validation"):
    from scipy import linalg, signal

_STEP = 1e-3  # of a parameter's sigma
_RINGS_OUT = 1e-12
_AT_REST = 1e-5  # of a pole times the recording's length: slower ones act as integrators


class SimulatedOutput(NamedTuple):
    """Result of the simulation of a recording.

    Attributes
    ----------
    known
        The samples whose input is in the recording; a delay excludes some at its start, a negative one at its end.
    output, residual
        Of the model, with start, offset and drift as fitted, and measured less that, (known samples,).
    slopes
        Of the output by each parameter in its sigmas, without start, offset and drift, (known samples, parameters).
    basis
        Orthonormal, of start, offset and drift, (known samples, motions).
    """

    known: slice
    output: Floats
    residual: Floats
    slopes: Floats
    basis: Floats

    def without(self, x: Floats) -> Floats:
        """x without start, offset and drift; shape (known samples,) or (known samples, signals)."""
        return np.asarray(x - self.basis @ (self.basis.T @ x))


def simulate(fit: Fit, u: Floats, y: Floats) -> SimulatedOutput:
    """The model driven by u, against y.

    The unknown state of the model is fitted by least squares: the free motion of each pole, and a polynomial whose
    degree is the plant's number of integrators, which is the effect of a constant load (dry friction in one direction,
    gravity). These are a few columns for thousands of samples, so they hide no error of the model. They are subtracted
    from the measured and the simulated output, and unlike differencing or a high-pass they keep a white residual white.

    Raises
    ------
    FitError
        If the fit failed.
    SignalError
        If there are fewer samples than ten times the number of unknowns.
    """
    if fit.status != "ok":
        raise FitError(
            "not-fitted", f"there is no fit to simulate: {fit.sentence}", "give a fit that is valid", status=fit.status
        )
    values, sigma = fit.parameters.value[0], fit.parameters.sigma[0]
    ticks = _parts(fit, values)[1] * fit.rate_hz
    known = slice(max(0, _whole(ticks)), len(u) - max(0, _whole(-ticks)))
    own = _unforced(fit, values, known.stop - known.start)
    if len(own) < 10 * own.shape[1]:
        raise SignalError(
            "too-short",
            f"{len(own)} samples are too few to validate a model with",
            f"give at least {10 * own.shape[1]}",
            samples=len(own),
            samples_min=10 * own.shape[1],
        )
    # The effect of a constant input is fitted anyway, and its mean would give the largest numbers.
    u = u - np.mean(u)
    forced = _forced(fit, values, u)[known]
    slopes = np.zeros((len(forced), len(values)))
    for i in np.flatnonzero(sigma > 0):
        step = _STEP * sigma * np.eye(len(values))[i]
        change = _forced(fit, values + step, u) - _forced(fit, values - step, u)
        slopes[:, i] = change[known] / (2 * _STEP)
    simulated = SimulatedOutput(known, forced, y[known] - forced, slopes, np.linalg.qr(own)[0])
    residual = simulated.without(simulated.residual)
    return simulated._replace(output=y[known] - residual, residual=residual, slopes=simulated.without(slopes))


def _forced(fit: Fit, values: Floats, u: Floats) -> Floats:
    """Response to u from rest."""
    transfer, delay_s = _parts(fit, values)
    early = max(0, _whole(-delay_s * fit.rate_hz))  # an input that was logged later than it acted
    response = respond(transfer, u, fit.rate_hz, delay_s * fit.rate_hz + early, fit.hold)
    return np.append(response[early:], np.full(early, response[-1]))


def _unforced(fit: Fit, values: Floats, samples: int) -> Floats:
    """The free motions of the model, and that of a constant load, shape (samples, motions)."""
    transfer, _ = _parts(fit, values)
    place = np.linspace(-1.0, 1.0, samples)
    poles = transfer.poles()
    resting = np.abs(poles) * samples / fit.rate_hz < _AT_REST
    columns = [place**k for k in range(transfer.integrators + np.count_nonzero(resting) + 1)]
    ticks = np.arange(samples) / fit.rate_hz
    for pole in poles[~resting]:
        ringing = np.exp(pole * ticks)
        if pole.imag > _RINGS_OUT * abs(pole):
            columns += [ringing.real, ringing.imag]
        elif abs(pole.imag) <= _RINGS_OUT * abs(pole):
            columns.append(ringing.real)
    return np.stack(columns, axis=1)


def _whole(ticks: float) -> int:
    return int(np.ceil(ticks - 1e-9))


def _parts(fit: Fit, values: Floats) -> tuple[Transfer, float]:
    names = fit.model.names
    return fit.model.continuous(values), float(values[names.index(DELAY)]) if DELAY in names else 0.0


def respond(
    transfer: Transfer, u: Floats, rate_hz: float, delay_ticks: float = 0.0, hold: str = "zero-order"
) -> Floats:
    """Output of a system in s from rest, exact behind its hold, without a polynomial in z.

    Its input u is held between ticks or, with hold "none", joined by lines.

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
    total = sum(weight * state for weight, state in zip(_weights(transfer, poles * rate_hz, rate_hz), states))
    return np.asarray(np.append(np.zeros(whole), np.real(total)))[: len(u)]


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
    """Step of the chain for a linear input between ticks, and the effect of both ends."""
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
    remaining = (transfer.numerator / transfer.denominator[0]).astype(np.complex128)
    weights = np.zeros(len(poles), dtype=np.complex128)
    for k in range(len(poles) - 1, -1, -1):
        remaining, remainder = np.polydiv(remaining, np.array([1.0, -poles[k]]))
        weights[k] = remainder[-1] / rate_hz ** (k + 1)
    return weights
