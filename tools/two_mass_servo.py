"""A servo that no part of livebode simulates: two masses on a shaft in a speed loop, discretised exactly by SciPy."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, pi

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import expm

Samples = NDArray[np.float64]


@dataclass(frozen=True)
class TwoMassServo:
    """Motor and load on a shaft; a PI controller holds the speed at 0, and the excitation is added to its torque.

    Attributes
    ----------
    motor, load
        Inertias in kg m².
    stiffness
        Of the shaft, N m/rad.
    damping_ratio
        Of the resonance.
    rate_hz
        Of the samples; the torque is held between them.
    gain, integral_time_s
        Of the controller, N m s/rad and s.
    """

    motor: float = 0.0012
    load: float = 0.0025
    stiffness: float = 180.0
    damping_ratio: float = 0.01837
    rate_hz: float = 4000.0
    gain: float = 0.08
    integral_time_s: float = inf

    @property
    def resonance_hz(self) -> float:
        """Undamped, with the motor free."""
        return float(np.sqrt(self.stiffness * (1 / self.motor + 1 / self.load)) / (2 * pi))

    @property
    def antiresonance_hz(self) -> float:
        """Undamped, with the motor held."""
        return float(np.sqrt(self.stiffness / self.load) / (2 * pi))

    def response(self, frequency_hz: ArrayLike) -> NDArray[np.complex128]:
        """Speed of the motor over torque, of the sampled plant, rad/s/(N m)."""
        step, force = (part[..., :3] for part in self._discrete())
        z = np.exp(2j * pi * np.asarray(frequency_hz) / self.rate_hz)
        return np.array([np.linalg.solve(each * np.eye(3) - step[:3], force)[0] for each in z])

    def run(self, excitation_n_m: Samples, noise_rad_per_s: Samples) -> tuple[Samples, Samples, Samples]:
        """Torque in N m, speed with this noise in rad/s, and angle of the motor in rad, from rest.

        `noise_rad_per_s` has shape (samples,), or (samples, recordings) for several at once; so have the results.
        """
        step, force = self._discrete()
        force = force.reshape(-1, *[1] * (noise_rad_per_s.ndim - 1))
        state, integral = np.zeros((4, *noise_rad_per_s.shape[1:])), np.zeros(noise_rad_per_s.shape[1:])
        torque, speed, angle = (np.empty_like(noise_rad_per_s) for _ in range(3))
        for n, added in enumerate(excitation_n_m):
            speed[n], angle[n] = state[0] + noise_rad_per_s[n], state[3]
            integral = integral - speed[n] / self.rate_hz
            torque[n] = self.gain * (integral / self.integral_time_s - speed[n]) + added
            state = step @ state + force * torque[n]
        return torque, speed, angle

    def _discrete(self) -> tuple[Samples, Samples]:
        """Speeds of both masses, twist of the shaft and angle of the motor, one sample later: of these, of a torque."""
        damping = 4 * pi * self.damping_ratio * self.resonance_hz / (1 / self.motor + 1 / self.load)
        shaft = np.array([damping, -damping, self.stiffness])
        rates = np.zeros((5, 5))
        rates[:4, :3] = [-shaft / self.motor, shaft / self.load, [1, -1, 0], [1, 0, 0]]
        rates[0, 4] = 1 / self.motor
        held = expm(rates / self.rate_hz)
        return held[:4, :4], held[:4, 4]


def multisine(bins: Samples, window: int, phases_rad: Samples) -> Samples:
    """One period of cosines of amplitude 1 at these bins of a window, shape (window,)."""
    return np.cos(2 * pi * np.outer(np.arange(window), bins) / window + phases_rad).sum(axis=1)


def schroeder(count: int) -> Samples:
    """Phases in rad with which so many neighbouring lines have a low crest factor (Schroeder 1970)."""
    k = np.arange(count)
    return np.asarray(-pi * k * (k + 1) / count)
