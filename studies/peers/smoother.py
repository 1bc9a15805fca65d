"""The extended Kalman filter once more, its states smoothed backwards over each stroke (Rauch, Tung, Striebel 1965)."""

from __future__ import annotations

import numpy as np

from studies.peers import kalman, two_mass
from studies.peers.arx import rows
from studies.peers.compiled import compiled
from studies.peers.estimates import Estimates
from studies.peers.kalman import DRIFT, STATES, moved, spread
from studies.peers.recording import LINES, NOISE_RAD_PER_S, RATE_HZ, Recording


@compiled
def backwards(u, states, covariances, first, last, wander, tick_s):
    """States of the samples first … last given all up to `last`, shape (samples, 9)."""
    found = np.empty((last - first + 1, STATES))
    found[-1] = states[last]
    for n in range(last - 1, first - 1, -1):
        x, covariance = states[n], covariances[n]
        new, slope = moved(x, u[n], tick_s)
        predicted = x.copy()
        predicted[:3] = new
        predicted[3] += tick_s * x[DRIFT]
        after = spread(covariance, slope, tick_s, wander)
        step = np.eye(STATES)
        step[:3, :DRIFT] = slope
        step[3, DRIFT] = tick_s
        # The states differ by nine powers of ten: in units of their own deviations the matrix can be inverted.
        size = np.sqrt(np.diag(after))
        scaled = after / size.reshape(-1, 1) / size
        pull = np.linalg.solve(scaled, (found[n + 1 - first] - predicted) / size) / size
        found[n - first] = x + covariance @ (step.T @ pull)
    return found


def by_stroke(recording: Recording) -> Estimates:
    """Each stroke once it and a window more are known, as the correction for motion has it."""
    u, y, tick_s = recording.block["u"], recording.block["velocity"], 1 / RATE_HZ
    covariances = np.empty((len(y), STATES, STATES))
    inputs = kalman.START, kalman.DOUBT, kalman.WANDER, NOISE_RAD_PER_S, tick_s
    states = kalman.filtered(u, y, *inputs, covariances)
    stroke, parts = recording.stroke_samples, []
    for first in range(0, len(y), stroke):
        last = min(first + stroke + LINES.window, len(y)) - 1
        parts.append(backwards(u, states, covariances, first, last, kalman.WANDER, tick_s)[:stroke])
    newest, _ = rows(len(y))
    parameters = np.exp(np.concatenate(parts)[newest][:, [5, 6, 3, 4]])
    value = two_mass.response(parameters, LINES.frequency_hz, RATE_HZ)
    return Estimates(newest, 0.0, value, parameters, waits=float(stroke + LINES.window))
