"""A fitted model driven by a recording: simulated output, and its slopes by the parameters."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from livebode.arrays import Floats
from livebode.core import FitError, SignalError
from livebode.fitting import DELAY, Fit, Transfer
from livebode.validation.chain import respond

_STEP = 1e-3  # of a parameter's sigma
_RINGS_OUT = 1e-12
_AT_REST = 1e-5  # of a pole times the recording's length: slower ones act as integrators


class Simulated(NamedTuple):
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


def simulate(fit: Fit, u: Floats, y: Floats) -> Simulated:
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
    found = Simulated(known, forced, y[known] - forced, slopes, np.linalg.qr(own)[0])
    residual = found.without(found.residual)
    return found._replace(output=y[known] - residual, residual=residual, slopes=found.without(slopes))


def _forced(fit: Fit, values: Floats, u: Floats) -> Floats:
    """Response to u from rest."""
    transfer, delay_s = _parts(fit, values)
    early = max(0, _whole(-delay_s * fit.rate_hz))  # an input that was logged later than it acted
    found = respond(transfer, u, fit.rate_hz, delay_s * fit.rate_hz + early, fit.hold)
    return np.append(found[early:], np.full(early, found[-1]))


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
