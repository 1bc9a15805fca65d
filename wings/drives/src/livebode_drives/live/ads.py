"""Beckhoff ADS: samples from a ring buffer in the PLC program, or by notifications with the PLC's timestamps."""

from __future__ import annotations

import ctypes
import time
from collections import deque
from types import ModuleType
from typing import Any, ClassVar

import numpy as np

from livebode.core import ConfigError, LivebodeError, SourceError, not_installed
from livebode.sources.live import Address, LiveSource, named_channels
from livebode_drives.live.ring import FILETIME_1970, HEADER, Ring, new_rows, read_ring, ring_batch
from livebode_drives.live.stamp_numbers import StampNumbers
from livebode_drives.source_settings import DriveKeys

TIMEOUT_MS = 2000
SYMBOL_BYTES_MAX = 16 << 20
NOTIFIED_MAX = 100_000
ALIVE_S = 2.0
NO_RING_S = 0.25
_NO_SYMBOL = 0x710
_CALLBACKS: list[Any] = []  # those that were subscribed, for the life of the process
_REFUSED = {_NO_SYMBOL: "the PLC has no such symbol", 0x0D: "the PLC's port is locked", 0x71B: "access was denied"}


class AdsSource(LiveSource):
    """A symbol of a PLC program, polled as a ring (`mode = "ring"`) or notified at each cycle (`"notify"`)."""

    settings: DriveKeys
    format: ClassVar[str] = "ads"

    def __init__(self, settings: DriveKeys, address: Address) -> None:
        super().__init__(settings, address)
        self._pyads = import_pyads()
        if settings.symbol is None or not settings.channels or settings.net_id is None:
            raise ConfigError(
                "key-missing",
                "ads needs source.net_id, source.symbol and source.channels",
                "set them; docs/how-to/live.md describes what the PLC must have",
                key="source",
                keys=["net_id", "symbol", "channels"],
            )
        if settings.mode == "notify" and settings.rate_hz is None:
            raise ConfigError(
                "key-missing",
                "notifications need source.rate_hz",
                "set it to the rate of the PLC task",
                key="source",
                keys=["rate_hz"],
            )
        self._channels = named_channels(settings.channels)
        try:
            self._plc_address = self._pyads.AmsAddr(settings.net_id, settings.ams_port)
        except (ValueError, TypeError):
            raise ConfigError(
                "value-invalid",
                f"source.net_id = {settings.net_id!r} is not an AMS net id",
                "give one such as 5.1.2.3.1.1",
                key="source.net_id",
                value=settings.net_id,
            ) from None

    def _receive(self) -> bool:
        settings, pyads = self.settings, self._pyads
        try:
            if settings.local_net_id is not None:
                pyads.set_local_address(settings.local_net_id)
            plc = pyads.Connection(settings.net_id, settings.ams_port, f"{self.address.host}:{self.address.port}")
            with plc:
                plc.set_timeout(TIMEOUT_MS)
                if settings.mode == "ring":
                    self._poll(plc)
                else:
                    self._listen(plc)
        except pyads.ADSError as error:
            code = getattr(error, "err_code", None)
            if code in _REFUSED:
                raise SourceError(
                    "refused",
                    f"{_REFUSED[code]} ({settings.symbol})",
                    "check source.symbol, source.ams_port and the access rights in the PLC",
                    symbol=settings.symbol,
                    ads_error=code,
                ) from None
            raise ConnectionError(str(error).strip()) from None
        except RuntimeError as error:  # raised by pyads for an answer that is too short
            raise ConnectionError(f"the PLC's answer is invalid: {str(error).strip()}"[:200]) from None
        return False

    def _place(self, plc: Any) -> tuple[int, int, int]:
        """Index group, index offset and size of the symbol."""
        info = self._pyads.pyads_ex.adsGetSymbolInfo(plc._port, plc._adr, self.settings.symbol)
        if not 0 < info.size <= SYMBOL_BYTES_MAX:
            raise SourceError(
                "refused",
                f"symbol {self.settings.symbol} has {info.size} bytes, not 1 to {SYMBOL_BYTES_MAX}",
                "check source.symbol",
                symbol=self.settings.symbol,
                bytes=info.size,
            )
        return info.iGroup, info.iOffs, info.size

    def _poll(self, plc: Any) -> None:
        group, offset, size = self._place(plc)

        def read(at: int, length: int) -> bytes:
            return bytes(plc.read(group, offset + at, ctypes.c_ubyte * length, return_ctypes=True))

        # When a run continues, the samples that are still in the ring are not lost.
        have, epoch = (None, 0) if self._resumed is None else (self._resumed.number, self._resumed.epoch)
        while not self._stop.is_set():
            try:
                ring, dtype = read_ring(read(0, HEADER.size), size)
                if not self._connected:
                    self._established()
                have = None if ring.epoch != epoch else have
                for first, last in new_rows(ring, have):
                    width = ring.channels * dtype.itemsize
                    raw = read(HEADER.size + first % ring.length * width, (last - first) * width)
                    after, _ = read_ring(read(0, HEADER.size), size)
                    self._take_rows(raw, first, ring, after, dtype)
                have, epoch = ring.count, ring.epoch
            except LivebodeError as error:
                self._malformed(error)
                self._stop.wait(NO_RING_S)
            self._stop.wait(self.settings.poll_s)

    def _take_rows(self, raw: bytes, first: int, ring: Ring, after: Ring, dtype: np.dtype[np.floating]) -> None:
        batch = ring_batch(raw, first, ring, after, dtype, self._channels)
        if batch is not None:
            self._deliver(batch, waits=True)  # in the ring

    def _listen(self, plc: Any) -> None:
        pyads, settings = self._pyads, self.settings
        group, offset, size = self._place(plc)
        if size not in (4 * len(self._channels), 8 * len(self._channels)):
            raise SourceError(
                "refused",
                f"symbol {settings.symbol} has {size} bytes",
                f"declare it as ARRAY of {len(self._channels)} REAL or LREAL",
                symbol=settings.symbol,
                bytes=size,
            )
        assert settings.rate_hz is not None
        came: deque[tuple[int, bytes]] = deque(maxlen=NOTIFIED_MAX)

        def notified(notification: Any, _: object) -> None:
            header = notification.contents
            at = ctypes.addressof(header) + pyads.structs.SAdsNotificationHeader.data.offset
            came.append((header.nTimeStamp, ctypes.string_at(at, min(header.cbSampleSize, size))))

        numbered = StampNumbers(self._channels, settings.rate_hz)
        attributes = pyads.NotificationAttrib(
            size, pyads.ADSTRANS_SERVERCYCLE, max_delay=1e3 * settings.poll_s, cycle_time=1e3 / settings.rate_hz
        )
        handles = plc.add_device_notification((group, offset), attributes, notified)
        self._established()
        try:
            heard = time.monotonic()
            while not self._stop.wait(self.settings.poll_s):
                values = [came.popleft() for _ in range(len(came))]
                self._take_values(numbered, values)
                if values:
                    heard = time.monotonic()
                elif time.monotonic() - heard > ALIVE_S:
                    plc.read_state()  # an error where the PLC is gone
                    heard = time.monotonic()
        finally:
            if handles is not None:
                self._unsubscribe(plc, handles)

    def _take_values(self, numbered: StampNumbers, values: list[tuple[int, bytes]]) -> None:
        samples = []
        for stamp, row in values:
            try:
                samples.append(numbered.sample((stamp - FILETIME_1970) / 1e7, row))
            except LivebodeError as error:
                self._malformed(error)
        for batch in numbered.batches(samples):
            self._deliver(batch)

    def _unsubscribe(self, plc: Any, handles: tuple[int, int | None]) -> None:
        # pyads frees the callback with the subscription, but the thread of its library still delivers what has arrived
        # before: without this the process ends by a segmentation fault.
        _CALLBACKS.append(self._pyads.pyads_ex.callback_store[plc._adr, handles[0]])
        try:
            plc.del_device_notification(*handles)
        except self._pyads.ADSError:
            return  # the connection is gone, and the notification with it


def import_pyads() -> ModuleType:
    try:
        import pyads
    except ImportError:
        raise not_installed(
            "ads needs the package pyads, which is not installed", package="pyads", extra="ads"
        ) from None
    return pyads  # type: ignore[no-any-return]
