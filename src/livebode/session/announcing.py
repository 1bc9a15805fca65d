"""Which events of a live source the terminal shows at once, beside the record."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from livebode.core import Event

_EACH = {"restart", "replaced", "computer-clock"}
_FIRST = {"foreign"}


class Announcing:
    """Picks the events after which samples are missing or another sender's, for somebody must look after them.

    Of those that come again with every batch only the first is shown.
    """

    def __init__(self) -> None:
        self._shown: set[str] = set()

    def of(self, events: Iterable[Event]) -> Iterator[Event]:
        """Those of these events that the terminal shows."""
        for event in events:
            if event.kind in _EACH or (event.kind in _FIRST and event.kind not in self._shown):
                self._shown.add(event.kind)
                yield event
