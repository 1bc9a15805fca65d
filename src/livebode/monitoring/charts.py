"""Many two-sided CUSUMs at once: the sequential test for every kind of evidence, and its threshold, which observes how
often a false alarm may occur.
"""

from __future__ import annotations

from math import isfinite, log

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Stage, StatefulBase

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


UP, DOWN = 0, 1
_NOT_A_NUMBER = "score or information of a judged component is not a number"


class Charts(StatefulBase):
    """Page's CUSUM of log-likelihood ratios, one up and one down for each component.

    A step gives for a component the score s and the information I of its change δ: for small δ the log-likelihood of
    the samples is δ·s − δ²·I/2, so that s/I estimates δ with the variance 1/I. A healthy machine may differ by
    `allowed` from the baseline, which was learned from finite data; a change is at least `smallest`. The ratio of the
    two is

        (smallest − allowed)·(±s − I·(smallest + allowed)/2),

    its sum is limited to 0 … `threshold`, so that the end of a change is detected as fast as its beginning.

    Parameters
    ----------
    smallest, allowed
        Of each component, shape (components,).
    threshold
        h, in nats; see `false_alarms.threshold`.

    Examples
    --------
    >>> charts = Charts(np.array([0.02]), np.array([0.0]), threshold=10.0)
    >>> for window in range(4):
    ...     charts.step(np.array([300.0]), np.array([1e4]), window)
    >>> charts.sums.round(1)
    array([[10.],
           [ 0.]])
    """

    _stage = Stage("charts", 1)
    _STATE = ("sums", "since")

    def __init__(self, smallest: Floats, allowed: Floats, threshold: float) -> None:
        self.threshold = threshold
        self.sums = np.zeros((2, smallest.size))
        """Sums of every component, up and down, shape (2, components)."""
        self.since = np.full((2, smallest.size), -1)
        """Mark of the step at which each sum last left zero: the beginning of the change, if there is one."""
        self._gain = smallest - allowed
        self._cost = self._gain * ((smallest + allowed) / 2)

    def step(self, score: Floats, information: Floats, mark: int, judged: NDArray[np.bool_] | None = None) -> None:
        """Process a step's evidence, shape (components,) each; components that are not `judged` do not change."""
        ratio = np.empty(self.sums.shape)
        np.multiply(self._gain, score, out=ratio[UP])
        np.negative(ratio[UP], out=ratio[DOWN])
        ratio -= self._cost * information
        if judged is not None:
            ratio = np.where(judged, ratio, 0.0)
        if np.isnan(ratio).any():  # NaN would remain in the sums, which would never reach the threshold again
            raise ValueError(_NOT_A_NUMBER)
        self.since[(self.sums == 0) & (ratio > 0)] = mark
        sums = self.sums + ratio
        np.maximum(sums, 0.0, out=sums)
        self.sums = np.minimum(sums, self.threshold, out=sums)

    def step_one(self, component: int, score: float, information: float, mark: int) -> None:
        """`step` with the evidence of one component; the others have none."""
        if not (isfinite(score) and isfinite(information)):
            raise ValueError(_NOT_A_NUMBER)
        gained, cost = float(self._gain[component]) * score, float(self._cost[component]) * information
        for way, ratio in ((UP, gained - cost), (DOWN, -gained - cost)):
            before = float(self.sums[way, component])
            if before == 0 and ratio > 0:
                self.since[way, component] = mark
            self.sums[way, component] = min(max(before + ratio, 0.0), self.threshold)

    @property
    def alarmed(self) -> bool:
        """Whether any has reached the threshold."""
        return bool(self.sums.max() >= self.threshold)

    @property
    def raised(self) -> NDArray[np.bool_]:
        """Which have reached the threshold, shape (2, components)."""
        return np.asarray(self.sums >= self.threshold)

    def reset(self) -> None:
        self.sums[:] = 0.0
