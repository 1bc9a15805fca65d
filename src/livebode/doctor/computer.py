"""Checks of this computer: disk, UDP buffer, port of the dashboard, clock."""

from __future__ import annotations

import contextlib
import ctypes
import os
import shutil
import socket
import sys
import tempfile
import time
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path

from livebode.configuration import Axis, ServeSection
from livebode.core import LivebodeError, why
from livebode.dashboard import ServerSettings, listening
from livebode.doctor.check import Check
from livebode.records import SegmentLimits
from livebode.sources.live import BUFFER_BYTES

DISK = "disk"
FREE_BYTES_MIN = 10**9
"""Below this much a warning is due."""
SYNC_S_MAX = SegmentLimits.interval_s
"""A record is synced this often; a slower disk loses more at a power cut."""
_PIECE_BYTES, _SYNCS = 64 << 10, 5


def check_disk(directory: Path, budget_bytes: int | None = None) -> Check:
    """The file system of a directory, which need not exist yet; `budget_bytes` is what a record there may take."""
    place = directory.absolute()
    while not place.is_dir() and place != place.parent:
        place = place.parent
    needed = max(FREE_BYTES_MIN, budget_bytes or 0)
    try:
        free = shutil.disk_usage(place).free
        sync_s = _sync_s(place)
    except OSError as error:
        remedy = "free some space, check its permissions, or write runs to another directory"
        return Check(DISK, "failed", f"{place} cannot be written: {why(error)}", remedy, {"path": str(place)})
    message = f"{free / 1e9:.3g} GB free in {place}; a sync takes {1e3 * sync_s:.3g} ms (longest of {_SYNCS})"
    facts = {"path": str(place), "free_bytes": free, "sync_s": sync_s}
    if free < needed:
        remedy = f"free some space; {needed / 1e9:.3g} GB or more are recommended"
        return Check(DISK, "warning", message, remedy, facts)
    if sync_s > SYNC_S_MAX:
        remedy = f"take a faster disk; a record is synced every {SYNC_S_MAX:g} s"
        return Check(DISK, "warning", message, remedy, facts)
    return Check(DISK, "ok", message, facts=facts)


def _sync_s(place: Path) -> float:
    """The longest of some appended and synced pieces, in a file without a name."""
    piece, longest = bytes(_PIECE_BYTES), 0.0
    with tempfile.TemporaryFile(dir=place, buffering=0) as file:
        for _ in range(_SYNCS):
            began = time.perf_counter()
            remaining = memoryview(piece)
            while remaining:
                remaining = remaining[file.write(remaining) :]
            os.fsync(file.fileno())
            longest = max(longest, time.perf_counter() - began)
    return longest


UDP_BUFFER = "UDP receive buffer"


def check_udp_buffer(axes: Mapping[str, Axis]) -> Check:
    """What the system grants of what a UDP source asks for; not applicable where no axis of several receives UDP."""
    if axes and not any((axis.source.url or "").startswith("udp:") for axis in axes.values()):
        return Check(UDP_BUFFER, "not applicable", "no axis receives UDP")
    return judged_buffer(_granted_bytes(), BUFFER_BYTES)


def judged_buffer(granted_bytes: int, asked_bytes: int) -> Check:
    """The check of what was granted.

    >>> judged_buffer(4 << 20, 4 << 20).verdict, judged_buffer(212992, 4 << 20).verdict
    ('ok', 'warning')
    """
    facts = {"granted_bytes": granted_bytes, "asked_bytes": asked_bytes}
    message = f"the system grants {granted_bytes} bytes of {asked_bytes}"
    if granted_bytes >= asked_bytes:
        return Check(UDP_BUFFER, "ok", message, facts=facts)
    name = "net.core.rmem_max" if sys.platform.startswith("linux") else "kern.ipc.maxsockbuf"
    remedy = f"run `sysctl -w {name}={asked_bytes}` as administrator, or samples are lost while the computer is busy"
    return Check(UDP_BUFFER, "warning", message, remedy, facts)


