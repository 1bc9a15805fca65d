"""The linear loop tick by tick: its stability, and its exact sampled responses, each controller at its own rate."""

from __future__ import annotations

from dataclasses import field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Complex, Floats
from livebode.core import Algebra
from livebode.dataclass import dataclass
from livebode.simulation._linear import StateSpace
from livebode.simulation.axis_settings import Drive, Sensor


@dataclass(frozen=True, eq=False)
class ClosedLoop:
    """A linear plant (with motor angle and velocity as its first two states) under a Drive, without limit and rounding.

    The loop is periodic: its period is the number of ticks for which one position output is held.

    Examples
    --------
    >>> from livebode.simulation._linear import linear
    >>> from livebode.simulation.mechanics import Mechanics, Spans
    >>> from livebode.simulation.axis_settings import Friction
    >>> belt = Mechanics()
    >>> loop = ClosedLoop(linear(belt, Friction(), Spans.of(belt, 0.8), belt.load_kg), Drive())
    >>> loop.spectral_radius < 1
    True
    """

    plant: StateSpace
    drive: Drive
    sensor: Sensor = field(default_factory=Sensor)

    @property
    def spectral_radius(self) -> float:
        """Largest size of an eigenvalue over one repetition; the loop is stable below 1."""
        whole = np.eye(self._size)
        for matrix, _, _ in self._ticks:
            whole = matrix @ whole
        return float(np.max(np.abs(np.linalg.eigvals(whole))))

    def responses(self, frequency_hz: ArrayLike) -> tuple[Complex, Complex]:
        """Y/W and U/W, each the shape of `frequency_hz`: the result of a DFT over whole repetitions at a line.

        The images of a line due to the slower loops (at multiples of their rates from it) are not included, as in the
        DFT at the line.
        """
        f = np.asarray(frequency_hz, dtype=np.float64)
        pairs = np.array([self._at(z) for z in np.exp(2j * np.pi * f.ravel() / self.drive.rate_hz)])
        y, u = pairs.reshape(-1, 2).T
        return y.reshape(f.shape), u.reshape(f.shape)

    @property
    def output(self) -> ClosedLoopResponse:
        """Y/W as a Model."""
        return ClosedLoopResponse(self, 0)

    @property
    def input(self) -> ClosedLoopResponse:
        """U/W as a Model."""
        return ClosedLoopResponse(self, 1)

    def _at(self, z: complex) -> Complex:
        # s(0) solves z^P·s(0) = Φ·s(0) + γ for the input w(n) = z^n over a repetition of P ticks.
        whole, forced = np.eye(self._size, dtype=complex), np.zeros(self._size, dtype=complex)
        for n, (matrix, entry, _) in enumerate(self._ticks):
            whole, forced = matrix @ whole, matrix @ forced + entry * z**n
        state = np.linalg.solve(z ** len(self._ticks) * np.eye(self._size) - whole, forced)
        share = np.zeros(2, dtype=np.complex128)
        for n, (matrix, entry, rows) in enumerate(self._ticks):
            share += rows @ np.append(state, z**n) / z**n
            state = matrix @ state + entry * z**n
        return np.asarray(share / len(self._ticks), dtype=np.complex128)

    @property
    def _size(self) -> int:
        return len(self.plant.b) + 4 + self.drive.delay_ticks

    @cached_property
    def _ticks(self) -> list[tuple[Floats, Floats, Floats]]:
        """For each tick of a repetition: state to state, w to state, and (y, u) from (state, w)."""
        unit = np.eye(self._size + 1)  # columns: one for each state alone, the last for w alone
        ticks = []
        for n in range(self.drive.position_ticks):
            state, rows = self._tick(unit[:-1], unit[-1], n)
            ticks.append((state[:, :-1], state[:, -1], rows))
        return ticks

    def _tick(self, state: Floats, w: Floats, n: int) -> tuple[Floats, Floats]:
        """One tick of many states at once, shape (size, columns)."""
        drive, size = self.drive, len(self.plant.b)
        discrete = self.plant.sampled(drive.rate_hz)
        plant, (integral, held, control, before), line = state[:size], state[size : size + 4], state[size + 4 :]
        y = (plant[0] - before) * drive.rate_hz if self.sensor.velocity_differenced else plant[1]
        if n % drive.position_ticks == 0:
            held = -drive.position_gain_per_s * plant[0]
        if n % drive.velocity_ticks == 0:
            integral = integral + (held - y) / (drive.velocity_rate_hz * drive.integral_time_s)
            control = drive.velocity_gain_n_m_s * (held - y + integral)
        line = np.vstack([line, control])
        u = line[0] + w
        after = discrete.a @ plant + np.outer(discrete.b, u)
        return np.vstack([after, integral, held, control, plant[0], line[1:]]), np.vstack([y, u])


@dataclass(frozen=True, eq=False)
class ClosedLoopResponse(Algebra):
    """One of a ClosedLoop's two responses."""

    loop: ClosedLoop
    which: int

    def response(self, frequency_hz: ArrayLike) -> Complex:
        return self.loop.responses(frequency_hz)[self.which]
