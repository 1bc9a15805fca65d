"""A small exact closed loop for tests: two masses under the cascade of Nevaranta 2016, Fig. 7, every tick exact.

The plant is discretised with zero-order hold; the position loop runs every second tick and stands in between.
Many noisy runs are simulated at once, and the noise-free periodic state is solved for, not waited for.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

RATE_HZ = 4000.0
JS, ML, KEFF, BS, R = 0.0028, 6.7, 5.0e5, 130.0, 0.019  # Table I at 0.8 m
KVC, TI, KPC = 0.2308, 0.2, 1.0


@dataclass(frozen=True)
class Plant:
    """Two masses (11), (12) without friction; state φ, φ', x, x'; velocity φ' out."""

    keff: float = KEFF
    bs: float = BS

    def continuous(self) -> tuple[np.ndarray, np.ndarray]:
        k, b = self.keff, self.bs
        a = np.array(
            [
                [0, 1, 0, 0],
                [-(R**2) * k / JS, -(R**2) * b / JS, R * k / JS, R * b / JS],
                [0, 0, 0, 1],
                [R * k / ML, R * b / ML, -k / ML, -b / ML],
            ]
        )
        return a, np.array([0, 1 / JS, 0, 0])

    def discrete(self) -> tuple[np.ndarray, np.ndarray]:
        a, b = self.continuous()
        block = np.zeros((5, 5))
        block[:4, :4], block[:4, 4] = a, b
        step = expm(block / RATE_HZ)
        return step[:4, :4], step[:4, 4]

    def response(self, frequency_hz: np.ndarray) -> np.ndarray:
        """Exact sampled response, zero-order hold torque to sampled velocity."""
        a, b = self.discrete()
        z = np.exp(2j * np.pi * np.asarray(frequency_hz) / RATE_HZ)
        return np.array([np.linalg.solve(zi * np.eye(4) - a, b)[1] for zi in z])


class Drive:
    """The loop, tick by tick, for many runs at once: state (runs, 6): plant, integrator, held position output."""

    def __init__(self, plant: Plant | None = None, position_loop: bool = True) -> None:
        self._a, self._b = (plant or Plant()).discrete()
        self._kpc = KPC if position_loop else 0.0
        # Every second tick is alike, and linear: what it makes of each part of a row says all of it.
        ones = np.eye(8)
        self._ticks = [np.column_stack(self.tick(ones[:, :6], ones[:, 6], ones[:, 7], n)) for n in (0, 1)]

    def tick(self, state: np.ndarray, w: float | np.ndarray, noise: np.ndarray | float, n: int) -> tuple:
        plant, integral, held = state[:, :4], state[:, 4], state[:, 5]
        y = plant[:, 1] + noise
        if n % 2 == 0:
            held = -self._kpc * plant[:, 0]
        error = held - y
        integral = integral + error / (RATE_HZ * TI)
        u = KVC * (error + integral) + w
        plant = plant @ self._a.T + np.multiply.outer(u, self._b)
        return np.column_stack([plant, integral, held]), u, y

    def settled(self, w: np.ndarray) -> np.ndarray:
        """The state at the start of a period in which excitation w (an even number of ticks) keeps repeating."""
        rows = np.zeros((7, 8))  # (state, w, noise): from rest under w, and from each part of the state alone
        rows[1:, :6] = np.eye(6)
        for n, value in enumerate(w):
            rows[0, 6], rows[1:, 6], rows[:, 7] = value, 0.0, 0.0
            rows = rows @ self._ticks[n % 2]
        return np.linalg.solve(np.eye(6) - rows[1:, :6].T, rows[0, :6])

    def run(self, w: np.ndarray, periods: int, sigma: float = 0.0, runs: int = 1, seed: int = 0) -> tuple:
        """u and y, shape (runs, periods·len(w)), from the periodic state on, with white noise sigma on y."""
        rng = np.random.default_rng(seed)
        return self.under(w, sigma * rng.standard_normal((periods * w.size, runs)))

    def under(self, w: np.ndarray, noise: np.ndarray) -> tuple:
        """The same with noise of one's own on y, shape (ticks, runs)."""
        rows = np.zeros((noise.shape[1], 8))
        rows[:, :6] = self.settled(w)
        u, y = np.empty((2, *noise.shape))
        for n in range(len(noise)):
            rows[:, 6], rows[:, 7] = w[n % w.size], noise[n]
            rows = rows @ self._ticks[n % 2]  # (state, u, y)
            u[n], y[n] = rows[:, 6], rows[:, 7]
        return u.T, y.T
