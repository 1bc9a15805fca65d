"""CAN: frames of drives on a bus, decoded by a DBC file, received through python-can."""

from __future__ import annotations

import logging
import time
from collections import Counter
from types import ModuleType
from typing import Any, ClassVar

from livebode.core import ConfigError, SourceError, not_installed
from livebode.sources.live import TICK_S, Address, LiveSource, Position, Reach
from livebode_drives.live.arrival_rate import ArrivalRate
from livebode_drives.live.can_samples import CanSamples, Identity, signals_of
from livebode_drives.live.counter import NumberedSample, batches_of
from livebode_drives.recordings.dbc import messages_of
from livebode_drives.source_settings import DriveKeys

TOGETHER_S = 0.01
"""Time between reads: what arrives together costs less."""
FRAMES_MAX = 4096
"""Frames that are taken together."""
FOREIGN_FRAMES = 500
"""Frames of other messages after which a bus without those of the DBC is reported."""
_BUS_OFF, _RESTARTED = 0x40, 0x100
_ERRORS = {0x02: "arbitration was lost", 0x04: "controller problem", 0x08: "protocol violation", 0x20: "no acknowledge"}
_LEFT = "bus-off: the controller left the bus after too many errors; check the wiring, the termination and the bit rate"
_SHOWN = 5


class CanSource(LiveSource):
    """The bus in the URL, can:interface/channel, as python-can names them: can:socketcan/can0."""

    settings: DriveKeys
    format: ClassVar[str] = "can"

    def __init__(self, settings: DriveKeys, address: Address) -> None:
        super().__init__(settings, address)
        self._can = import_can()
        missing = [key for key in ("dbc", "rate_hz") if getattr(settings, key) is None]
        if missing:
            raise ConfigError(
                "key-missing",
                f"can needs {' and '.join(f'source.{key}' for key in missing)}",
                "set dbc to the file that defines the signals, and rate_hz to the rate at which the device sends them",
                key="source",
                keys=missing,
            )
        self._messages = messages_of(settings.dbc, settings.dbc)  # type: ignore[arg-type]
        self._samples = self._new_samples(0)
        self._rate = ArrivalRate(self._events, self._rate_given)
        self._foreign: Counter[Identity] = Counter()
        self._count = 0

    @property
    def _rate_given(self) -> float:
        assert self.settings.rate_hz is not None
        return self.settings.rate_hz

    def _new_samples(self, epoch: int) -> CanSamples:
        signals = signals_of(self.settings.channels, self._messages, self.settings.dbc)
        return CanSamples(signals, self._messages, self._rate_given, self.settings.counter, epoch)

    def resume(self, position: Position) -> None:
        super().resume(position)
        self._samples = self._new_samples(position.epoch + 1)  # a counter has wrapped, and times may have been set

    def reach(self) -> Reach:
        facts = {"address": str(self.address)}
        try:
            with self.open_bus():
                pass
        except OSError as error:
            remedy = "check source.url, and that the interface is up: ip link set can0 up type can bitrate 1000000"
            return Reach("failed", f"{self.address}: {error.strerror or error}", remedy, facts)
        return Reach("ok", f"{self.address} can be opened", facts=facts)

    def _receive(self) -> bool:
        with self.open_bus() as bus:
            self._established()
            self._foreign.clear()
            try:
                while not self._stop.is_set():
                    self._process_frames(self._waiting(bus))
                    self._stop.wait(TOGETHER_S)
            except self._can.CanError as error:
                raise ConnectionError(str(error)) from None
            finally:
                self._samples.restart()
                self._rate.restart()
        return False

    def open_bus(self) -> Any:
        """The bus of python-can; ConnectionError if there is none, SourceError if it is of an unknown kind."""
        interface, _, channel = self.address.path.partition("/")
        more = {} if self.settings.bitrate is None else {"bitrate": self.settings.bitrate}
        try:
            return self._can.Bus(interface=interface, channel=channel, fd=self.settings.can_fd, **more)
        except self._can.CanInterfaceNotImplementedError as error:
            raise SourceError(
                "refused",
                f"python-can has no interface {interface!r} here ({error})"[:200],
                "use one such as socketcan, or install what it needs",
                interface=interface,
            ) from None
        except (self._can.CanError, ValueError) as error:
            raise ConnectionError(str(error)) from None

    def _waiting(self, bus: Any) -> list[Any]:
        """Frames that have arrived; the first is waited for."""
        frames: list[Any] = []
        frame = bus.recv(TICK_S)
        while frame is not None:
            frames.append(frame)
            frame = bus.recv(0.0) if len(frames) < FRAMES_MAX else None
        return frames

    def _process_frames(self, frames: list[Any]) -> None:
        samples: list[NumberedSample] = []
        try:
            for frame in frames:
                samples += self._samples_with(frame)
        finally:  # also what came before the controller left the bus
            self._pass_on(samples)

    def _samples_with(self, frame: Any) -> list[NumberedSample]:
        """The samples that are certain with this frame."""
        identity = (frame.arbitration_id, frame.is_extended_id)
        if frame.is_error_frame:
            self._process_error(frame.arbitration_id)
        elif identity not in self._samples.identities or frame.is_remote_frame:
            self._process_foreign(identity)
        else:
            try:
                return self._samples.process(identity, bytes(frame.data), frame.timestamp)
            except SourceError as error:
                self._malformed(error)
        return []

    def _pass_on(self, samples: list[NumberedSample]) -> None:
        for problem in self._samples.problems:
            self._malformed(problem)
        self._samples.problems.clear()
        if samples:
            self._count += len(samples)
            self._rate.add(self._count, time.monotonic())
            self._foreign.clear()
        for batch in batches_of(samples, self._samples.channels, self._rate_given, time.monotonic()):
            self._deliver(batch)

    def _process_error(self, number: int) -> None:
        """An error frame, whose identifier has a bit for each error, as in Linux's can/error.h."""
        if number & _BUS_OFF:
            raise ConnectionError(_LEFT)
        causes = [text for bit, text in _ERRORS.items() if number & bit] or ["bus error"]
        if not number & _RESTARTED:
            self._malformed(f"error frame: {', '.join(causes)}")

    def _process_foreign(self, identity: Identity) -> None:
        self._foreign[identity] += 1
        if self._foreign.total() >= FOREIGN_FRAMES:
            seen = ", ".join(f"0x{number:X}" for (number, _), _ in self._foreign.most_common(_SHOWN))
            self._malformed(
                f"{self._foreign.total()} frames arrived without a sample of {self._samples.described()}; the bus has "
                f"{seen}: check the node in the DBC, and that all these messages are sent"
            )
            self._foreign.clear()


def import_can() -> ModuleType:
    try:
        import can
    except ImportError:
        raise not_installed(
            "can needs the package python-can, which is not installed", package="python-can", extra="can"
        ) from None
    logging.getLogger("can").setLevel(logging.CRITICAL)  # its messages are in the events
    return can
