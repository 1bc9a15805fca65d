"""Stream: publishes the documents of a run, first to its record, then to its subscribers."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from livebode.core import Event
from livebode.runtime.documents import Document, Subscriber
from livebode.runtime.event_groups import EventGroups
from livebode.sources.live import KINDS

if TYPE_CHECKING:
    from livebode.runtime.recorder import Recorder

_URGENT = {"change", "backlog", "doubtful", "roles-doubtful", "window-doubtful", "baseline-unknown", "not-monitored"}
_LOGGED_ELSEWHERE = {*KINDS, "configuration-applied", "configuration-refused"}
_logger = logging.getLogger(__name__)


class Stream:
    """The one path from a run to its record and its subscribers.

    Events go through `groups`, and are logged where their source has not done so.
    """

    def __init__(self, recorder: Recorder, subscribers: Sequence[Subscriber], groups: EventGroups) -> None:
        self._recorder, self._subscribers, self._groups = recorder, subscribers, groups

    def publish(self, document: Document) -> None:
        """Record it, then pass it to every subscriber; an event in its group, or later."""
        if isinstance(document, Event):
            self._report(self._groups.take(document))
            return
        self._recorder.take(document)
        self.announce(document)

    def publish_all(self, documents: Iterable[Document]) -> None:
        """Publish several, in this order."""
        for document in documents:
            self.publish(document)

    def announce(self, document: Document) -> None:
        """Pass it to every subscriber without recording it: it is in the record already, or is not for it."""
        for subscriber in self._subscribers:
            subscriber(document)

    def report_groups(self, time_s: float) -> None:
        """Publish the events that waited long enough at machine time `time_s`."""
        self._report(self._groups.due(time_s))

    def report_groups_while_silent(self, now_s: float) -> None:
        """The same at `now_s` of this computer, while the machine time does not advance."""
        self._report(self._groups.due_while_silent(now_s))

    def finish_groups(self) -> None:
        """Publish all waiting events, at the end of the run."""
        self._report(self._groups.finish())

    def _report(self, events: list[Event]) -> None:
        for event in events:
            self._recorder.take(event)
            if event.kind not in _LOGGED_ELSEWHERE:
                level = logging.WARNING if event.kind in _URGENT else logging.INFO
                _logger.log(level, "%s: %s", self._recorder.path, event.message)
            self.announce(event)
