"""Sample numbers from a counter in the data, for transports that neither number their samples nor detect damage."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from livebode.core import Channel
from livebode.sources.live import Batch

FAR_S = 1.0
"""A counter that differs by more than this from the time since its last value was set to another value."""


class NumberedSample(NamedTuple):
    """A sample with its number; `epoch` changes where the sender restarted."""

    epoch: int
    number: int
    row: NDArray[np.float64]


class Counter:
    """Numbers samples by a counter that their sender adds 1 to, and that may wrap.

    A value that does not follow the last one may be damage. It is accepted when the next one confirms it: by following
    it, or by being later than both, with less than a second between them.

    If the counter wraps, the time between two samples gives the number of wraps, and a counter that contradicts this
    time by more than a second restarted. Without wraps, a counter that goes back restarted.

    Parameters
    ----------
    rate_hz
        Samples per second.
    modulus
        Number of values of the counter, which then begins again; None if it never wraps.
    epoch
        Of the first sample.
    """

    def __init__(self, rate_hz: float, modulus: int | None, epoch: int = 0) -> None:
        self._rate_hz, self._modulus, self._epoch = rate_hz, modulus, epoch
        self._last: tuple[int, int, float] | None = None
        self._doubtful: tuple[int, float, NDArray[np.float64]] | None = None
        self.damaged = 0
        """Samples that were dropped because no other one confirmed their counter."""

    def process(self, count: int, time_s: float, row: NDArray[np.float64]) -> list[NumberedSample]:
        """The samples that are certain with this one: its counter, its time on any clock, and its values."""
        doubtful, self._doubtful = self._doubtful, None
        accepted = []
        if doubtful is not None:
            if self._confirmed(doubtful[0], count):
                accepted.append(self._accepted(*doubtful))
            else:
                self.damaged += 1
        if self._last is not None and self._ahead(self._last[0], count) == 1:
            return [*accepted, self._accepted(count, time_s, row)]
        self._doubtful = count, time_s, row
        return accepted

    def _confirmed(self, doubtful: int, count: int) -> bool:
        if self._ahead(doubtful, count) == 1:
            return True
        if self._last is None:
            return False
        far = FAR_S * self._rate_hz if self._modulus is None else min(FAR_S * self._rate_hz, self._modulus / 2)
        return 1 < self._ahead(self._last[0], doubtful) < self._ahead(self._last[0], count) <= far

    def _ahead(self, before: int, after: int) -> int:
        return after - before if self._modulus is None else (after - before) % self._modulus

    def _accepted(self, count: int, time_s: float, row: NDArray[np.float64]) -> NumberedSample:
        number = count
        if self._last is not None:
            last, last_number, last_s = self._last
            steps = self._ahead(last, count)
            if self._modulus is not None and steps != 1:
                due = (time_s - last_s) * self._rate_hz
                steps += self._modulus * max(0, round((due - steps) / self._modulus))
                restarted = abs(steps - due) > FAR_S * self._rate_hz
            else:
                restarted = steps <= 0
            self._epoch += restarted
            number = count if restarted else last_number + steps
        self._last = count, number, time_s
        return NumberedSample(self._epoch, number, row)


def batches_of(
    samples: list[NumberedSample], channels: tuple[Channel, ...], rate_hz: float, arrived_s: float
) -> list[Batch]:
    """Batches of these samples; a batch ends where the next number is not the following one."""
    cuts = [i for i, (a, b) in enumerate(pairwise(samples), 1) if (b.epoch, b.number) != (a.epoch, a.number + 1)]
    return [
        Batch(
            part[0].number,
            np.stack([sample.row for sample in part], axis=1),
            channels,
            rate_hz,
            part[0].epoch,
            arrived_s=arrived_s,
        )
        for a, b in pairwise([0, *cuts, len(samples)])
        if (part := samples[a:b])
    ]
