"""MainQuantity: the one quantity of an axis that a page of many axes has room for."""

from __future__ import annotations

from collections.abc import Sequence
from math import nan

import numpy as np

from livebode.core import Parameters
from livebode.dataclass import dataclass
from livebode.runtime import ChangeDetection

STIFFNESS = ("N/m", "N m/rad")
"""Units of what a page shows first: a machine that wears gets softer."""


@dataclass(frozen=True)
class MainQuantity:
    """A quantity with its 95 % bound, and its change from the baseline in percent, NaN if that is not known."""

    name: str
    unit: str
    value: float
    bound: float
    change_percent: float


def main_quantity(parts: Sequence[Parameters], watched: Sequence[str]) -> str:
    """Name of the quantity: what the baseline watches first, else a stiffness, else a resonance, else the first one."""
    fits, derived = parts[0], parts[1]
    stiff = (name for name, unit in zip(fits.names, fits.units) if unit in STIFFNESS)
    resonances = (name for name in derived.names if name.startswith("resonance"))
    candidates = [*(name for name in watched if name in fits.names), *stiff, *resonances, *fits.names]
    return candidates[0]


def newest_of(parts: Sequence[Parameters], name: str, detection: ChangeDetection | None) -> MainQuantity | None:
    """Newest valid value of the quantity; None if none of these rows is valid."""
    part = parts[0] if name in parts[0].names else parts[1]
    valid = np.flatnonzero(part.ok)
    if not valid.size:
        return None
    row, column = valid[-1], part.index(name)
    change = nan if detection is None else 100 * detection.deviation(name)
    bound = float(part[valid[-1:]].bound()[0, column])
    return MainQuantity(name, part.units[column], float(part.value[row, column]), bound, change)
