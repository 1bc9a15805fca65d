"""How much louder the noise has become, from rows alone: a change of the machine is not noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_ROWS = 5
_MEDIAN = 0.4549364  # of chi square with one degree of freedom
_BELIEVED = 2.0  # times what the differences show beyond the learned noise


class NoiseLevel:
    """Bounds what rows say of their own noise by how much neighbouring rows differ.

    A response's sigma comes from how periods scatter. For some periods after a step of the machine the step is in it,
    so that rows behind the step would weigh a hundredth of those before it. A step moves one difference of neighbouring
    rows; noise moves all of them. The median over the newest five rows and all components of a line shows the second
    alone. A row's noise beyond the learned one counts up to twice what that median shows.

    Parameters
    ----------
    components
        Columns of a deviation.
    together
        Components of one line: 2, or 1 for a parameter.
    """

    def __init__(self, components: int, together: int) -> None:
        self._together = together
        self._before = np.full((2, components), np.nan)
        self._squares = np.full((0, components), np.nan)

    def step(self, deviation: Floats, own: Floats, more: Floats) -> Floats:
        """Variance of a row from its deviation, the learned variance and what it says beyond, (components,) each."""
        here = np.stack([np.where(np.isfinite(own), deviation, np.nan), np.where(np.isfinite(own), own, np.nan)])
        square = (here[0] - self._before[0]) ** 2 / (here[1] + self._before[1])
        self._before = here
        self._squares = np.vstack([self._squares, square])[-_ROWS:]
        of_line = self._squares.reshape(len(self._squares), -1, self._together)
        level = np.ones(of_line.shape[1])
        seen = np.isfinite(of_line).any(axis=(0, 2))
        level[seen] = np.nanmedian(of_line[:, seen], axis=(0, 2)) / _MEDIAN
        shown = np.repeat(np.maximum(level - 1.0, 0.0), self._together)
        return np.asarray(own + np.minimum(more, _BELIEVED * shown * np.where(np.isfinite(own), own, 0.0)))

    def state(self) -> dict[str, NDArray[np.generic]]:
        return {"level before": self._before.copy(), "level squares": self._squares.copy()}

    def load(self, state: dict[str, NDArray[np.generic]]) -> None:
        self._before = np.array(state["level before"], dtype=np.float64)
        self._squares = np.array(state["level squares"], dtype=np.float64)
