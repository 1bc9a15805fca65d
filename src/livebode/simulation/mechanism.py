"""A linear mechanism that several motors drive: equations of motion, exact sampling, and its truth."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Complex, Floats
from livebode.simulation.hold import held


class LinearMechanism(ABC):
    """M·q'' + C·q' + K·q = P·torques, with the speeds Q·q' as outputs; the first ones are those of the motors.

    Without dry friction and limits it is linear, and its simulation is exact.
    """

    @property
    @abstractmethod
    def matrices(self) -> tuple[Floats, Floats, Floats]:
        """M, C and K, shapes (coordinates, coordinates)."""

    @property
    @abstractmethod
    def torque_map(self) -> Floats:
        """P, shape (coordinates, motors)."""

    @property
    @abstractmethod
    def output_map(self) -> Floats:
        """Q, shape (outputs, coordinates)."""

    @property
    @abstractmethod
    def outputs(self) -> tuple[tuple[str, str], ...]:
        """Name and unit of each output."""

    @property
    def motors(self) -> int:
        """Number of motors."""
        return int(self.torque_map.shape[1])

    @property
    def state_space(self) -> tuple[Floats, Floats, Floats]:
        """A, B, C of x' = A·x + B·torques, out = C·x with x = (q, q')."""
        mass, damping, stiffness = self.matrices
        count, push, seen = len(mass), self.torque_map, self.output_map
        a = np.zeros((2 * count, 2 * count))
        a[:count, count:] = np.eye(count)
        a[count:, :count], a[count:, count:] = -np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)
        b = np.vstack([np.zeros_like(push), np.linalg.solve(mass, push)])
        return a, b, np.hstack([np.zeros_like(seen), seen])

    @property
    def modes_hz(self) -> Floats:
        """Undamped frequencies, Hz, ascending, without motions that nothing holds."""
        mass, _, stiffness = self.matrices
        squares = np.sort(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real)
        return np.asarray(np.sqrt(squares[squares > 1.0]) / (2 * np.pi))

    def sampled(self, rate_hz: float) -> tuple[Floats, Floats, Floats]:
        """A, B, C from tick to tick with torques that are constant over a tick: exact."""
        a, b, c = self.state_space
        columns = [held(a, column, 1 / rate_hz) for column in b.T]
        return columns[0][0], np.stack([column for _, column in columns], axis=1), c

    def response(self, frequency_hz: ArrayLike, rate_hz: float) -> Complex:
        """Truth: from the torques to the outputs behind the hold, shape (lines, outputs, motors)."""
        a, b, c = self.sampled(rate_hz)
        z = np.exp(2j * np.pi * np.atleast_1d(np.asarray(frequency_hz, dtype=np.float64)) / rate_hz)
        return np.asarray(c @ np.linalg.solve(z[:, None, None] * np.eye(len(a)) - a, b.astype(np.complex128)))
