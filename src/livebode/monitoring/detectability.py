"""Detectability: the change that so much information shows, and the information that a change needs."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats
from livebode.core import normal_quantile
from livebode.monitoring.accuracy import ChangeAccuracy

WINDOWS = 600
"""Windows within which a change must show: a change is named as the likeliest one after so many."""
FOUND = 0.95
"""Probability with which the chart of a change reaches the threshold."""

_COARSER = 2.0  # than what the learned runs, or an alarm, allow: from there on a component is not monitored


def detectable(information: Floats, accuracy: ChangeAccuracy, threshold: float) -> Floats:
    """Change of each logarithm that raises an alarm with a probability of 95 %, (components,); infinite without any.

    A chart sums g·(s − I·m), with g = smallest − allowed and m = (smallest + allowed)/2. After windows with the
    information J = ΣI under a change δ, the sum is normal, with the mean g·J·(δ − m) and the variance g²·J; it exceeds
    the threshold h with 95 % if δ = m + h/(g·J) + 1.64/√J. A change is reported from the smallest one on.

    Parameters
    ----------
    information
        Total of the windows, (components,).
    accuracy
        Of the healthy machine.
    threshold
        Of the charts.
    """
    gain, middle, quantile = _chart(accuracy)
    with np.errstate(divide="ignore", invalid="ignore"):
        known = information / accuracy.inflation
        change = middle + threshold / (gain * known) + quantile / np.sqrt(known)
    return np.where(known > 0, np.maximum(change, accuracy.smallest), np.inf)


def information_for(change: Floats, accuracy: ChangeAccuracy, threshold: float) -> Floats:
    """Total information from which on `detectable` is at most this change, (components,)."""
    gain, middle, quantile = _chart(accuracy)
    beyond = change - middle
    root = (quantile + np.sqrt(quantile**2 + 4 * beyond * threshold / gain)) / (2 * beyond)
    return np.asarray(root**2 * accuracy.inflation)


def information_needed(learned: Floats, accuracy: ChangeAccuracy, threshold: float) -> Floats:
    """Information in `WINDOWS` windows below which a component is not monitored, (components,).

    With it, a change is found that is twice the smallest one, or twice what windows as learned allow to find.

    Parameters
    ----------
    learned
        Mean information of a learned window, (components,).
    accuracy, threshold
        As for `detectable`.
    """
    finest = detectable(WINDOWS * learned, accuracy, threshold)
    known = np.isfinite(finest)
    change = np.where(known, _COARSER * finest, 1.0)
    return np.where(known, information_for(change, accuracy, threshold), np.inf)


def _chart(accuracy: ChangeAccuracy) -> tuple[Floats, Floats, float]:
    gain, middle = accuracy.smallest - accuracy.allowed, (accuracy.smallest + accuracy.allowed) / 2
    return gain, middle, normal_quantile(FOUND)
