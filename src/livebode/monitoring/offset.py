"""Offset: the assumed distance of the machine from the baseline, so that the residual remains small."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from livebode.arrays import Floats

FAR = 0.2
"""Difference of a logarithm: beyond it, it may be another machine, with differences that are not identified."""


@dataclass(frozen=True)
class LocalChange:
    """A bell-shaped change of ln Keff: its centre and standard deviation, m, and its depth."""

    centre_m: float
    width_m: float
    amount: float = 1.0

    def share(self, position_m: Floats) -> Floats:
        """Share of the change at these positions, 0 … 1.

        >>> LocalChange(1.0, 0.05).share(np.array([1.0, 1.05])).round(3)
        array([1.   , 0.607])
        """
        return np.asarray(np.exp(-(((position_m - self.centre_m) / self.width_m) ** 2) / 2))


@dataclass(frozen=True, eq=False)
class Offset:
    """Active changes: of the logarithms of stiffness, load, damping, inertia, (4,), and of places."""

    logarithms: Floats = field(default_factory=lambda: np.zeros(4))
    places: tuple[LocalChange, ...] = ()

    def stiffness(self, position_m: Floats) -> Floats:
        """Change of ln Keff at these positions."""
        local = [place.amount * place.share(position_m) for place in self.places]
        return np.asarray(self.logarithms[0] + np.sum(local, axis=0) * np.ones(position_m.shape))
