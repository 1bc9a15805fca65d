"""Many machines together: which trends are not chance, and which machine is worst."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isfinite, nan

import numpy as np

from livebode.core import needing
from livebode_plant.trending.trend import Trend

with needing("SciPy", "analysis", "a trend"):
    from scipy.stats import false_discovery_control

FALSE_DISCOVERIES = 0.05
"""Expected share of unchanged machines among those that are reported as changed."""

LOGARITHMIC = ("dB",)
"""Units of which percent have no meaning."""


@dataclass(frozen=True)
class Ranked:
    """A machine's place in the ranking.

    Attributes
    ----------
    machine
        Its path.
    trend
        Of the quantity.
    significant
        Whether it is among the discoveries.
    months
        Until the limit; 0 if it is exceeded, infinite if it is not approached, NaN if percent have no meaning.
    """

    machine: str
    trend: Trend
    significant: bool
    months: float


def months_to_limit(trend: Trend, limit_percent: float, unit: str = "") -> float:
    """Months until the change is so many percent of the level; NaN where percent have no meaning."""
    if unit in LOGARITHMIC or not isfinite(trend.relative):
        return nan
    return trend.months_to(limit_percent / trend.relative)


def discoveries(p: Sequence[float]) -> list[bool]:
    """Which of these probabilities are discoveries.

    By the step-up procedure (Benjamini and Hochberg, J. R. Stat. Soc. B 57, 1995): at most 5 % of the machines that are
    reported are expected to be unchanged. This is valid for independent machines and for those with a positive
    dependence, such as a common temperature (Benjamini and Yekutieli, Ann. Stat. 29, 2001).

    >>> discoveries([0.001, 0.2, 0.03, 0.9])
    [True, False, False, False]
    """
    if not p:
        return []
    return [bool(adjusted <= FALSE_DISCOVERIES) for adjusted in false_discovery_control(np.array(p), method="bh")]


def urgency(of: Ranked) -> tuple[bool, float, float, float]:
    """The key by which machines are sorted, the worst first.

    Discoveries come first, by the months until the limit, then by the size of the change; the others follow by
    probability.
    """
    relative = of.trend.relative if isfinite(of.trend.relative) else 1 / max(of.trend.scatter, 1e-300)
    months = of.months if isfinite(of.months) else inf
    if not of.significant:
        return True, 0.0, of.trend.p, 0.0
    return False, months, -abs(of.trend.change) * relative, of.trend.p
