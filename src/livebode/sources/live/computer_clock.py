"""This computer's clocks over a restart of the process: length of the pause, and whether it is reliable."""

from __future__ import annotations

import time
from datetime import UTC, datetime
from functools import cache
from pathlib import Path

from livebode.dataclass import dataclass
from livebode.language import Message

SET_S = 1.0
"""A clock whose advance differs by more than this from that of the time since boot was set during the pause."""
LONGEST_S = 30 * 86400.0
"""A longer pause over a restart of the computer is treated as a wrong clock."""
_BOOT = Path("/proc/sys/kernel/random/boot_id")


@dataclass(frozen=True)
class ClockReading:
    """Seconds since 1970 (this clock can be set) and since boot; `boot` identifies the boot."""

    unix_s: float
    uptime_s: float
    boot: str

    @classmethod
    def at(cls, monotonic_s: float) -> ClockReading:
        """The clocks when `time.monotonic()` was `monotonic_s`."""
        ago_s = time.monotonic() - monotonic_s
        return cls(time.time() - ago_s, _uptime_s() - ago_s, _boot())


def _uptime_s() -> float:
    """Seconds since boot; where the system has such a clock, also those during which the computer slept."""
    clock = getattr(time, "CLOCK_BOOTTIME", None)
    return time.monotonic() if clock is None else time.clock_gettime(clock)


@dataclass(frozen=True)
class Pause:
    """Length of a pause; None if no clock gives it. `remark`: what is wrong with the clock, and what to do."""

    seconds: float | None
    remark: str = ""


def pause(before: ClockReading, now: ClockReading) -> Pause:
    """The time between two readings.

    >>> pause(ClockReading(1e9, 50.0, "a"), ClockReading(1e9 - 3580.0, 70.0, "a"))
    Pause(seconds=20.0, remark="this computer's clock was set by -3600 s during the pause; check its date and time")
    """
    by_clock_s = now.unix_s - before.unix_s
    if before.boot and before.boot == now.boot:
        by_uptime_s = max(0.0, now.uptime_s - before.uptime_s)
        step_s = by_clock_s - by_uptime_s
        remark = Message(
            "this computer's clock was set by {set_by_s:+.0f} s during the pause; check its date and time",
            set_by_s=step_s,
        )
        return Pause(by_uptime_s, remark if abs(step_s) > SET_S else "")
    if 0 <= by_clock_s <= LONGEST_S:
        return Pause(by_clock_s)
    return Pause(
        None,
        Message(
            "this computer's clock shows {now}, and showed {before} at the end of the record, so the pause is unknown; "
            "set its date and time",
            now=_shown(now),
            before=_shown(before),
        ),
    )


def _shown(reading: ClockReading) -> str:
    return datetime.fromtimestamp(reading.unix_s, UTC).isoformat(" ", "seconds")


@cache
def _boot() -> str:
    try:
        return _BOOT.read_text("ascii").strip()
    except OSError:
        return ""
