"""A machine that is described by its modes, with the shape of each at the motors and at the outputs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from livebode.arrays import Floats
from livebode.core import UsageError
from livebode.dataclass import dataclass
from livebode.simulation.mechanism import LinearMechanism
from livebode.simulation.motor_loop import MotorLoop


@dataclass(frozen=True, kw_only=True)
class ModalMachine(LinearMechanism):
    """q'' + 2ζω·q' + ω²·q = Σ input·torque for each mode, and speeds of the outputs Σ output·q'.

    Parameters
    ----------
    names, units
        Of the outputs; the first ones are the speeds of the motors.
    frequency_hz, damping
        ω/2π and ζ of each mode; frequency 0 is a motion as a whole, whose `damping` is a rate in 1/s.
    input_shapes, output_shapes
        Of each mode, shapes (modes, motors) and (modes, outputs).

    Raises
    ------
    UsageError
        If the numbers of modes, motors, outputs and units do not fit each other, or a value is not finite or negative.

    Examples
    --------
    >>> ModalMachine(
    ...     names=("v1",), units=("rad/s",), frequency_hz=(0.0, 40.0), damping=(0.1, 0.02),
    ...     input_shapes=((1.0,), (0.5,)), output_shapes=((1.0,), (0.5,)),
    ... ).modes_hz
    array([40.])
    """

    names: Sequence[str]
    units: Sequence[str]
    frequency_hz: Sequence[float]
    damping: Sequence[float]
    input_shapes: Sequence[Sequence[float]]
    output_shapes: Sequence[Sequence[float]]

    def __post_init__(self) -> None:
        modes = len(self.frequency_hz)
        rows = {len(row) for row in self.input_shapes}, {len(row) for row in self.output_shapes}
        fits = len(self.damping) == len(self.input_shapes) == len(self.output_shapes) == modes > 0
        if not fits or len(self.units) != len(self.names) or len(rows[0]) != 1 or rows[1] != {len(self.names)}:
            raise UsageError(
                "wrong-shape",
                f"{modes} modes with {len(self.damping)} dampings, shapes of {sorted(rows[0])} inputs and of "
                f"{sorted(rows[1])} outputs do not fit {len(self.names)} outputs with {len(self.units)} units",
                "give each mode one value for each motor, and one for each output",
                argument="output_shapes",
            )
        if not 1 <= min(rows[0]) <= len(self.names):
            raise UsageError(
                "wrong-shape",
                f"there are {min(rows[0])} motors, but {len(self.names)} outputs",
                "list the speed of each motor first",
                argument="input_shapes",
            )
        for name in ("frequency_hz", "damping", "input_shapes", "output_shapes"):
            given = np.asarray(getattr(self, name), dtype=np.float64)
            if not np.all(np.isfinite(given)) or ("shapes" not in name and np.any(given < 0)):
                raise UsageError(
                    "out-of-range",
                    f"{name}={getattr(self, name)!r} of the modes is not finite or negative",
                    "correct it",
                    argument=name,
                )

    @property
    def matrices(self) -> tuple[Floats, Floats, Floats]:
        """Mass, damping and stiffness matrix of the modes."""
        omega, zeta = 2 * np.pi * np.asarray(self.frequency_hz), np.asarray(self.damping, dtype=np.float64)
        return np.eye(len(omega)), np.diag(np.where(omega > 0, 2 * zeta * omega, zeta)), np.diag(omega**2)

    @property
    def torque_map(self) -> Floats:
        """The shapes at the motors."""
        return np.asarray(self.input_shapes, dtype=np.float64)

    @property
    def output_map(self) -> Floats:
        """The shapes at the outputs."""
        return np.asarray(self.output_shapes, dtype=np.float64).T

    @property
    def outputs(self) -> tuple[tuple[str, str], ...]:
        """Their names and units."""
        return tuple(zip(self.names, self.units))


@dataclass(frozen=True, kw_only=True)
class ModalLoop(MotorLoop):
    """A machine of modes under a PI velocity controller for each motor."""

    machine: ModalMachine

    @property
    def mechanism(self) -> ModalMachine:
        """The machine."""
        return self.machine
