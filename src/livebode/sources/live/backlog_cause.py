"""BacklogCause: why samples wait, for the advice: the disk of the record, or tracking."""

from __future__ import annotations

import time

from livebode.language import Message

SHORT_S = 1.0
"""A backlog below this needs no advice."""
_DISK = Message("the record waits for the disk: use a faster disk for the run, or a longer record.segment_s")
_TRACKING = Message("use a longer tracking.hop, fewer lines or fewer axes on this computer")


class BacklogCause:
    """How much of the time since the backlog began its reader waited for the record: while it is in the context."""

    def __init__(self) -> None:
        self._began_s = time.monotonic()
        self._disk_s = 0.0
        self._waits_since_s: float | None = None

    def take(self, waiting_s: float, now_s: float) -> None:
        """So much waits now."""
        if waiting_s < SHORT_S:
            self._began_s, self._disk_s = now_s, 0.0

    def __enter__(self) -> None:
        self._waits_since_s = time.monotonic()

    def __exit__(self, *_: object) -> None:
        assert self._waits_since_s is not None
        self._disk_s += time.monotonic() - max(self._waits_since_s, self._began_s)
        self._waits_since_s = None

    @property
    def advice(self) -> str:
        """What reduces the present backlog; any thread may ask."""
        now_s, began_s, since_s = time.monotonic(), self._began_s, self._waits_since_s
        disk_s = self._disk_s + (0.0 if since_s is None else now_s - max(since_s, began_s))
        return _DISK if disk_s > 0.5 * (now_s - began_s) else _TRACKING
