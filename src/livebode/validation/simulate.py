"""A fitted model driven by a recording: what it says of the output, and how that moves with its parameters."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from livebode.fitting import Fit
from livebode.fitting.hold import to_discrete
from livebode.fitting.physical import DELAY
from livebode.fitting.transfer import Transfer
from livebode.nouns import InputError

Floats = NDArray[np.float64]

_STEP = 1e-3  # of a parameter's sigma
_RINGS_OUT = 1e-12


class Simulated(NamedTuple):
    """What a model makes of a recording.

    Attributes
    ----------
    output, residual
        Of the model, with start, offset and drift as fitted, and measured less that, (samples,).
    slopes
        Of the output by each parameter in its sigmas, without start, offset and drift, (samples, parameters).
    basis
        Orthonormal, of start, offset and drift, (samples, motions).
    """

    output: Floats
    residual: Floats
    slopes: Floats
    basis: Floats

    def without(self, x: Floats) -> Floats:
        """x without start, offset and drift; shape (samples,) or (samples, signals)."""
        return np.asarray(x - self.basis @ (self.basis.T @ x))


def simulate(fit: Fit, u: Floats, y: Floats) -> Simulated:
    """The model driven by u, against y.

    What a recording does not say of the model's state is fitted by least squares: the free motion of each pole, and a
    polynomial of as high a degree as the plant has integrators, which is what a constant load (dry friction in one
    direction, gravity) does to it. A handful of columns against thousands of samples, they take nothing that could tell
    a wrong model. They are taken off measured and simulated output alike, and unlike differencing or a high-pass they
    leave a white residual white.

    Raises
    ------
    InputError
        If the fit failed, or there are fewer samples than ten times what is to be found.
    """
    if fit.status != "ok":
        raise InputError(f"there is no fit to simulate: {fit.sentence}")
    values, sigma = fit.parameters.value[0], fit.parameters.sigma[0]
    own = _unforced(fit, values, len(u))
    if len(u) < 10 * own.shape[1]:
        raise InputError(f"{len(u)} samples are too few to judge a model by; give at least {10 * own.shape[1]}")
    forced = _forced(fit, values, u)
    slopes = np.zeros((len(u), len(values)))
    for i in np.flatnonzero(sigma > 0):
        step = _STEP * sigma * np.eye(len(values))[i]
        slopes[:, i] = (_forced(fit, values + step, u) - _forced(fit, values - step, u)) / (2 * _STEP)
    found = Simulated(forced, y - forced, slopes, np.linalg.qr(own)[0])
    residual = found.without(found.residual)
    return found._replace(output=y - residual, residual=residual, slopes=found.without(slopes))


def _forced(fit: Fit, values: Floats, u: Floats) -> Floats:
    """Response to u from rest."""
    transfer, delay_s = _parts(fit, values)
    early = max(0, int(np.ceil(-delay_s * fit.rate_hz - 1e-9)))  # an input that was logged later than it acted
    if early:
        u, delay_s = np.append(u[early:], np.full(early, u[-1])), delay_s + early / fit.rate_hz
    if fit.hold == "none":
        below = np.concatenate([transfer.denominator, np.zeros(transfer.integrators)])
        b, a, _ = signal.cont2discrete((transfer.numerator, below), 1 / fit.rate_hz, method="foh")
        b, late = b.ravel(), round(delay_s * fit.rate_hz)
        u = np.append(np.full(late, u[0]), u)[: len(u)]
    else:
        b, a = to_discrete(transfer, fit.rate_hz, max(delay_s, 0.0))
    # The first sample is no step from nought, but one more thing that is not known of the state before.
    return np.asarray(signal.lfilter(np.append(np.zeros(len(a) - len(b)), b), a, u - u[0]))


def _unforced(fit: Fit, values: Floats, samples: int) -> Floats:
    """The motions of the model that no input makes, and a constant load's, shape (samples, motions)."""
    transfer, delay_s = _parts(fit, values)
    place = np.linspace(-1.0, 1.0, samples)
    columns = [place**k for k in range(transfer.integrators + 1)]
    ticks = np.arange(samples) / fit.rate_hz
    for pole in transfer.poles():
        ringing = np.exp(pole * ticks)
        if pole.imag > _RINGS_OUT * abs(pole):
            columns += [ringing.real, ringing.imag]
        elif abs(pole.imag) <= _RINGS_OUT * abs(pole):
            columns.append(ringing.real)
    late = int(np.ceil(abs(delay_s) * fit.rate_hz - 1e-9))
    columns += [np.where(np.arange(samples) == i, 1.0, 0.0) for i in range(late)]
    columns += [np.where(np.arange(samples) == samples - 1 - i, 1.0, 0.0) for i in range(late)]
    return np.stack(columns, axis=1)


def _parts(fit: Fit, values: Floats) -> tuple[Transfer, float]:
    names = fit.model.names
    return fit.model.continuous(values), float(values[names.index(DELAY)]) if DELAY in names else 0.0
