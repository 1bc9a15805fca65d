"""Machine: the healthy machine as a model that moves, and how well it is known."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from livebode.monitoring.accuracy import Accuracy
from livebode.monitoring.between_runs import BetweenRuns
from livebode.monitoring.covariates import Covariates
from livebode.monitoring.ripple import Ripple
from livebode.motion import MovingModel

Floats = NDArray[np.float64]

_KNOWN_WINDOWS = 5
_CELLS = 28
_STILL_M = 1e-9  # a way of no length has one cell


@dataclass(frozen=True, eq=False)
class Machine:
    """Two masses with Keff(x), bs(x), learned from healthy runs, and what their windows looked like.

    Attributes
    ----------
    model
        As `MotionCorrection` fits it, here to all runs together.
    noise_power, quiet_power
        Mean |E|² of the unexplained velocity at each line and each quiet bin, (lines,), (quiet,).
    held, free
        How well a change of one direction is known with all others held at the model, and with all others free.
    slowest_m_per_s, fastest_m_per_s
        Speeds that were learned.
    windows
        How many windows were learned in each of 28 cells of the way.
    ripple
        Torque that repeats with the motor's angle, as it was found.
    delay_s
        Of the measured velocity behind the torque, beyond what two masses behind a zero-order hold have.
    covariates
        What the parameters depend on, such as a temperature; the model is that of their mean.
    between
        The direction in which the learned runs differ, which no covariate explains; None where they do not.
    """

    model: MovingModel
    noise_power: Floats
    quiet_power: Floats
    held: Accuracy
    free: Accuracy
    slowest_m_per_s: float
    fastest_m_per_s: float
    windows: NDArray[np.int64]
    ripple: Ripple = field(default_factory=Ripple)
    delay_s: float = 0.0
    covariates: Covariates = field(default_factory=Covariates)
    between: BetweenRuns | None = None

    @property
    def way_m(self) -> float:
        """From the lowest to the highest position that was learned."""
        return self.model.high_m - self.model.low_m

    def cell(self, position_m: float) -> int:
        """Number of the cell there."""
        return int(_cell(np.array([position_m]), self.model.low_m, self.model.high_m)[0])

    def known(self, position_m: Floats) -> NDArray[np.bool_]:
        """Whether enough windows were learned there."""
        low, high = self.model.low_m, self.model.high_m
        margin = (high - low) / _CELLS / 2 + _STILL_M
        inside = (position_m >= low - margin) & (position_m <= high + margin)
        return np.asarray(inside & (self.windows[_cell(position_m, low, high)] >= _KNOWN_WINDOWS))


def cells(position_m: Floats, low_m: float, high_m: float) -> NDArray[np.int64]:
    """Number of windows in each of 28 cells of the way."""
    return np.bincount(_cell(position_m, low_m, high_m), minlength=_CELLS)


def _cell(position_m: Floats, low_m: float, high_m: float) -> NDArray[np.int64]:
    share = (position_m - low_m) / max(high_m - low_m, _STILL_M)
    return np.floor(share * _CELLS).astype(np.int64).clip(0, _CELLS - 1)
