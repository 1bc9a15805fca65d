"""Whether a machine drifts during a record: a trend of the response at a line that noise does not explain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy  # its parts are loaded when they are first used
from numpy.typing import NDArray

from livebode.core import Lines, Responses, Stage, StatefulBase

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]
Flags = NDArray[np.bool_]

FALSE_ALARM = 0.01
"""Probability that a record of a machine that does not drift is reported, all lines together."""
_GROUPS_MAX = 32
_GROUPS_MIN = 6
# A trend is at most so far from its middle for the share 1 - 1/e of the record, as noise from its mean within sigma.
_WITHIN_SIGMA = 1 - np.exp(-1)


@dataclass(frozen=True, eq=False)
class Drift:
    """Trend of the response over a record; shapes (lines,).

    Attributes
    ----------
    found
        Whether the machine drifts: all lines together, at `FALSE_ALARM`.
    lines
        Lines whose own trend is significant.
    value
        Mean over the record.
    change, sigma
        Change of the response from the beginning to the end of the record and its standard deviation, unit of the
        response; NaN at lines with fewer than six groups of windows.
    spread
        Part of the standard deviation of a mean over the record that the trend adds: the mean then covers the response
        at a random moment of the record as often as noise; 0 unless `found`.
    """

    found: bool
    lines: Flags
    value: Complex
    change: Complex
    sigma: Floats
    spread: Floats


class DriftTest(StatefulBase):
    """Tests responses, in order, for a trend.

    Windows that do not overlap are averaged in up to 32 groups of equal length. At each line a parabola over time is
    fitted to the groups (with a slope over the schedule, where it varies), for the change as its straight part, and for
    the largest distance from the mean. Without drift, the power of the straight part over that of the residuals is
    F(2, 2d), with d the number of groups less that of the parameters, so that its probability is (1 + F/d)^-d. A record
    drifts if one line has less than half of `FALSE_ALARM` after Bonferroni, or all lines together have by Fisher's
    method.

    Parameters
    ----------
    lines
        Lines of the responses.

    Notes
    -----
    A drift that returns to its beginning has no trend. Slow noise, longer than a group, can be taken for drift.
    """

    _stage = Stage("drift-test", 1)
    _STATE = ("_windows", "_free", "_level", "_moments", "_pairs")

    def __init__(self, lines: Lines) -> None:
        self._window, n = lines.window, len(lines)
        self._windows, self._free, self._level = 0, 0, 0
        self._moments = np.zeros((2, _GROUPS_MAX, n))  # sums of time and schedule over the valid windows
        self._pairs = np.zeros((3, _GROUPS_MAX, n), dtype=np.complex128)  # number, sums of numerator and denominator

    def add(self, part: Responses) -> None:
        """Process the next responses."""
        at = int(np.searchsorted(part.first, self._free))
        while at < len(part):
            self._add(part, at)
            self._free = int(part.sample[at]) + 1
            at = int(np.searchsorted(part.first, self._free))

    def _add(self, part: Responses, at: int) -> None:
        if self._windows >> self._level == _GROUPS_MAX:
            self._merge()
        group = self._windows >> self._level
        used = part.valid[at] & np.isfinite(part.value[at])
        weight = np.where(np.isfinite(part.weight[at]), part.weight[at], 1.0)
        schedule = part.schedule[at] if np.isfinite(part.schedule[at]) else 0.0
        self._moments[:, group, used] += np.array([[part.time_s[at]], [schedule]])
        self._pairs[:, group, used] += np.stack([np.ones_like(weight), part.value[at] * weight, weight])[:, used]
        self._windows += 1

    def _merge(self) -> None:
        for sums in (self._moments, self._pairs):
            half = sums[:, ::2] + sums[:, 1::2]
            sums[:, : _GROUPS_MAX // 2] = half
            sums[:, _GROUPS_MAX // 2 :] = 0
        self._level += 1

    def result(self) -> Drift:
        """The test on all responses up to now."""
        n = self._pairs.shape[2]
        change, sigma = np.full(n, complex(np.nan, np.nan)), np.full(n, np.nan)
        log_chance, farthest = np.zeros(n), np.zeros(n)
        for i in range(n):
            if (trend := self._trend(i)) is not None:
                change[i], sigma[i], farthest[i], log_chance[i] = trend
        own = log_chance < np.log(FALSE_ALARM / 2 / max(n, 1))
        together = scipy.special.gammaincc(n, -log_chance.sum()) < FALSE_ALARM / 2
        found = bool(own.any() or together)
        with np.errstate(invalid="ignore", divide="ignore"):
            value = self._pairs[1].sum(axis=0) / self._pairs[2].sum(axis=0)
        return Drift(found, own, value, change, sigma, _WITHIN_SIGMA * farthest * found)

    def _trend(self, line: int) -> tuple[complex, float, float, float] | None:
        """Change over the record, its sigma, the largest distance from the mean, and ln of the probability by chance.

        None if there are too few groups.
        """
        count = self._pairs[0, :, line].real
        some = count > 0
        if np.count_nonzero(some) < _GROUPS_MIN:
            return None
        count = count[some]
        time_s, schedule = self._moments[:, some, line] / count
        value = self._pairs[1, some, line] / self._pairs[2, some, line]
        straight = [np.ones_like(time_s), *([schedule] if np.ptp(schedule) else []), time_s]
        bent = (time_s - time_s.mean()) ** 2
        q, r = np.linalg.qr(np.stack([*straight, bent], axis=1) * np.sqrt(count)[:, np.newaxis])
        rotated = q.T @ (value * np.sqrt(count))
        dof = len(count) - len(rotated)
        residual = float(np.sum(np.abs(value * np.sqrt(count) - q @ rotated) ** 2)) / dof
        slope = len(straight) - 1
        if residual <= 0 or r[slope, slope] == 0:
            return None
        # The groups are centred on their windows; the record is one group longer.
        longer = len(count) / (len(count) - 1)
        size = float(np.ptp(time_s)) * longer / r[slope, slope]
        away = q[:, slope:] @ rotated[slope:] / np.sqrt(count)
        log_chance = -dof * float(np.log1p(abs(rotated[slope]) ** 2 / residual / dof))
        return complex(rotated[slope] * size), abs(size) * residual**0.5, float(np.abs(away).max()) * longer, log_chance

    @property
    def _identity(self) -> str:
        return f"{self._window}"
