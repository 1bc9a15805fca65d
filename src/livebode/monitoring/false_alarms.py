"""How often a false alarm may occur, and the threshold that observes it."""

from __future__ import annotations

from math import log

DEFAULT_INTERVAL_S = 30 * 86400.0
"""Mean time between false alarms: 30 days of judged motion."""


def threshold(mean_s: float, step_s: float, charts: int) -> float:
    """Threshold of each of `charts` CUSUMs of log-likelihood ratios with a step every `step_s`.

    Lorden (Ann. Math. Stat. 42, 1971): a CUSUM of log-likelihood ratios with threshold h has a mean time between false
    alarms of at least e^h steps, whatever the distribution; the rates of several add up at most. It is a bound: real
    false alarms are rarer, because a sum overshoots its threshold.

    >>> round(threshold(2592000.0, 0.1, 8), 1)
    19.1
    """
    return max(log(mean_s / step_s * charts), 1.0)
