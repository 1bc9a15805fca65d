"""An extended Kalman filter that holds the two masses and their parameters in its state."""

from __future__ import annotations

import numpy as np

from studies.peers import two_mass
from studies.peers.arx import rows
from studies.peers.compiled import compiled
from studies.peers.estimates import Estimates
from studies.peers.recording import LINES, NOISE_RAD_PER_S, RATE_HZ, Recording

# State: torsion, m; motor and cart speed; the logarithms of Keff, bs, Js, mL; friction of the cart, N; the drift per
# second of Keff's logarithm.
START = np.array([0.0, 0.0, 0.0, *np.log(two_mass.NOMINAL[[2, 3, 0, 1]]), 0.0, 0.0])
# Standard deviations at the start, at rest; ten times the doubt in the first three lets one start in twelve diverge.
DOUBT = np.array([1e-5, 0.1, 0.01, 0.5, 0.3, 0.1, 0.1, 20.0, 1.0])
WANDER = np.array([1e-9, 1e-4, 1e-6, 3e-3, 1e-1, 1e-3, 1e-3, 10.0, 0.2])  # of the state's random walks, per √s
STATES, DRIFT = 9, 8
TERMS = 4  # of the exponential series over a tick: 1e-6 at 90 Hz
RADIUS_M = two_mass.RADIUS_M
NONE = np.empty((0, STATES, STATES))


@compiled
def moved(x, torque, tick_s):
    """The first three states a tick later under constant torque, and their slope by the eight before the drift."""
    stiffness, damping, inertia, load = np.exp(x[3]), np.exp(x[4]), np.exp(x[5]), np.exp(x[6])
    new, slope = x[:3].copy(), np.zeros((3, 8))
    term, turn, next_turn = x[:3].copy(), np.zeros((3, 8)), np.zeros((3, 8))
    for i in range(3):
        slope[i, i] = turn[i, i] = 1.0
    for order in range(TERMS):
        share, first = tick_s / (order + 1), 1.0 if order == 0 else 0.0
        pull, drag = stiffness * term[0], damping * (RADIUS_M * term[1] - term[2])
        for j in range(DRIFT):
            force = stiffness * turn[0, j] + damping * (RADIUS_M * turn[1, j] - turn[2, j])
            if j == 3:
                force += pull
            elif j == 4:
                force += drag
            next_turn[0, j] = share * (RADIUS_M * turn[1, j] - turn[2, j])
            next_turn[1, j] = -share * RADIUS_M * force / inertia
            next_turn[2, j] = share * (force - (first if j == 7 else 0.0)) / load
        force = pull + drag
        stretch = RADIUS_M * term[1] - term[2]
        term[0] = share * stretch
        term[1] = share * (first * torque - RADIUS_M * force) / inertia
        term[2] = share * (force - first * x[7]) / load
        next_turn[1, 5] -= term[1]
        next_turn[2, 6] -= term[2]
        new += term
        slope += next_turn
        turn[:] = next_turn
    return new, slope


@compiled
def spread(covariance, slope, tick_s, wander):
    """The covariance a tick later; F is the slope over rows of the unit matrix, with the drift feeding the fourth."""
    half, new = covariance.copy(), np.empty((STATES, STATES))
    for j in range(STATES):
        for i in range(3):
            half[i, j] = 0.0
            for k in range(DRIFT):
                half[i, j] += slope[i, k] * covariance[k, j]
        half[3, j] += tick_s * covariance[DRIFT, j]
    new[:] = half
    for i in range(STATES):
        for j in range(3):
            new[i, j] = 0.0
            for k in range(DRIFT):
                new[i, j] += half[i, k] * slope[j, k]
        new[i, 3] += tick_s * half[i, DRIFT]
    for i in range(STATES):
        new[i, i] += wander[i] ** 2 * tick_s
        for j in range(i):
            new[i, j] = new[j, i]
    return new


@compiled
def filtered(u, y, start, doubt, wander, noise, tick_s, covariances):
    """States after each sample's correction, shape (samples, 9), and into `covariances`, where not empty, theirs."""
    x, covariance, found = start.copy(), np.diag(doubt**2), np.empty((len(u), STATES))
    for n in range(len(u)):
        gain = covariance[:, 1].copy()
        total = gain[1] + noise**2
        error = y[n] - x[1]
        for i in range(STATES):
            x[i] += gain[i] * error / total
            for j in range(STATES):
                covariance[i, j] -= gain[i] * gain[j] / total
        found[n] = x
        if len(covariances):
            covariances[n] = covariance
        new, slope = moved(x, u[n], tick_s)
        x[:3] = new
        x[3] += tick_s * x[DRIFT]
        covariance = spread(covariance, slope, tick_s, wander)
    return found


def tuned(recording: Recording) -> Estimates:
    u, y = recording.block["u"], recording.block["velocity"]
    newest, _ = rows(len(y))
    states = filtered(u, y, START, DOUBT, WANDER, NOISE_RAD_PER_S, 1 / RATE_HZ, NONE)[newest]
    parameters = np.exp(states[:, [5, 6, 3, 4]])
    return Estimates(newest, 0.0, two_mass.response(parameters, LINES.frequency_hz, RATE_HZ), parameters)
