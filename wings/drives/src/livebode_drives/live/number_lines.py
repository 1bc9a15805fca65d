"""Lines of numbers: one sample in each line, a number for each channel, as a microcontroller prints them."""

from __future__ import annotations

import math
import re

import numpy as np
from numpy.typing import NDArray

from livebode.core import Channel, SourceError
from livebode.sources.live import Batch
from livebode_drives.live.counter import Counter, NumberedSample, batches_of

_BETWEEN = re.compile(rb"[,;\s]+")
_SHOWN = 40


def numbers_in(line: bytes, width: int) -> NDArray[np.float64]:
    """The numbers in a line, separated by commas, semicolons, spaces or tabs.

    Raises
    ------
    SourceError
        Where the line has another number of fields, or one that is not a number.

    Examples
    --------
    >>> numbers_in(b"17, -0.5;1e3", 3).tolist()
    [17.0, -0.5, 1000.0]
    """
    fields = _BETWEEN.split(line.strip())
    if len(fields) != width:
        raise line_not_numbers(line, f"has {len(fields)} fields, not {width}")
    if b"_" in line:  # a digit separator in Python only
        raise line_not_numbers(line, "is not of numbers")
    try:
        return np.array([float(field) for field in fields])
    except ValueError:
        raise line_not_numbers(line, "is not of numbers") from None


def line_not_numbers(line: bytes, wrong: str) -> SourceError:
    shown = ascii(line[:_SHOWN].decode("latin-1"))
    return SourceError(
        "line-not-numbers",
        f"the line {shown} {wrong}",
        "send a number for each of source.channels in each line, and check source.baud_rate",
        line=shown,
    )


class NumberLines:
    """Turns lines of numbers into Batches.

    Without a counter each line is the next sample, also one that cannot be read: its sample is missing.

    Parameters
    ----------
    channels, rate_hz
        Of the stream.
    counter
        Number of the column that counts the samples; None without one.
    modulus
        Number of values of the counter; None if it does not wrap.
    epoch
        Of the first sample.
    """

    def __init__(
        self, channels: tuple[Channel, ...], rate_hz: float, counter: int | None, modulus: int | None, epoch: int
    ) -> None:
        self._channels, self._rate_hz, self._column = channels, rate_hz, counter
        self._counter = Counter(rate_hz, modulus, epoch)
        self._epoch, self._next = epoch, 0
        self.problems: list[object] = []
        """What was wrong with lines since this was cleared."""

    @property
    def epoch(self) -> int:
        """Epoch of the newest sample."""
        return self._epoch

    def restart(self) -> None:
        """The connection was lost: what is missing is known only to a counter."""
        if self._column is None:
            self._epoch, self._next = self._epoch + 1, 0

    def batches(self, lines: list[bytes], time_s: float) -> list[Batch]:
        """Batches of the samples in these lines, which arrived at `time_s`."""
        samples: list[NumberedSample] = []
        for line in lines:
            try:
                samples += self._sample(line, time_s)
            except SourceError as error:
                self.problems.append(error)
        if self._counter.damaged:
            self.problems.append(f"{self._counter.damaged} samples had a counter that no other sample confirmed")
            self._counter.damaged = 0
        if samples:
            self._epoch = samples[-1].epoch
        return batches_of(samples, self._channels, self._rate_hz, time_s)

    def _sample(self, line: bytes, time_s: float) -> list[NumberedSample]:
        self._next += 1
        row = numbers_in(line, len(self._channels))
        if self._column is None:
            return [NumberedSample(self._epoch, self._next - 1, row)]
        count = row[self._column]
        if not (math.isfinite(count) and count == math.floor(count) and 0 <= count < 1 << 53):
            raise line_not_numbers(line, f"has the counter {count:g}, which is not a whole number")
        return self._counter.process(int(count), time_s, row)
