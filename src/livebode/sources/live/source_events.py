"""Reports of a live source: counts without limit, Events at a limited rate."""

from __future__ import annotations

import logging
import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping
from typing import Any

from livebode.core import Event

KINDS = (
    "connected", "disconnected", "refused", "loss", "repeat", "reordered", "restart", "clock-jump", "wrong-rate",
    "layout-changed", "unit-changed", "malformed", "foreign", "overflow", "resumed", "replaced", "computer-clock",
)  # fmt: skip
"""Kinds of Events of live sources; docs/how-to/live.md explains them."""

LEVELS = dict.fromkeys(KINDS, logging.WARNING) | {
    "connected": logging.INFO,
    "resumed": logging.INFO,
    "computer-clock": logging.INFO,
    "repeat": logging.DEBUG,
    "reordered": logging.DEBUG,
    "refused": logging.ERROR,
}
"""The level at which each kind is logged."""

BURST = 50
PER_SECOND = 5.0
PENDING_MAX = 1000
MESSAGE_MAX = 500


class SourceEvents:
    """Collects Events from any thread. Of each kind at most 50 at once, then 5 per second.

    The others are counted, and the next Event of their kind gives their number in ``details["more"]``: a flood of
    invalid data fills neither memory nor disk.

    Parameters
    ----------
    clock
        Seconds.
    log
        Called with the level and the message of each Event.
    """

    def __init__(
        self, clock: Callable[[], float] = time.monotonic, log: Callable[[int, str], None] = lambda *_: None
    ) -> None:
        self._clock, self._log = clock, log
        self._lock = threading.Lock()
        self._events: list[Event] = []
        self._tokens: dict[str, tuple[float, float]] = {}
        self._held: Counter[str] = Counter()
        self._counts = Counter(dict.fromkeys(KINDS, 0))
        self.position: tuple[int, float] = (0, 0.0)
        """Sample and time of Events that do not specify them."""

    @property
    def counts(self) -> dict[str, int]:
        """Number of Events of each kind."""
        with self._lock:
            return dict(self._counts)

    @property
    def pending(self) -> int:
        """Number of Events since the last `take`."""
        return len(self._events)

    @property
    def rates(self) -> dict[str, Any]:
        """Where it is, and which events it may create when, as plain data; `continue_at` takes it."""
        tokens = {kind: list(self._tokens[kind]) for kind in sorted(self._tokens)}
        return {"tokens": tokens, "held": dict(sorted(self._held.items())), "position": list(self.position)}

    def continue_at(self, rates: Mapping[str, Any]) -> None:
        """Continue where another one was; ValueError, TypeError or LookupError if that is not plain data of `rates`."""
        tokens = {str(kind): (float(room), float(then)) for kind, (room, then) in rates["tokens"].items()}
        held = Counter({str(kind): int(count) for kind, count in rates["held"].items()})
        sample, time_s = rates["position"]
        self._tokens, self._held, self.position = tokens, held, (int(sample), float(time_s))

    def report(
        self, kind: str, message: str, *, sample: int | None = None, rate_hz: float = 0.0, **details: Any
    ) -> None:
        """Count `kind`, and create an Event if the rate allows it."""
        with self._lock:
            self._counts[kind] += 1
            if not self._room(kind):
                self._held[kind] += 1
                return
            at, time_s = self.position if sample is None else (sample, sample / rate_hz)
            if held := self._held.pop(kind, 0):
                details["more"] = held
            message = message if len(message) <= MESSAGE_MAX else message[:MESSAGE_MAX]
            self._events.append(Event(kind, at, time_s, message, details))
        self._log(LEVELS.get(kind, logging.WARNING), f"{message} ({held} more of this kind)" if held else message)

    def take(self) -> list[Event]:
        """Events since the last call."""
        if not self._events:
            return []
        with self._lock:
            events, self._events = self._events, []
        return events

    def _room(self, kind: str) -> bool:
        if len(self._events) >= PENDING_MAX:
            return False
        now = self._clock()
        tokens, then = self._tokens.get(kind, (float(BURST), now))
        tokens = min(float(BURST), tokens + (now - then) * PER_SECOND)
        self._tokens[kind] = (tokens - 1 if tokens >= 1 else tokens, now)
        return tokens >= 1
