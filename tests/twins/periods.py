"""What native/src/periods.c computes, by NumPy."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats
from livebode.kernel import PeriodDrift


def typical_period(periods: Floats) -> Floats:
    return np.asarray(np.median(periods, axis=0))


def period_levels(periods: Floats, less: Floats) -> Floats:
    return np.asarray(np.median(periods - less, axis=1))


def straight_periods(periods: Floats, drift: PeriodDrift) -> Floats:
    slopes = np.where(
        np.arange(periods.shape[1]) < drift.middle, drift.before[:, np.newaxis], drift.behind[:, np.newaxis]
    )
    return np.asarray(periods - (slopes * drift.position + drift.level[:, np.newaxis]) - drift.all)


def period_reach(periods: Floats, typical: Floats) -> tuple[Floats, Floats]:
    return np.max(np.abs(periods - typical), axis=1), np.max(np.abs(periods), axis=1)
