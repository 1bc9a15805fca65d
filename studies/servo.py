"""A two-mass servo in its speed loop, simulated with SciPy alone: for comparisons that use nothing of livebode.

Motor and load are joined by a shaft; the torque is held between the samples, and the discretisation is exact. A PI
controller holds the speed at 0. The excitation is added to its torque.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

RATE_HZ, PERIOD = 4000.0, 4000
MOTOR_KG_M2, LOAD_KG_M2, STIFFNESS_N_M = 0.0012, 0.0025, 180.0
DAMPING_RATIO = 0.01837
GAIN, INTEGRAL_TIME_S = 0.4, 0.15
LINES_HZ = np.arange(4, 201, 3)

_RESONANCE_RAD_PER_S = np.sqrt(STIFFNESS_N_M * (1 / MOTOR_KG_M2 + 1 / LOAD_KG_M2))
_DAMPING = 2 * DAMPING_RATIO * _RESONANCE_RAD_PER_S / (1 / MOTOR_KG_M2 + 1 / LOAD_KG_M2)
_SHAFT = np.array([_DAMPING, -_DAMPING, STIFFNESS_N_M])
_RATES = np.array([-_SHAFT / MOTOR_KG_M2, _SHAFT / LOAD_KG_M2, [1.0, -1.0, 0.0]])
_HELD = expm(np.block([[_RATES, np.array([[1 / MOTOR_KG_M2], [0.0], [0.0]])], [np.zeros((1, 4))]]) / RATE_HZ)
_STEP, _INPUT = _HELD[:3, :3], _HELD[:3, 3]


@dataclass(frozen=True)
class Signals:
    """Excitation (samples,), torque and speed (seeds, samples)."""

    w: NDArray[np.float64]
    u: NDArray[np.float64]
    y: NDArray[np.float64]


def plant(frequency_hz: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Speed over torque, of the sampled plant."""
    z = np.exp(2j * np.pi * np.asarray(frequency_hz) / RATE_HZ)
    return np.array([np.linalg.solve(one * np.eye(3) - _STEP, _INPUT)[0] for one in z])


def multisine(seconds: float, amplitude_n_m: float = 0.02) -> NDArray[np.float64]:
    """The excitation: 66 lines from 4 to 199 Hz with Schroeder's phases, period 1 s."""
    count = len(LINES_HZ)
    phases = -np.pi * np.arange(count) * (np.arange(count) + 1) / count
    t = np.arange(PERIOD) / RATE_HZ
    period = amplitude_n_m * np.cos(2 * np.pi * LINES_HZ[:, np.newaxis] * t + phases[:, np.newaxis]).sum(axis=0)
    return np.resize(period, round(seconds * RATE_HZ))


def measured(
    w: NDArray[np.float64], seeds: int, noise_rad_per_s: float, *, gain: float = GAIN, run_in: int = 2 * PERIOD
) -> Signals:
    """Recordings that differ in the noise of the speed alone, after `run_in` samples."""
    noise = noise_rad_per_s * np.random.default_rng(1).standard_normal((w.size, seeds))
    state, integral = np.zeros((3, seeds)), np.zeros(seeds)
    u, y = np.empty((w.size, seeds)), np.empty((w.size, seeds))
    for n in range(w.size):
        y[n] = state[0] + noise[n]
        integral -= y[n] / RATE_HZ
        u[n] = gain * (integral / INTEGRAL_TIME_S - y[n]) + w[n]
        state = _STEP @ state + np.outer(_INPUT, u[n])
    return Signals(w[run_in:], np.ascontiguousarray(u[run_in:].T), np.ascontiguousarray(y[run_in:].T))
