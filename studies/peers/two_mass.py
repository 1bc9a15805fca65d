"""Two masses behind a zero-order hold, in closed form for many parameters at once, and their minimal fit."""

from __future__ import annotations

import numpy as np

RADIUS_M = 0.019
NOMINAL = np.array([0.0028, 6.7, 5.0e5, 130.0])  # Js, mL, Keff, bs: Table I with the cart in the middle
STARTS = NOMINAL[2] * np.geomspace(0.4, 4.0, 10)
APART_MAX = np.log(20.0)  # no parameter of a fit leaves its nominal value by more than this factor
STEP_MAX = 0.3  # of one iteration, in each parameter's logarithm


def response(parameters: np.ndarray, frequency_hz: np.ndarray, rate_hz: float) -> np.ndarray:
    """Torque to motor velocity, sampled; (…, 4) and (lines,) to (…, lines).

    (14) of Nevaranta 2016 is a free mass, 1/(J·s), and a mode, c·s/(s² + 2·decay·s + ω²); each has a simple step
    response.
    """
    inertia, load, stiffness, damping = np.moveaxis(np.asarray(parameters)[..., np.newaxis], -2, 0)
    total = inertia + load * RADIUS_M**2
    reduced = inertia * load / total
    decay, square = damping / (2 * reduced), stiffness / reduced
    turn = np.sqrt(square - decay**2 + 0j)  # imaginary for a mode without oscillation
    z, tick = np.exp(2j * np.pi * frequency_hz / rate_hz), 1 / rate_hz
    fade = np.exp(-decay * tick)
    swing = fade * (np.sin(turn * tick) / turn).real
    mode = (z - 1) * swing / (z**2 - 2 * fade * np.cos(turn * tick).real * z + fade**2)
    return tick / (total * (z - 1)) + (1 / inertia - 1 / total) * mode


def fit(measured: np.ndarray, frequency_hz: np.ndarray, rate_hz: float, iterations: int = 12) -> np.ndarray:
    """Js, mL, Keff, bs for each row of responses, shape (rows, lines) to (rows, 4); NaN where a row is not finite.

    Levenberg's least squares of the complex errors, all lines alike as white noise and equal lines ask for, in the
    parameters' logarithms, from the best of ten stiffnesses.
    """
    found = np.full((len(measured), 4), np.nan)
    good = np.isfinite(measured).all(axis=1)
    data = measured[good]
    model = lambda logs: response(np.exp(logs), frequency_hz, rate_hz)  # noqa: E731
    found[good] = np.exp(_iterated(data, _best_start(data, model), model, iterations))
    return found


def _best_start(data, model):
    logs = np.log(np.tile(NOMINAL, (len(STARTS), 1)))
    logs[:, 2] = np.log(STARTS)
    costs = np.sum(np.abs(data[:, np.newaxis] - model(logs)) ** 2, axis=-1)
    return logs[np.argmin(costs, axis=1)]


def _iterated(data, logs, model, iterations):
    damping = np.full(len(data), 1e-3)
    cost, residual = _cost(data, logs, model)
    for _ in range(iterations):
        slope = np.stack([(_cost(data, logs + step, model)[1] - residual) / 1e-5 for step in 1e-5 * np.eye(4)], axis=-1)
        curve = np.swapaxes(slope, 1, 2) @ slope
        curve = curve + damping[:, np.newaxis, np.newaxis] * (np.eye(4) * curve + 1e-9 * np.eye(4))
        step = np.linalg.solve(curve, -np.swapaxes(slope, 1, 2) @ residual[..., np.newaxis])[..., 0]
        trial = logs + np.clip(step, -STEP_MAX, STEP_MAX)
        trial = np.clip(trial, np.log(NOMINAL) - APART_MAX, np.log(NOMINAL) + APART_MAX)
        cost_there, residual_there = _cost(data, trial, model)
        better = cost_there < cost
        logs = np.where(better[:, np.newaxis], trial, logs)
        residual = np.where(better[:, np.newaxis], residual_there, residual)
        cost = np.where(better, cost_there, cost)
        damping = np.where(better, damping / 5, damping * 10)
    return logs


def _cost(data, logs, model):
    residual = data - model(logs)
    parts = np.concatenate([residual.real, residual.imag], axis=-1)
    return np.sum(parts**2, axis=-1), parts
