"""Status of an axis, for other threads."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from livebode.core import Block, Event, Responses
from livebode.runtime.audience import Audience, Relay
from livebode.sources.live import Health, LiveBlock

_LATENCY_OVER_S = 2.0


class Status(Relay):
    """Keeps the data for a status line of the axis, and forwards everything to the audience.

    Attributes
    ----------
    state
        "waiting", "tracking", "finishing", "done", "refused", or "ended" before there was anything to record.
    directory
        Directory of its newest run.
    samples, responses
        Number of tracked samples and published responses.
    rate_hz
        Samples per second of the Blocks; None before the first.
    event
        The newest event.
    health
        State of its live source; None for a recording.
    """

    def __init__(self, audience: Audience) -> None:
        super().__init__(audience)
        self.state = "waiting"
        self.directory: Path | None = None
        self.samples = self.responses = 0
        self.rate_hz: float | None = None
        self.event: Event | None = None
        self.health: Callable[[], Health] | None = None
        self._since_s = 0.0
        self._latest: tuple[float, float] = (0.0, 0.0)

    @property
    def latency_s(self) -> float | None:
        """Longest time, in the last seconds, from a Block's arrival until all its results were published."""
        longest = max(self._latest)
        return longest if longest > 0 else None

    def begin(self, directory: Path, summary: Mapping[str, Any], health: Callable[[], Health] | None) -> None:
        self.state, self.directory, self.health = "tracking", directory, health
        super().begin(directory, summary, health)

    def write(self, responses: Responses) -> None:
        self.responses += len(responses)
        super().write(responses)

    def write_event(self, event: Event) -> None:
        self.event = event
        super().write_event(event)

    def followed(self, block: Block) -> None:
        self.samples += len(block)
        self.rate_hz = block.rate_hz
        if isinstance(block, LiveBlock):
            now = time.monotonic()
            if now - self._since_s > _LATENCY_OVER_S:
                self._since_s, self._latest = now, (0.0, self._latest[0])
            self._latest = (max(self._latest[0], now - block.arrived_s), self._latest[1])
        super().followed(block)
