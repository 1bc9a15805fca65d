"""openDAQ: data acquisition devices, through the SDK of openDAQ; signals of one clock are put together by numbers."""

from __future__ import annotations

import time
from functools import reduce
from itertools import pairwise
from types import ModuleType
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from livebode.core import Channel, SourceError, nearest_name, not_installed
from livebode.dataclass import dataclass
from livebode.sources import split_unit
from livebode.sources.live import CHANNELS_MAX, VALUES_MAX, Address, Batch, LiveSource, Reach
from livebode_drives.source_settings import DriveKeys

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


def chosen_signals(by_heading: dict[str, Any], headings: list[str]) -> list[tuple[Channel, Any]]:
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
    if not by_heading:
        raise _refusal("the device has no signal that is sampled at regular times", "check source.url")
    if not headings:
        clock = clock_of(next(iter(by_heading.values())))
        headings = [name for name, signal in by_heading.items() if clock_of(signal) == clock][:CHANNELS_MAX]
    chosen = []
    for heading in headings:
        name, unit = split_unit(heading)
        if name not in by_heading:
            raise _refusal(f"the device has no sampled signal {name!r}", nearest_name(name, list(by_heading)[:_LISTED]))
        descriptor = by_heading[name].descriptor
        own = descriptor.unit.symbol if descriptor is not None and descriptor.unit is not None else ""
        chosen.append((Channel(name, unit or own), by_heading[name]))
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

    def pop(self) -> list[tuple[int, NDArray[np.float64]]]:
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


READ_S = 0.02
"""Time between reads: what arrives together costs less."""
SILENCE_S = 10.0
"""A device without samples for this time is connected again."""
SAMPLES_MAX = 1 << 16


class DaqSource(LiveSource):
    """The device at the URL. Samples are numbered by the ticks of its clock, which count from a fixed date."""

    settings: DriveKeys
    format: ClassVar[str] = "openDAQ"

    def __init__(self, settings: DriveKeys, address: Address) -> None:
        super().__init__(settings, address)
        self._daq = import_opendaq()
        self._phase: int | None = None
        """Ticks of sample 0, from the first sample: the clock of the first signal."""

    def reach(self) -> Reach:
        return Reach("not applicable", f"{self.address} is opened by the SDK of openDAQ when the run begins")

    def _receive(self) -> bool:
        builder = self._daq.InstanceBuilder()
        builder.global_log_level = self._daq.LogLevel.Off  # what it would print is in the events
        instance = builder.build()
        try:
            device = instance.add_device(str(self.address))
        except RuntimeError as error:
            raise ConnectionError(str(error)) from None
        try:
            signals = {}
            for signal in device.signals_recursive:
                if clock_of(signal) is not None:
                    signals[signal.name if signal.name not in signals else signal.global_id] = signal
            chosen = chosen_signals(signals, self.settings.channels)
            self._established()
            self._read([signal for _, signal in chosen], tuple(channel for channel, _ in chosen))
        finally:
            instance.remove_device(device)
        return False

    def _read(self, signals: list[Any], channels: tuple[Any, ...]) -> None:
        kinds = self._daq.SampleType
        readers = [
            self._daq.StreamReader(signal, value_type=kinds.Float64, domain_type=kinds.Int64) for signal in signals
        ]
        clock, together = clock_of(signals[0]), TogetherByNumber(len(signals))
        assert clock is not None
        heard = time.monotonic()
        while not self._stop.wait(READ_S):
            for place, reader in enumerate(readers):
                values, ticks = reader.read_with_domain(SAMPLES_MAX)
                if ticks.size:
                    together.add(place, self._numbers(ticks, clock), np.asarray(values, dtype=np.float64))
                elif clock_of(signals[place]) != clock:
                    raise ConnectionError("the device changed its sampling rate")
            if runs := together.pop():
                heard = time.monotonic()
            elif time.monotonic() - heard > SILENCE_S:
                raise ConnectionError(f"the device sent nothing for {SILENCE_S:g} s")
            if together.dropped:
                self._malformed(f"{together.dropped} samples waited too long for another signal")
                together.dropped = 0
            most = VALUES_MAX // len(channels)
            for first, data in runs:
                for start in range(0, data.shape[1], most):
                    self._deliver(Batch(first + start, data[:, start : start + most], channels, clock.rate_hz))

    def _numbers(self, ticks: np.ndarray[Any, Any], clock: SampleClock) -> np.ndarray[Any, np.dtype[np.int64]]:
        if self._phase is None:
            self._phase = int(ticks[0]) % clock.delta
        return (ticks.astype(np.int64) - self._phase + clock.delta // 2) // clock.delta


def import_opendaq() -> ModuleType:
    try:
        import opendaq
    except ImportError:
        raise not_installed(
            "daqref and daq.nd need the package opendaq, which is not installed", package="opendaq", extra="opendaq"
        ) from None
    return opendaq  # type: ignore[no-any-return]
