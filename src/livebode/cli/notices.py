"""Notices: the events of a run that the terminal shows immediately."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

from livebode.core import Event
from livebode.runtime import Document, TrackerResults

_KINDS = {
    "roles-doubtful", "transient", "outlying-periods", "phase-slip", "phase-slips", "restart", "replaced",
    "computer-clock", "foreign", "backlog", "backlog-cleared", "waiting", "window-doubtful",
    "drift", "response-changes", "periodic-variation", "not-periodic", "distortion-levels", "best-linear-approximation",
    "recordings-differ", "uneven-clock", "long-recording", "trend-subtracted", "spikes-subtracted", "signal-drifts",
    "unwrapped", "suppressed", "sink-down", "sink-up", "sink-full", "sink-refused",
}  # fmt: skip
_ONCE = {"foreign", "suppressed"}
_PERCENT_EVERY_S = 0.2


class NoticePrinter:
    """A subscriber that prints events on which a person must act: on the record, the signals, the sender.

    Of a kind that repeats with every batch only the first is shown.
    """

    def __init__(self, show: Callable[[str], None]) -> None:
        self._show = show
        self._shown: set[str] = set()

    def __call__(self, document: Document) -> None:
        if not isinstance(document, Event) or (document.kind in _ONCE and document.kind in self._shown):
            return
        if document.kind in _KINDS or document.kind.startswith("record-"):
            self._shown.add(document.kind)
            self._show(document.message)


class PercentPrinter:
    """A subscriber that prints how far a run is, for a program that reads it: a line for a percent, a few a second."""

    def __init__(self) -> None:
        self._percent, self._printed_s = -1, float("-inf")

    def __call__(self, document: Document) -> None:
        if not isinstance(document, TrackerResults) or not document.samples_total:
            return
        percent = 100 * document.samples // document.samples_total
        if percent > self._percent and time.monotonic() - self._printed_s > _PERCENT_EVERY_S:
            self._percent, self._printed_s = percent, time.monotonic()
            print(f"livebode: {percent} % of {document.samples_total} samples", file=sys.stderr, flush=True)
