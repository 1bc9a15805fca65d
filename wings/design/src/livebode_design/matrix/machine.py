"""The machine of a design, and the limits of all its axes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import Annotated

import numpy as np
from annotated_types import Gt
from numpy.typing import ArrayLike

from livebode.arrays import Complex, Floats
from livebode.core import MatrixLoop, UsageError
from livebode.dataclass import dataclass
from livebode.excitation import MatrixExcitation

_Positive = Annotated[float, Gt(0)]
_Each = _Positive | Sequence[_Positive]


@dataclass(frozen=True, kw_only=True)
class MatrixLimits:
    """Limits of all axes at once, of the magnitude; one for all, or one for each motor or output. Default: none.

    Parameters
    ----------
    torque_n_m_max
        Of each motor, N m.
    current_a_max
        Of each motor, A; needs the torque constants.
    speed_max
        Of each output, in its unit.
    travel_max
        Of each output integrated over time from the place of rest, in its unit times s: rad, m.
    """

    torque_n_m_max: _Each | None = None
    current_a_max: _Each | None = None
    speed_max: _Each | None = None
    travel_max: _Each | None = None


@dataclass(frozen=True)
class LimitedPeak:
    """The largest magnitude of a signal over all experiments, with the transients between them, and its limit."""

    name: str
    unit: str
    size: float
    limit: float


class MatrixMachine(ABC):
    """What a design needs of a machine with several motors: the plant in its loop, the noise and the signals."""

    torque_constant_n_m_per_a: float | Sequence[float] | None

    @property
    @abstractmethod
    def rate_hz(self) -> float:
        """Rate of the recording."""

    @property
    @abstractmethod
    def inputs(self) -> tuple[str, ...]:
        """Names of the plant inputs."""

    @property
    @abstractmethod
    def excitations(self) -> tuple[str, ...]:
        """Names of the excitations, one for each input."""

    @property
    @abstractmethod
    def outputs(self) -> tuple[tuple[str, str], ...]:
        """Names and units."""

    @property
    @abstractmethod
    def described(self) -> MatrixLoop:
        """The controllers."""

    @abstractmethod
    def response(self, frequency_hz: ArrayLike) -> Complex:
        """Response of the plant, shape (lines, outputs, inputs)."""

    @abstractmethod
    def deviation(self, frequency_hz: ArrayLike) -> Floats:
        """Standard deviation of the noise, as if it were white, shape (lines, outputs)."""

    @abstractmethod
    def settle_periods(self, excitation: MatrixExcitation, below: Floats) -> int:
        """Periods until the transient of a change of experiment is below these magnitudes of the outputs."""

    @property
    @abstractmethod
    def settle_reason(self) -> str:
        """Why they are so many."""

    @property
    @abstractmethod
    def peaks_include(self) -> str:
        """What the peaks include, in words."""

    @abstractmethod
    def unit_rows(self, excitation: MatrixExcitation) -> Floats:
        """Torques, outputs and travels for each input's excitation alone, (signals, samples, inputs)."""

    def check(self, limits: MatrixLimits) -> None:
        """UsageError for limits that do not fit the machine, or if there are none."""
        if not list(self._limited(limits)):
            raise UsageError(
                "missing",
                "there are no limits, so that no amplitude can be chosen",
                "give torque_n_m_max, current_a_max, speed_max or travel_max",
                argument="torque_n_m_max",
            )

    def unit_signals(self, excitation: MatrixExcitation, limits: MatrixLimits) -> tuple[Floats, list[LimitedPeak]]:
        """The limited signals as a share of their limits, shape (signals, samples, inputs), with names and limits.

        The last axis has the part of each input's excitation alone: the loop is linear.
        """
        rows = self.unit_rows(excitation)
        limited = list(self._limited(limits))
        shares = np.stack([rows[row] / limit for _, _, row, limit in limited])
        return shares, [LimitedPeak(name, unit, 0.0, limit) for name, unit, _, limit in limited]

    def _limited(self, limits: MatrixLimits) -> Iterator[tuple[str, str, int, float]]:
        """Name, unit, row among torques, outputs and travels, and limit."""
        motors, outputs = len(self.inputs), len(self.outputs)
        torque = np.full(motors, np.inf)
        names = [f"torque of motor {i + 1}" for i in range(motors)]
        if limits.torque_n_m_max is not None:
            torque = each_of(limits.torque_n_m_max, motors, "torque_n_m_max", "motor")
        if limits.current_a_max is not None:
            allowed = self._constant() * each_of(limits.current_a_max, motors, "current_a_max", "motor")
            for i in np.flatnonzero(allowed < torque).tolist():
                names[i] = f"torque of motor {i + 1}, by its current"
            torque = np.minimum(torque, allowed)
        for i in range(motors):
            if np.isfinite(torque[i]):
                yield names[i], "N m", i, float(torque[i])
        for given, name, word, first in (
            (limits.speed_max, "speed_max", "speed", motors),
            (limits.travel_max, "travel_max", "travel", motors + outputs),
        ):
            if given is not None:
                for o, limit in enumerate(each_of(given, outputs, name, "output")):
                    channel, unit = self.outputs[o]
                    shown = unit if word == "speed" else unit.removesuffix("/s")
                    yield f"{word} of {channel}", shown, first + o, float(limit)

    def _constant(self) -> Floats:
        if self.torque_constant_n_m_per_a is None:
            raise UsageError(
                "missing",
                "current_a_max limits the current, but the torque constants are missing",
                "give torque_constant_n_m_per_a, or torque_n_m_max instead",
                argument="torque_constant_n_m_per_a",
            )
        return each_of(self.torque_constant_n_m_per_a, len(self.inputs), "torque_constant_n_m_per_a", "motor")


def each_of(value: float | Sequence[float], count: int, name: str, whose: str) -> Floats:
    """One value above 0 for each, shape (count,); UsageError where they are not."""
    given = np.asarray(value, dtype=np.float64)
    if given.shape not in ((), (count,)):
        raise UsageError(
            "wrong-shape",
            f"{name} has {given.size} values for {count} {whose}s",
            f"give one, or one for each {whose}",
            argument=name,
            shape=list(given.shape),
        )
    if not np.all(np.isfinite(given) & (given > 0)):
        raise UsageError(
            "out-of-range",
            f"{name}={value} is not finite and above 0",
            "correct it",
            argument=name,
            value=value,
        )
    return np.broadcast_to(given, (count,))
