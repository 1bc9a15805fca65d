"""Steps of a time column, and the exact rate that rounded ones mean."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import RecordingError
from livebode.dataclass import dataclass

EPSILON = 2.0**-50
"""Relative uncertainty of double precision alone."""


def exact_rate_hz(period_s: float, uncertainty: float) -> float:
    """Rate in Hz for a mean period in seconds that is known to ± `uncertainty` (relative).

    Of all rates and periods within the uncertainty, the one with the fewest decimal digits: recorders sample at 4000 Hz
    or every 0.3 ms, not at 3999.99996 Hz. The data cannot distinguish rates within the uncertainty.

    >>> exact_rate_hz(1 / 3999.99996, 1e-6)
    4000.0
    >>> exact_rate_hz(0.0003, 1e-9)
    3333.3333333333335
    >>> exact_rate_hz(1 / 1000.0037, 1e-12)
    1000.0037
    """
    room = uncertainty + EPSILON
    rate_digits, rate_hz = shortest(1.0 / period_s, room)
    period_digits, period_s = shortest(period_s, room)
    return rate_hz if rate_digits <= period_digits else 1.0 / period_s


def shortest(value: float, room: float) -> tuple[int, float]:
    """Number of digits and value of the shortest decimal within `value`·(1 ± `room`).

    >>> shortest(3999.99996, 1e-6)
    (1, 4000.0)
    """
    for digits in range(1, 17):
        rounded = float(f"{value:.{digits - 1}e}")
        if abs(rounded - value) <= room * value:
            return digits, rounded
    return 17, value


GAP_TOLERANCE = 0.25
"""How far from a whole number of periods a gap may be, in periods."""
PAUSE = 10
"""A step of at least this many periods is a pause of the recorder, not necessarily a whole number of periods."""
GAPS_MAX = 1_000_000
LONGEST_GAP = 2**40
LOOK = 4096
"""Number of steps for the first estimate of the period."""


@dataclass(frozen=True)
class Gap:
    """Missing samples.

    Parameters
    ----------
    sample
        Number of the first sample after the gap; numbers continue over gaps.
    missing
        Samples that are missing before it.
    """

    sample: int
    missing: int


class Steps:
    """Statistics of the steps of a time column; `add` takes the chunks in order, in the column's own unit."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._last: Any = None
        self.first: Any = None
        self.rows = 0
        self.nominal = 0.0
        """First estimate of the period."""
        self._count, self._sum, self._squares = 0, 0.0, 0.0  # of regular steps, as deviations from the nominal period
        self.low, self.high = np.inf, 0.0
        self.largest = 0.0
        """Largest magnitude of time, which sets the resolution of a float; 0 for integers."""
        self.gap_rows: list[int] = []
        self.gap_missing: list[int] = []

    def add(self, time: NDArray[Any]) -> None:
        if len(time) == 0:
            return
        time = self._checked(time)
        if self._last is None:
            self.first = time[0]
            joined = time
        else:
            joined = np.concatenate(([self._last], time))
        with np.errstate(all="ignore"):  # invalid values overflow; the checks below report it
            self._add_steps(joined, np.diff(joined).astype(np.float64, copy=False), len(time))

    def _add_steps(self, joined: NDArray[Any], steps: NDArray[np.float64], rows: int) -> None:
        before = self.rows - (len(joined) - rows)  # row of joined[0]
        self._last = joined[-1]
        self.rows += rows
        if len(steps) == 0:
            return
        low = float(steps.min())
        if not low > 0:
            self._backwards(joined, steps, before)
        if not self.nominal:
            self.nominal = typical(steps[:LOOK])
        if low < 0.5 * self.nominal:
            self._irregular(joined, int(steps.argmin()), before)
        if steps.max() > 1.5 * self.nominal:
            steps = self._cut_gaps(joined, steps, before)
        self._gather(steps)

    @property
    def regular(self) -> int:
        """Steps that are not gaps."""
        return self._count

    @property
    def mean(self) -> float:
        """Mean regular step, in the column's unit."""
        return self.nominal + self._sum / self._count

    @property
    def std(self) -> float:
        """Standard deviation of the regular steps, in the column's unit."""
        return float(np.sqrt(max(0.0, self._squares / self._count - (self._sum / self._count) ** 2)))

    @property
    def spread(self) -> float:
        """Longest minus shortest regular step."""
        return self.high - self.low

    @property
    def printed(self) -> bool:
        """True if the steps are neighbouring multiples of one quantum: a regular time, printed with few digits."""
        whole = self.low / self.spread if self.spread else 0.0
        return bool(self.spread and abs(whole - round(whole)) < 0.02 and round(whole) >= 1)

    def _checked(self, time: NDArray[Any]) -> NDArray[Any]:
        """Time as int64 or float64, whose differences neither wrap nor round."""
        if time.dtype.kind in "iub":
            return time.astype(np.int64, copy=False)
        time = time.astype(np.float64, copy=False)
        if not np.isfinite(time).all():
            at = int(np.flatnonzero(~np.isfinite(time))[0])
            raise RecordingError(
                "time-not-finite",
                f"time column {self._name!r} has no value ({time[at]}) at sample {self.rows + at}",
                'repair the file, or give rate_hz and ignore the column (time = "none")',
                channel=self._name,
                sample=self.rows + at,
            )
        self.largest = max(self.largest, abs(float(time[0])), abs(float(time[-1])))
        return time

    def _backwards(self, joined: NDArray[Any], steps: NDArray[np.float64], before: int) -> None:
        at = int(np.flatnonzero(~(steps > 0))[0])
        verb = "repeats" if steps[at] == 0 else "decreases"
        raise RecordingError(
            "time-not-increasing",
            f"time column {self._name!r} {verb} at sample {before + at + 1}: {joined[at + 1]} after {joined[at]}",
            "repair the file, or, where this is not time or has too few digits, give rate_hz and ignore the column "
            '(time = "none")',
            channel=self._name,
            sample=before + at + 1,
            times=joined[at : at + 2].tolist(),
        )

    def _irregular(self, joined: NDArray[Any], at: int, before: int) -> None:
        step = float(joined[at + 1]) - float(joined[at])
        raise RecordingError(
            "time-irregular",
            f"time column {self._name!r} steps from {joined[at]} to {joined[at + 1]} at sample {before + at + 1}, "
            f"{step / self.nominal:.4g} periods of {self.nominal:.6g}: neither regular nor whole missing samples",
            'resample the recording, or give rate_hz and ignore the column (time = "none")',
            channel=self._name,
            sample=before + at + 1,
            times=joined[at : at + 2].tolist(),
        )

    def _cut_gaps(self, joined: NDArray[Any], steps: NDArray[np.float64], before: int) -> NDArray[np.float64]:
        """Record the gaps in `steps`; returns the regular ones."""
        regular = steps <= 1.5 * self.nominal
        for at in np.flatnonzero(~regular).tolist():
            periods = float(steps[at]) / (self.mean if self._count else self.nominal)
            whole = round(min(periods, LONGEST_GAP + 1.0))
            if whole < 2 or whole > LONGEST_GAP or (whole < PAUSE and abs(periods - whole) > GAP_TOLERANCE):
                self._irregular(joined, at, before)
            self.gap_rows.append(before + at + 1)
            self.gap_missing.append(whole - 1)
        if len(self.gap_rows) > GAPS_MAX:
            raise RecordingError(
                "time-irregular",
                f"time column {self._name!r} has more than {GAPS_MAX} gaps",
                "check that this is the time and that the recording is complete",
                channel=self._name,
                gaps=len(self.gap_rows),
            )
        return steps[regular]

    def _gather(self, steps: NDArray[np.float64]) -> None:
        if len(steps) == 0:
            return
        self.low, self.high = min(self.low, float(steps.min())), max(self.high, float(steps.max()))
        away = steps - self.nominal
        self._count += len(steps)
        self._sum += float(away.sum())
        self._squares += float(np.einsum("i,i", away, away))  # no BLAS: its threads cost more than they save here


def typical(steps: NDArray[np.float64]) -> float:
    """Mean of the steps near the median: robust against gaps and coarse rounding.

    >>> typical(np.array([2.0, 3.0, 2.0, 3.0, 50.0]))
    2.5
    """
    median = float(np.median(steps))
    near = steps[(steps >= 0.5 * median) & (steps <= 1.75 * median)]
    return float(near.mean()) if len(near) else median
