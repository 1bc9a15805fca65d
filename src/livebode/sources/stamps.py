"""Stamps: the times of the samples of a clock that is not regular."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import RecordingError
from livebode.dataclass import dataclass
from livebode.sources.recording import Chunk, Column
from livebode.sources.steps import Steps
from livebode.sources.timing import check_rate, guess_unit, stated_unit
from livebode.sources.units import SECONDS

_KEPT = 1 << 16
"""Steps that the median is taken over."""
_MEAN_TOLERANCE = 0.3
"""Relative difference of a given rate and the mean of a jittering clock at which the unit of time is still clear."""


@dataclass(frozen=True, eq=False)
class Stamps:
    """Properties of the times of one clock.

    Attributes
    ----------
    column
        Name of the time column.
    unit, scale
        Its unit, and the seconds in one.
    first, last
        First and last value, in its unit and type.
    samples
        Number of samples.
    step_s
        Median of the steps.
    jitter
        Standard deviation of the steps over their median.
    longest_s
        The longest step.
    """

    column: str
    unit: str
    scale: float
    first: Any
    last: Any
    samples: int
    step_s: float
    jitter: float
    longest_s: float

    @property
    def rate_hz(self) -> float:
        """Samples per second over the whole recording."""
        return (self.samples - 1) / (float(self.last - self.first) * self.scale)

    @property
    def first_s(self) -> float:
        return float(self.first) * self.scale

    @property
    def last_s(self) -> float:
        return float(self.last) * self.scale

    def since(self, time: NDArray[Any], origin: Stamps) -> NDArray[np.float64]:
        """Seconds since the first stamp of `origin`; in the clock's own digits where both count the same."""
        apart = self.first - origin.first if self.scale == origin.scale else None
        ahead_s = self.first_s - origin.first_s if apart is None else float(apart) * self.scale
        return np.asarray((time - self.first).astype(np.float64) * self.scale + ahead_s)


class _UnevenSteps(Steps):
    """Statistics of any increasing steps."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self._kept: list[NDArray[np.float64]] = []
        self._room = _KEPT

    def _add_steps(self, joined: NDArray[Any], steps: NDArray[np.float64], rows: int) -> None:
        before = self.rows - (len(joined) - rows)
        self._last = joined[-1]
        self.rows += rows
        if len(steps) and not float(steps.min()) > 0:
            self._backwards(joined, steps, before)
        if self._room:
            self._kept.append(steps[: self._room])
            self._room -= len(self._kept[-1])
        self._gather(steps)

    @property
    def last(self) -> Any:
        return self._last

    @property
    def median(self) -> float:
        return float(np.median(np.concatenate(self._kept)))


def stamps_of(
    column: Column, unit: str, chunks: Iterator[Chunk], rate_hz: float | None, stated: tuple[float, str] | None
) -> Stamps:
    """The stamps of a time column, in one pass over it.

    Parameters
    ----------
    column, unit
        The column, and the unit that the user gave for it (else empty).
    chunks
        The column's values.
    rate_hz, stated
        Rate from the user, or from elsewhere in the file; used only if the unit of time is missing.

    Raises
    ------
    RecordingError
        If the times are not finite, do not increase, are fewer than two or have no unit.
    """
    unit = stated_unit(column, unit)
    steps = _UnevenSteps(column.name)
    for (time,) in chunks:
        steps.add(time)
    if steps.rows < 2:
        raise RecordingError(
            "channel-missing",
            f"time column {column.name!r} has {steps.rows} samples, too few for a clock",
            "choose other channels",
            channel=column.name,
            samples=steps.rows,
        )
    scale = SECONDS[unit.casefold()] if unit else 0.0
    if not unit:
        known = (rate_hz, "the given rate") if rate_hz is not None else stated
        unit, scale, _ = guess_unit(column, steps.mean, known, _MEAN_TOLERANCE)
    check_rate(column.name, 1 / (steps.median * scale), None)
    return Stamps(
        column.name,
        unit,
        scale,
        steps.first,
        steps.last,
        steps.rows,
        steps.median * scale,
        steps.std / steps.median,
        steps.high * scale,
    )
