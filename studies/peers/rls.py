"""Recursive least squares with forgetting: by the textbook, and tuned with care."""

from __future__ import annotations

import numpy as np

from studies.peers.arx import Order, Prepared, rows
from studies.peers.compiled import compiled
from studies.peers.estimates import Estimates
from studies.peers.recording import RATE_HZ, Recording

START = 1e3  # of the covariance's diagonal
TEXTBOOK = Order(3, 3)
TUNED, TUNED_DELAY = Order(8, 9, first=0), 230.0
BAND = Prepared(15.0, 170.0, every=8, order=4)
MEMORY_S = 0.05


@compiled
def recursion(phi, y, forgetting, start):
    """Parameters after every sample, shape (samples, parameters).

    The covariance is updated in its upper triangle and mirrored; otherwise rounding takes its symmetry, and with it the
    estimate, within some 1e4 samples.
    """
    samples, count = phi.shape
    theta, covariance, gain = np.zeros(count), np.eye(count) * start, np.zeros(count)
    found = np.empty((samples, count))
    for n in range(samples):
        scale, error = forgetting, y[n]
        for i in range(count):
            gain[i] = 0.0
            for j in range(count):
                gain[i] += covariance[i, j] * phi[n, j]
            scale += gain[i] * phi[n, i]
            error -= theta[i] * phi[n, i]
        for i in range(count):
            theta[i] += gain[i] * error / scale
            for j in range(i, count):
                covariance[i, j] = (covariance[i, j] - gain[i] * gain[j] / scale) / forgetting
                covariance[j, i] = covariance[i, j]
        found[n] = theta
    return found


def textbook(recording: Recording) -> Estimates:
    """Third order at the full rate on what was logged, λ = 1 − 1/200, dated at the newest sample."""
    u, y = recording.block["u"], recording.block["velocity"]
    theta = recursion(TEXTBOOK.regressors(u, y), y, 1 - 1 / 200, START)
    newest, kept = rows(len(y))
    return Estimates(newest, 0.0, TEXTBOOK.response(theta[kept], RATE_HZ))


def tuned(recording: Recording) -> Estimates:
    """Band-passed, at 500 Hz, order 8, 50 ms of memory, dated where it fits best."""
    u, y = BAND.signals(recording.block["u"], recording.block["velocity"])
    theta = recursion(TUNED.regressors(u, y), y, 1 - 1 / (MEMORY_S * BAND.rate_hz), START)
    newest, kept = rows(len(recording.block), BAND.every)
    return Estimates(newest, TUNED_DELAY, TUNED.response(theta[kept], BAND.rate_hz))
