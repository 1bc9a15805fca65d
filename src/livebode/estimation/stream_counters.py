"""Common part of Watch and SpectraWatch: counts and Events of a stream with gaps."""

from __future__ import annotations

from collections.abc import Iterable

from livebode.core import Block, Event, StatefulBase


class StreamCounters(StatefulBase):
    """Counts and Events of a stream of Blocks.

    Events are appended to `events`. `kinds` are reasons for exclusion, `also` further counts, and `last` the sample at
    which each kind was before the first one.
    """

    _STATE = ("_next", "_last", "counts")

    def __init__(self, events: list[Event], kinds: Iterable[str], last: int, also: tuple[str, ...] = ()) -> None:
        self._kinds = tuple(kinds)
        self._next = -1
        self._last = dict.fromkeys(self._kinds, last)
        self.counts = dict.fromkeys(("samples", "gaps", "missing", *also, *self._kinds), 0)
        self._events = events

    def _report(self, kind: str, block: Block, sample: int, message: str, **details: int) -> None:
        self._events.append(Event(kind, sample, block.origin_s + sample / block.rate_hz, message, dict(details)))
