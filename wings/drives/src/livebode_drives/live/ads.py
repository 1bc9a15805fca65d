"""Beckhoff ADS: samples from a ring buffer in the PLC program, or by notifications with the PLC's timestamps.

The ring is bytes: a header, and a row for each of the last samples; docs/how-to/live.md has the program that fills it,
and the layout byte by byte.
"""

from __future__ import annotations

import ctypes
import struct
import time
from collections import deque
from types import ModuleType
from typing import Any, ClassVar

import numpy as np

from livebode.core import Channel, ConfigError, LivebodeError, SourceError, not_installed
from livebode.dataclass import dataclass
from livebode.sources.live import CHANNELS_MAX, SAMPLE_MAX, VALUES_MAX, Address, Batch, LiveSource, named_channels
from livebode_drives.live.stamp_numbers import StampNumbers
from livebode_drives.source_settings import DriveKeys

MAGIC = 0x474E524C  # "LRNG"
VERSION = 1
HEADER = struct.Struct("<IHHIIdQQ")
FILETIME_1970 = 116_444_736_000_000_000
"""The year 1970 in the PLC's unit of time: 100 ns since 1601."""


@dataclass(frozen=True)
class Ring:
    """The header at one time: `count` samples were written, the last one at `stamp` (100 ns since 1601)."""

    magic: int
    version: int
    channels: int
    length: int
    epoch: int
    rate_hz: float
    stamp: int
    count: int

    @property
    def stamp_s(self) -> float | None:
        """When the last sample was written, seconds since 1970; None if the PLC does not state it."""
        return (self.stamp - FILETIME_1970) / 1e7 if self.stamp else None


def read_ring(raw: bytes, symbol_bytes: int) -> tuple[Ring, np.dtype[np.floating]]:
    """The header in `raw`, and the type of the numbers after it, derived from the size of the whole symbol.

    Raises
    ------
    SourceError
        If it is not a ring, or its numbers contradict its size.
    """
    if len(raw) < HEADER.size:
        raise wrong_ring(f"a ring of {len(raw)} bytes is shorter than its header", bytes=len(raw))
    ring = Ring(*HEADER.unpack_from(raw))
    if ring.magic != MAGIC or ring.version != VERSION:
        raise wrong_ring(
            f"the symbol is not a ring of version {VERSION}: it begins with {raw[:6].hex(' ')}", beginning=raw[:6].hex()
        )
    values = ring.channels * ring.length
    if not (0 < ring.channels <= CHANNELS_MAX and ring.length > 1 and values <= VALUES_MAX):
        raise wrong_ring(
            f"a ring of {ring.length} samples of {ring.channels} channels is empty or too large",
            channels=ring.channels,
            samples=ring.length,
        )
    if not 1e-9 < ring.rate_hz < 1e9:
        raise wrong_ring(
            f"the ring's rate_hz={ring.rate_hz} is not a number of samples per second", rate_hz=ring.rate_hz
        )
    for dtype in (np.dtype("<f4"), np.dtype("<f8")):
        if HEADER.size + values * dtype.itemsize == symbol_bytes:
            return ring, dtype
    raise SourceError(
        "ring-invalid",
        f"a ring of {ring.length} samples of {ring.channels} channels does not have {symbol_bytes} bytes",
        "declare its data as ARRAY [0..length-1, 0..channels-1] OF REAL or LREAL",
        channels=ring.channels,
        samples=ring.length,
        bytes=symbol_bytes,
    )


def wrong_ring(message: str, **facts: object) -> SourceError:
    return SourceError(
        "ring-invalid", message, "check source.symbol and the PLC program (docs/how-to/live.md)", **facts
    )


def new_rows(ring: Ring, have: int | None) -> list[tuple[int, int]]:
    """Samples to read, as ranges that are contiguous in the ring: those after `have` that are not overwritten yet.

    >>> new_rows(Ring(MAGIC, 1, 1, 100, 0, 4000.0, 0, 250), 190)
    [(190, 200), (200, 250)]
    """
    # The slot of the oldest sample is written next.
    first = max(ring.count - ring.length + 1, 0 if have is None else have)
    if have is not None and have > ring.count:
        first = max(ring.count - ring.length + 1, 0)
    turn = ring.count // ring.length * ring.length
    if first < turn < ring.count:
        return [(first, turn), (turn, ring.count)]
    return [(first, ring.count)] if first < ring.count else []


def ring_batch(
    raw: bytes, first: int, ring: Ring, after: Ring, dtype: np.dtype[np.floating], channels: tuple[Channel, ...]
) -> Batch | None:
    """The rows from sample `first`, without those overwritten by the time of `after`; None if there are none."""
    if len(channels) != ring.channels:
        raise SourceError(
            "channels-invalid",
            f"the ring has {ring.channels} channels, and source.channels names {len(channels)}",
            "correct source.channels",
            key="source.channels",
            channels=[ring.channels, len(channels)],
        )
    if (after.epoch, after.length, after.channels) != (ring.epoch, ring.length, ring.channels):
        return None
    if not 0 <= ring.count <= after.count < SAMPLE_MAX:
        return None
    with np.errstate(invalid="ignore"):  # a signalling NaN becomes a quiet one
        data = np.frombuffer(raw, dtype).reshape(-1, ring.channels).T.astype(np.float64, order="C")
    lost = max(0, after.count - ring.length + 1 - first)
    if lost >= data.shape[1]:
        return None
    start = first + lost
    stamp_s = None if ring.stamp_s is None else ring.stamp_s - (ring.count - 1 - start) / ring.rate_hz
    return Batch(start, data[:, lost:], channels, ring.rate_hz, ring.epoch, stamp_s)


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

        def read(address: int, length: int) -> bytes:
            return bytes(plc.read(group, offset + address, ctypes.c_ubyte * length, return_ctypes=True))

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
                    self._process_rows(raw, first, ring, after, dtype)
                have, epoch = ring.count, ring.epoch
            except LivebodeError as error:
                self._malformed(error)
                self._stop.wait(NO_RING_S)
            self._stop.wait(self.settings.poll_s)

    def _process_rows(self, raw: bytes, first: int, ring: Ring, after: Ring, dtype: np.dtype[np.floating]) -> None:
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
            address = ctypes.addressof(header) + pyads.structs.SAdsNotificationHeader.data.offset
            came.append((header.nTimeStamp, ctypes.string_at(address, min(header.cbSampleSize, size))))

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
                self._process_values(numbered, values)
                if values:
                    heard = time.monotonic()
                elif time.monotonic() - heard > ALIVE_S:
                    plc.read_state()  # an error where the PLC is gone
                    heard = time.monotonic()
        finally:
            if handles is not None:
                self._unsubscribe(plc, handles)

    def _process_values(self, numbered: StampNumbers, values: list[tuple[int, bytes]]) -> None:
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