def _granted_bytes() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as port:
        with contextlib.suppress(OSError):  # where a system refuses more than its maximum
            port.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER_BYTES)
        granted = port.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
    return granted // 2 if sys.platform.startswith("linux") else granted  # Linux doubles it for its own bookkeeping


DASHBOARD_PORT = "dashboard port"


def check_dashboard_port(axes: Mapping[str, Axis]) -> Check:
    """Whether [serve] can be used and its port is free; where no axis has it, the default port, as a warning."""
    described = next((axis.serve for axis in axes.values() if "serve" in axis.model_fields_set), None)
    section = described or ServeSection()
    facts = {"address": section.address, "port": section.port}
    try:
        with listening(ServerSettings.of(section)):
            pass
    except LivebodeError as error:
        failed = Check.of_error(DASHBOARD_PORT, error)
        verdict = failed.verdict if described is not None else "warning"
        return Check(DASHBOARD_PORT, verdict, failed.message, failed.remedy, facts | failed.facts)
    return Check(DASHBOARD_PORT, "ok", f"{section.address} port {section.port} is free", facts=facts)


CLOCK = "clock"
YEARS = range(2026, 2100)
"""An earlier year is a computer whose clock was never set."""
RESOLUTION_S_MAX = 1e-3
_STATUS_BYTES, _TIMEX_BYTES, _UNSYNCHRONISED = 40, 512, 0x40


def check_clock() -> Check:
    """The clock as it is now."""
    resolution_s = max(time.get_clock_info(name).resolution for name in ("time", "monotonic"))
    return judged_clock(time.time(), resolution_s, synchronised())


def judged_clock(now_s: float, resolution_s: float, in_step: bool | None) -> Check:
    """The check of a clock at `now_s` seconds since 1970; `in_step` is None where nobody says.

    >>> [judged_clock(now_s, 1e-9, True).verdict for now_s in (0.0, 1.8e9)], judged_clock(1.8e9, 1e-9, False).verdict
    (['failed', 'ok'], 'warning')
    """
    now = datetime.fromtimestamp(now_s, UTC)
    words = {True: "synchronised", False: "not synchronised", None: "whether it is synchronised cannot be seen"}
    message = f"{now:%Y-%m-%dT%H:%M:%SZ}, {words[in_step]}; resolution {resolution_s * 1e9:.3g} ns"
    facts = {"utc": f"{now:%Y-%m-%dT%H:%M:%SZ}", "resolution_s": resolution_s, "synchronised": in_step}
    if now.year not in YEARS:
        return Check(CLOCK, "failed", message, "set the clock; records and certificates rely on the date", facts)
    if resolution_s > RESOLUTION_S_MAX:
        return Check(CLOCK, "warning", message, "arrival times are coarse; choose another clock source", facts)
    if in_step is False:
        remedy = "enable NTP or PTP (chrony, systemd-timesyncd), or latencies and times of day are wrong"
        return Check(CLOCK, "warning", message, remedy, facts)
    return Check(CLOCK, "ok", message, facts=facts)


def synchronised() -> bool | None:
    """Whether Linux's clock is kept in step by NTP or PTP; None on other systems, or where it does not say."""
    if not sys.platform.startswith("linux"):
        return None
    timex = ctypes.create_string_buffer(_TIMEX_BYTES)  # modes = 0: nothing is set
    try:
        state = ctypes.CDLL(None, use_errno=True).adjtimex(timex)
    except (OSError, AttributeError):
        return None
    if state < 0 or ctypes.sizeof(ctypes.c_long) != 8:  # a container may forbid it; 32 bits have another layout
        return None
    status = int.from_bytes(timex.raw[_STATUS_BYTES : _STATUS_BYTES + 4], sys.byteorder)
    return not status & _UNSYNCHRONISED
