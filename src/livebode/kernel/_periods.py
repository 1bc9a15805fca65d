"""Periods of a signal, in C: their median, their levels, and how far they are from the median."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from livebode.arrays import Floats
from livebode.kernel import _native
from livebode.kernel._instructions import chosen_instruction_set

PERIODS_MAX: Final = 128
"""Most periods whose median `typical_period` finds."""


def _set() -> int:
    """The chosen instruction set; the best one for a wrong choice, which a tracker refuses."""
    try:
        return chosen_instruction_set()
    except ValueError:
        return 0


def _rows(periods: Floats) -> Floats:
    """As the functions in C take them: also from a dtype that names the byte order, as of a .mat file."""
    return np.ascontiguousarray(periods, dtype=np.float64).view(np.float64)


class PeriodDrift(NamedTuple):
    """Straight pieces from the middle of each period to that of the next one.

    Attributes
    ----------
    position
        Of each place about the middle, in periods, shape (window,).
    middle
        The first place behind it.
    level, before, behind
        At the middle of each period, and the slopes before it and behind it, shape (periods,).
    all
        What is subtracted from all levels.
    """

    position: Floats
    middle: int
    level: Floats
    before: Floats
    behind: Floats
    all: float


def typical_period(periods: Floats) -> Floats:
    """`np.median(periods, axis=0)` of up to `PERIODS_MAX` periods, shape (periods, window), to the bit."""
    out = np.empty(periods.shape[1])
    _native.periods_typical(_rows(periods), _set(), out)
    return out


def period_levels(periods: Floats, less: Floats | None = None) -> Floats:
    """`np.median(periods - less, axis=1)`, shape (periods,), to the bit."""
    out = np.empty(len(periods))
    _native.periods_levels(_rows(periods), less, _set(), out)
    return out


def straight_periods(periods: Floats, drift: PeriodDrift) -> Floats:
    """The periods without their drift, shape (periods, window)."""
    out = np.empty(periods.shape)
    _native.periods_straighten(_rows(periods), drift, _set(), out)
    return out


def period_reach(periods: Floats, typical: Floats) -> tuple[Floats, Floats]:
    """The largest |x − typical| and |x| of each period, shapes (periods,)."""
    far, size = np.empty((2, len(periods)))
    _native.periods_reach(_rows(periods), typical, _set(), far, size)
    return far, size
