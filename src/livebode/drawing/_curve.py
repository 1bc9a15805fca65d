"""Curve and Cloud: what is drawn on axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.drawing._curves import unwrapped


@dataclass(frozen=True, eq=False)
class Curve:
    """A complex value at each frequency, with a circle around it.

    Attributes
    ----------
    frequency_hz
        (lines,), ascending.
    value
        (lines,); NaN where nothing is drawn.
    radius
        Of the circle that is the bound, unit of `value`; NaN where none is known.
    label, bound_label
        In a legend; an empty `bound_label` draws no bound.
    color
        Any colour of Matplotlib; None for the next of the axes.
    """

    frequency_hz: Floats
    value: Complex
    radius: Floats
    label: str
    bound_label: str
    color: Any = None

    @property
    def bounded(self) -> bool:
        """Whether there is a bound to draw."""
        return bool(self.bound_label) and bool(np.isfinite(self.radius).any())

    @property
    def phase_deg(self) -> Floats:
        """Unwrapped along frequency; lines whose bound contains zero follow the others, (lines,)."""
        return unwrapped(np.degrees(np.angle(self.value)), self.radius > np.abs(self.value))


@dataclass(frozen=True, eq=False)
class Cloud:
    """Values of the other responses behind a Curve, (rows, lines); NaN where nothing is drawn."""

    value: Complex

    @property
    def label(self) -> str:
        """In the legend of a Bode plot."""
        return f"5–95 % of {len(self.value)} responses"
