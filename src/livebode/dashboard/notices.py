"""Notices: a run's events as the page shows them, and who has seen them."""

from __future__ import annotations

import hashlib
from typing import Any

from livebode.nouns import Event

ACKNOWLEDGED = "acknowledged"
NOTICES_MAX = 2000
_PLAIN_MAX = 4000  # letters of a message


class Notices:
    """The newest events of a run, with those that somebody acknowledged marked."""

    def __init__(self) -> None:
        self.version = 0
        self.counts: dict[str, int] = {}
        self._shown: dict[str, dict[str, Any]] = {}

    def take(self, event: Event) -> None:
        """An event, or that another one was acknowledged."""
        self.version += 1
        if event.kind == ACKNOWLEDGED:
            if (seen := self._shown.get(str(event.details.get("event")))) is not None:
                seen |= {"acknowledged": True, "changed": self.version}
            return
        key = event_id(event)
        if key not in self._shown:
            self.counts[event.kind] = self.counts.get(event.kind, 0) + 1
        self._shown.setdefault(key, {"acknowledged": False}).update(
            id=key, kind=event.kind, time_s=event.time_s, message=event.message[:_PLAIN_MAX], changed=self.version
        )
        while len(self._shown) > NOTICES_MAX:
            self._shown.pop(next(iter(self._shown)))

    def of(self, key: str) -> dict[str, Any] | None:
        """One that is shown."""
        return self._shown.get(key)

    def since(self, version: int) -> list[dict[str, Any]]:
        """Those that came or changed after `version`, oldest first."""
        return [shown for shown in self._shown.values() if shown["changed"] > version]


def event_id(event: Event) -> str:
    """A name for an event that is the same whenever the record is read."""
    text = f"{event.kind}\0{event.sample}\0{event.time_s!r}\0{event.message}"
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:16]


def acknowledgement(shown: dict[str, Any], sample: int, time_s: float) -> Event:
    """The event that records that a person has seen another."""
    details = {"event": shown["id"], "kind": shown["kind"], "time_s": shown["time_s"]}
    return Event(ACKNOWLEDGED, sample, time_s, f"acknowledged: {shown['message']}", details)
