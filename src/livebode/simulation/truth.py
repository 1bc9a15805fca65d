"""Truth: real state and parameters of the machine at each sample, for tests only."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from livebode.arrays import Floats
from livebode.dataclass import dataclass
from livebode.simulation._linear import Sampled, StateSpace
from livebode.simulation.closed_loop import ClosedLoop
from livebode.simulation.faults import Condition

if TYPE_CHECKING:
    from livebode.simulation.configuration import BeltAxis


@dataclass(frozen=True, eq=False)
class Truth:
    """The true state and parameters of the samples of one Block.

    Parameters
    ----------
    axis
        The configuration.
    start
        Number of the first sample.
    states
        Angle and speed of each pulley, then position and speed of the cart, shape (states, samples).
    condition
        The machine's condition under its faults at each sample.
    """

    axis: BeltAxis
    start: int
    states: Floats
    condition: Condition

    def __len__(self) -> int:
        return int(self.states.shape[1])

    @property
    def position_m(self) -> Floats:
        """Position of the cart, m."""
        return np.asarray(self.states[-2])

    @property
    def speed_m_per_s(self) -> Floats:
        """Speed of the cart, m/s."""
        return np.asarray(self.states[-1])

    @property
    def stiffness_n_per_m(self) -> Floats:
        """Keff at each sample, at the cart's true position."""
        nominal = self.axis.mechanics.stiffness_at(self.position_m)
        return nominal * self.condition.stiffness * self.axis.weakening(self.position_m)

    @property
    def damping_n_s_per_m(self) -> Floats:
        """bs at each sample."""
        return self.axis.mechanics.damping_at(self.position_m) * self.condition.damping

    @property
    def load_kg(self) -> Floats:
        """mL at each sample."""
        return self.condition.load_kg

    @property
    def inertia_kg_m2(self) -> Floats:
        """Js at each sample."""
        return np.full(len(self), self.axis.mechanics.inertia_kg_m2)

    def linear(self, sample: int) -> StateSpace:
        """The linearisation at the machine's position and condition at one sample, torque to motor velocity."""
        return self.axis.linear(*self._place(sample))

    def sampled(self, sample: int) -> Sampled:
        """Model from the logged u to the logged velocity: with the hold, and as the sensor forms the velocity.

        A play counts as closed, on one of its sides.
        """
        plant = self.linear(sample)
        if self.axis.sensor.velocity_differenced:
            return replace(plant.out("position").sampled(self.axis.drive.rate_hz), differenced=True)
        return plant.sampled(self.axis.drive.rate_hz)

    def closed_loop(self, sample: int) -> ClosedLoop:
        """Responses in its loop: Y/W, U/W."""
        return self.axis.closed_loop(*self._place(sample))

    def _place(self, sample: int) -> tuple[float, float]:
        if not self.start <= sample < self.start + len(self):
            raise IndexError(f"sample {sample} is not one of {self.start} … {self.start + len(self) - 1}")
        return float(self.position_m[sample - self.start]), sample / self.axis.drive.rate_hz
