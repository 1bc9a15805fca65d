"""Machine: the healthy machine as a model that moves, and how well it is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from livebode.motion import MovingModel

Floats = NDArray[np.float64]

_KNOWN_WINDOWS = 5
_CELL_M = 0.05


@dataclass(frozen=True, eq=False)
class Accuracy:
    """Of a change of each direction, as healthy motion shows it, each of shape (4,).

    Attributes
    ----------
    inflation
        Variance of the mean over neighbouring windows, against what independent windows would have; at least 1.
    scatter
        Standard deviation of a change that was not there, over stretches of healthy motion: what speeds, directions
        and friction leave that the model does not know.
    smallest
        The smallest change that an alarm is for, of the logarithm.
    """

    inflation: Floats
    scatter: Floats
    smallest: Floats

    @property
    def allowed(self) -> Floats:
        """How far a healthy machine may lie off the model."""
        return 2 * self.scatter


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
        How many windows were learned in each cell of 5 cm from the model's lowest position on.
    """

    model: MovingModel
    noise_power: Floats
    quiet_power: Floats
    held: Accuracy
    free: Accuracy
    slowest_m_per_s: float
    fastest_m_per_s: float
    windows: NDArray[np.int64]

    def cell(self, position_m: float) -> int:
        """Number of the cell of 5 cm there."""
        return int(np.floor((position_m - self.model.low_m) / _CELL_M))

    def known(self, position_m: Floats) -> NDArray[np.bool_]:
        """Whether enough windows were learned there."""
        cell = np.floor((position_m - self.model.low_m) / _CELL_M).astype(int)
        inside = (cell >= 0) & (cell < len(self.windows))
        return np.asarray(inside & (self.windows[cell.clip(0, len(self.windows) - 1)] >= _KNOWN_WINDOWS))


def cells(position_m: Floats, low_m: float, high_m: float) -> NDArray[np.int64]:
    """Number of windows in each cell of 5 cm."""
    number = int(np.ceil((high_m - low_m) / _CELL_M + 1e-9)) + 1
    return np.bincount(np.floor((position_m - low_m) / _CELL_M).astype(int).clip(0, number - 1), minlength=number)
