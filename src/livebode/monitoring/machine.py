"""Machine: model of the healthy moving machine, with its accuracy."""

from __future__ import annotations

from dataclasses import field
from math import floor

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.dataclass import dataclass
from livebode.monitoring.accuracy import ChangeAccuracy
from livebode.monitoring.amplitude import InputAmplitude
from livebode.monitoring.between_runs import BetweenRuns
from livebode.monitoring.covariates import Covariates
from livebode.monitoring.ripple import Ripple
from livebode.motion import MovingModel

KNOWN_WINDOWS = 5
_CELLS = 28
_STILL_M = 1e-9  # a travel of zero length has one cell


@dataclass(frozen=True, eq=False)
class LearnedMachine:
    """Two masses with Keff(x), bs(x), learned from healthy runs, and statistics of their windows.

    Attributes
    ----------
    model
        As `MotionCorrection` fits it, here to all runs together.
    noise_power, quiet_power
        Mean |E|² of the unexplained velocity at each line and each detection line, (lines,), (quiet,).
    held, free
        Accuracy of a change of one direction, with all others fixed at the model, and with all others free.
    slowest_m_per_s, fastest_m_per_s
        Range of the learned speeds.
    windows
        Number of learned windows in each of 28 cells of the travel.
    information
        Mean information of a learned window for a change of each direction, with all others fixed, (4,).
    amplitude
        Of the torque at the lines.
    swing
        Largest root mean square of the velocity at the lines, relative to the speed.
    ripple
        Torque that repeats with the motor's angle.
    delay_s
        Delay of the measured velocity after the torque, beyond that of two masses behind a zero-order hold.
    covariates
        Channels that the parameters depend on, such as a temperature; the model is valid for their mean.
    between
        The direction in which the learned runs differ without a covariate that explains it; None without a difference.
    """

    model: MovingModel
    noise_power: Floats
    quiet_power: Floats
    held: ChangeAccuracy
    free: ChangeAccuracy
    slowest_m_per_s: float
    fastest_m_per_s: float
    windows: NDArray[np.int64]
    information: Floats
    amplitude: InputAmplitude
    swing: float
    ripple: Ripple = field(default_factory=Ripple)
    delay_s: float = 0.0
    covariates: Covariates = field(default_factory=Covariates)
    between: BetweenRuns | None = None

    @property
    def way_m(self) -> float:
        """Distance from the lowest to the highest learned position."""
        return self.model.high_m - self.model.low_m

    def cell(self, position_m: float) -> int:
        """Number of the cell at a position."""
        share = (position_m - self.model.low_m) / max(self.way_m, _STILL_M)
        return min(max(floor(share * _CELLS), 0), _CELLS - 1)

    def known(self, position_m: Floats) -> NDArray[np.bool_]:
        """Whether enough windows were learned there."""
        low, high = self.model.low_m, self.model.high_m
        margin = (high - low) / _CELLS / 2 + _STILL_M
        inside = (position_m >= low - margin) & (position_m <= high + margin)
        return np.asarray(inside & (self.windows[_cell(position_m, low, high)] >= KNOWN_WINDOWS))


def cells(position_m: Floats, low_m: float, high_m: float) -> NDArray[np.int64]:
    """Number of windows in each of 28 cells of the travel."""
    return np.bincount(_cell(position_m, low_m, high_m), minlength=_CELLS)


def _cell(position_m: Floats, low_m: float, high_m: float) -> NDArray[np.int64]:
    share = (position_m - low_m) / max(high_m - low_m, _STILL_M)
    return np.floor(share * _CELLS).astype(np.int64).clip(0, _CELLS - 1)
