"""The computer's clock: its date, its resolution, and whether it is synchronised."""

from __future__ import annotations

import ctypes
import sys
import time
from datetime import UTC, datetime

from livebode.doctor.check import Check

NAME = "clock"
YEARS = range(2026, 2100)
"""An earlier year is a computer whose clock was never set."""
RESOLUTION_S_MAX = 1e-3
_STATUS_BYTES, _TIMEX_BYTES, _UNSYNCHRONISED = 40, 512, 0x40


def check_clock() -> Check:
    """The clock as it is now."""
    resolution_s = max(time.get_clock_info(name).resolution for name in ("time", "monotonic"))
    return judged(time.time(), resolution_s, synchronised())


def judged(now_s: float, resolution_s: float, in_step: bool | None) -> Check:
    """The check of a clock at `now_s` seconds since 1970; `in_step` is None where nobody says.

    >>> judged(0.0, 1e-9, True).verdict, judged(1.8e9, 1e-9, True).verdict, judged(1.8e9, 1e-9, False).verdict
    ('failed', 'ok', 'warning')
    """
    now = datetime.fromtimestamp(now_s, UTC)
    words = {True: "synchronised", False: "not synchronised", None: "whether it is synchronised cannot be seen"}
    message = f"{now:%Y-%m-%dT%H:%M:%SZ}, {words[in_step]}; resolution {resolution_s * 1e9:.3g} ns"
    facts = {"utc": f"{now:%Y-%m-%dT%H:%M:%SZ}", "resolution_s": resolution_s, "synchronised": in_step}
    if now.year not in YEARS:
        return Check(NAME, "failed", message, "set the clock; records and certificates rely on the date", facts)
    if resolution_s > RESOLUTION_S_MAX:
        return Check(NAME, "warning", message, "arrival times are coarse; choose another clock source", facts)
    if in_step is False:
        remedy = "enable NTP or PTP (chrony, systemd-timesyncd), or latencies and times of day are wrong"
        return Check(NAME, "warning", message, remedy, facts)
    return Check(NAME, "ok", message, facts=facts)


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
