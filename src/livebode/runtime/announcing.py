"""Events of a live source that the terminal shows immediately, in addition to the record."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from livebode.core import Event

_EACH = {"restart", "replaced", "computer-clock"}
_FIRST = {"foreign"}


class Announcing:
    """Selects events after which samples are missing or are from another sender, because a person must act on them.

    Of events that repeat with every batch only the first is shown.
    """

    def __init__(self) -> None:
        self._shown: set[str] = set()

    def of(self, events: Iterable[Event]) -> Iterator[Event]:
        """The events that the terminal shows."""
        for event in events:
            if event.kind in _EACH or (event.kind in _FIRST and event.kind not in self._shown):
                self._shown.add(event.kind)
                yield event
