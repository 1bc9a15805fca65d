"""Common part of Watch and SpectraWatch: counts and Events of a stream with gaps."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from livebode.core import Block, Event


class Counted:
    """Counts and Events of a stream of Blocks.

    Events are appended to `events`. `kinds` are reasons for exclusion, `also` further counts, and `last` the sample at
    which each kind was before the first one.
    """

    def __init__(self, events: list[Event], kinds: Iterable[str], last: int, also: tuple[str, ...] = ()) -> None:
        self._kinds = tuple(kinds)
        self._next = -1
        self._last = dict.fromkeys(self._kinds, last)
        self.counts = dict.fromkeys(("samples", "gaps", "missing", *also, *self._kinds), 0)
        self._events = events

    def state(self) -> dict[str, NDArray[np.generic]]:
        return {
            "next": np.array([self._next]),
            "last": np.array(list(self._last.values())),
            "counts": np.array(list(self.counts.values())),
        }

    def load(self, state: dict[str, NDArray[np.generic]]) -> None:
        self._next = int(state["next"][0])
        self._last = dict(zip(self._kinds, (int(n) for n in state["last"])))
        self.counts = dict(zip(self.counts, (int(n) for n in state["counts"])))

    def _report(self, kind: str, block: Block, sample: int, message: str, **details: int) -> None:
        self._events.append(Event(kind, sample, block.origin_s + sample / block.rate_hz, message, dict(details)))
