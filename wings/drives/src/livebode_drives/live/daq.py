"""openDAQ: data acquisition devices, through the SDK of openDAQ."""

from __future__ import annotations

import time
from types import ModuleType
from typing import Any, ClassVar

import numpy as np

from livebode.core import not_installed
from livebode.sources.live import VALUES_MAX, Address, Batch, LiveSource, Reach
from livebode_drives.live.daq_signals import SampleClock, TogetherByNumber, chosen_signals, clock_of
from livebode_drives.settings import DriveKeys

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
            found = {}
            for signal in device.signals_recursive:
                if clock_of(signal) is not None:
                    found[signal.name if signal.name not in found else signal.global_id] = signal
            chosen = chosen_signals(found, self.settings.channels)
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
            if runs := together.take():
                heard = time.monotonic()
            elif time.monotonic() - heard > SILENCE_S:
                raise ConnectionError(f"the device sent nothing for {SILENCE_S:g} s")
            if together.dropped:
                self._malformed(f"{together.dropped} samples waited too long for another signal")
                together.dropped = 0
            most = VALUES_MAX // len(channels)
            for first, data in runs:
                for at in range(0, data.shape[1], most):
                    self._deliver(Batch(first + at, data[:, at : at + most], channels, clock.rate_hz))

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
