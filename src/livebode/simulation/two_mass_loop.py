"""A small exact closed loop: two masses under the cascade of Nevaranta 2016, Fig. 7, for many runs at once.

The plant is discretised with zero-order hold; the position loop runs every second tick and holds its output in between.
It shares no code with the simulated axis but its hold, which is compared with SciPy's: each verifies the other.
"""

from __future__ import annotations

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.dataclass import dataclass
from livebode.simulation.hold import held

RATE_HZ = 4000.0
JS, ML, KEFF, BS, R = 0.0028, 6.7, 5.0e5, 130.0, 0.019  # Table I at 0.8 m
KVC, TI, KPC = 0.2308, 0.2, 1.0


@dataclass(frozen=True)
class TwoMassPlant:
    """Two masses without friction, equations (11) and (12): torque in, motor velocity out.

    The state is φ, φ', x, x'.

    Parameters
    ----------
    keff
        Stiffness of the belt, N/m.
    bs
        Damping of the belt, N s/m.
    """

    keff: float = KEFF
    bs: float = BS

    def continuous(self) -> tuple[Floats, Floats]:
        """A, shape (4, 4), and b, shape (4,), of the state equation."""
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

    def discrete(self) -> tuple[Floats, Floats]:
        """A and B for one tick of 4 kHz, with zero-order hold."""
        return held(*self.continuous(), 1 / RATE_HZ)

    def response(self, frequency_hz: Floats) -> Complex:
        """Exact sampled response from held torque to sampled velocity, rad/s per N m, at each frequency."""
        a, b = self.discrete()
        z = np.exp(2j * np.pi * np.asarray(frequency_hz) / RATE_HZ)
        return np.array([np.linalg.solve(zi * np.eye(4) - a, b)[1] for zi in z])


class TwoMassLoop:
    """The loop, tick by tick, from its periodic state on, which is solved for instead of waited for.

    Parameters
    ----------
    plant
        Default: that of Table I.

    Examples
    --------
    >>> from livebode import Lines, multisine
    >>> u, y = TwoMassLoop().run(multisine(Lines.parse("20:140:20", RATE_HZ, 400)), periods=3, sigma=0.1, runs=5)
    >>> u.shape, y.shape
    ((5, 1200), (5, 1200))
    """

    def __init__(self, plant: TwoMassPlant | None = None) -> None:
        self._a, self._b = (plant or TwoMassPlant()).discrete()
        # Every second tick is the same linear map, so its effect on each part of a row describes all of it.
        ones = np.eye(8)
        self._ticks = [np.column_stack(self._tick(ones[:, :6], ones[:, 6], ones[:, 7], n)) for n in (0, 1)]

    def run(self, w: Floats, periods: int, sigma: float = 0.0, runs: int = 1, seed: int = 0) -> tuple[Floats, Floats]:
        """Torque u and velocity y, shape (runs, periods·len(w)), with white noise of `sigma` rad/s on y."""
        rng = np.random.default_rng(seed)
        return self.under(w, sigma * rng.standard_normal((periods * w.size, runs)))

    def under(self, w: Floats, noise: Floats) -> tuple[Floats, Floats]:
        """Signals with this noise on y, shape (ticks, runs). One period of w is an even number of ticks."""
        rows = np.zeros((noise.shape[1], 8))
        rows[:, :6] = self._settled(w)
        u, y = np.empty((2, *noise.shape))
        for n in range(len(noise)):
            rows[:, 6], rows[:, 7] = w[n % w.size], noise[n]
            rows = rows @ self._ticks[n % 2]  # (state, u, y)
            u[n], y[n] = rows[:, 6], rows[:, 7]
        return u.T, y.T

    def _tick(self, state: Floats, w: Floats, noise: Floats, n: int) -> tuple[Floats, Floats, Floats]:
        """State after the tick, shape (runs, 6): plant, integrator, held position output; and u and y in it."""
        plant, integral, held = state[:, :4], state[:, 4], state[:, 5]
        y = plant[:, 1] + noise
        if n % 2 == 0:
            held = -KPC * plant[:, 0]
        error = held - y
        integral = integral + error / (RATE_HZ * TI)
        u = KVC * (error + integral) + w
        plant = plant @ self._a.T + np.multiply.outer(u, self._b)
        return np.column_stack([plant, integral, held]), u, y

    def _settled(self, w: Floats) -> Floats:
        """The state at the start of a period in which w repeats."""
        rows = np.zeros((7, 8))  # (state, w, noise): from rest under w, and from each part of the state alone
        rows[1:, :6] = np.eye(6)
        for n, value in enumerate(w):
            rows[0, 6], rows[1:, 6], rows[:, 7] = value, 0.0, 0.0
            rows = rows @ self._ticks[n % 2]
        return np.asarray(np.linalg.solve(np.eye(6) - rows[1:, :6].T, rows[0, :6]), dtype=np.float64)
