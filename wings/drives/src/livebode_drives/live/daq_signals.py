"""The signals of an openDAQ device that are sampled by one clock, put together by their numbers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import Channel, SourceError, nearest_name
from livebode.sources import split_unit
from livebode.sources.live import CHANNELS_MAX

BEHIND_MAX = 1 << 18
"""Samples that wait for those of another signal."""
_LISTED = 20


@dataclass(frozen=True)
class SampleClock:
    """Ticks of a clock at which samples are taken.

    Attributes
    ----------
    tick_s
        Seconds of one tick.
    delta
        Ticks between two samples.
    """

    tick_s: float
    delta: int

    @property
    def rate_hz(self) -> float:
        return 1 / (self.tick_s * self.delta)


def clock_of(signal: Any) -> SampleClock | None:
    """The clock of a signal; None if it has none, or is not sampled at regular times."""
    domain = signal.domain_signal
    descriptor = None if domain is None else domain.descriptor
    if descriptor is None or descriptor.rule is None or descriptor.tick_resolution is None:
        return None
    parameters = {str(key): value for key, value in dict(descriptor.rule.parameters or {}).items()}
    delta, resolution = int(parameters.get("delta", 0)), descriptor.tick_resolution
    if delta < 1 or resolution.numerator < 1:
        return None
    return SampleClock(resolution.numerator / resolution.denominator, delta)


def chosen_signals(found: dict[str, Any], headings: list[str]) -> list[tuple[Channel, Any]]:
    """The signals of these channels, or all that share the clock of the first.

    Parameters
    ----------
    found
        Signals by name; those with a clock.
    headings
        Names, each with a unit in brackets where it differs from the device's.

    Raises
    ------
    SourceError
        With the code "refused" where a signal is missing, or is sampled by another clock than the first.
    """
    if not found:
        raise _refusal("the device has no signal that is sampled at regular times", "check source.url")
    if not headings:
        clock = clock_of(next(iter(found.values())))
        headings = [name for name, signal in found.items() if clock_of(signal) == clock][:CHANNELS_MAX]
    chosen = []
    for heading in headings:
        name, unit = split_unit(heading)
        if name not in found:
            raise _refusal(f"the device has no sampled signal {name!r}", nearest_name(name, list(found)[:_LISTED]))
        descriptor = found[name].descriptor
        own = descriptor.unit.symbol if descriptor is not None and descriptor.unit is not None else ""
        chosen.append((Channel(name, unit or own), found[name]))
    clocks = [clock_of(signal) for _, signal in chosen]
    for (channel, _), clock in zip(chosen, clocks):
        if clock != clocks[0]:
            raise _refusal(
                f"the signal {channel.name!r} is sampled by another clock than {chosen[0][0].name!r}",
                "choose signals of one rate in source.channels",
            )
    return chosen


def _refusal(wrong: str, remedy: str) -> SourceError:
    return SourceError("refused", wrong, remedy)


class TogetherByNumber:
    """Puts the samples of several signals together; a sample that one of them lacks is left out."""

    def __init__(self, signals: int) -> None:
        self._numbers = [np.empty(0, dtype=np.int64) for _ in range(signals)]
        self._values = [np.empty(0) for _ in range(signals)]
        self.dropped = 0
        """Samples that waited too long for those of another signal."""

    def add(self, signal: int, numbers: NDArray[np.int64], values: NDArray[np.float64]) -> None:
        self._numbers[signal] = np.concatenate([self._numbers[signal], numbers])
        self._values[signal] = np.concatenate([self._values[signal], values])
        self.dropped += max(0, self._numbers[signal].size - BEHIND_MAX)
        self._numbers[signal] = self._numbers[signal][-BEHIND_MAX:]
        self._values[signal] = self._values[signal][-BEHIND_MAX:]

    def take(self) -> list[tuple[int, NDArray[np.float64]]]:
        """Runs of samples that all signals have: the number of the first, and the values (signals, samples)."""
        common = reduce(np.intersect1d, self._numbers)
        if not common.size:
            return []
        places = [np.searchsorted(numbers, common) for numbers in self._numbers]
        data = np.stack([values[place] for values, place in zip(self._values, places)])
        for signal, place in enumerate(places):
            self._numbers[signal] = self._numbers[signal][place[-1] + 1 :]
            self._values[signal] = self._values[signal][place[-1] + 1 :]
        cuts = [0, *(np.flatnonzero(np.diff(common) != 1) + 1).tolist(), common.size]
        return [(int(common[a]), data[:, a:b]) for a, b in pairwise(cuts)]
