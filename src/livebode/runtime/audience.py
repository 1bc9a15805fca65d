"""Audience: receivers of what a run publishes while it runs, such as a dashboard or a terminal."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from livebode.analysis.overview import Overview
from livebode.core import Block, Event, Parameters, Responses
from livebode.records import RunDirectory
from livebode.runtime.event_groups import EventGroups
from livebode.sources.live import KINDS, Health

if TYPE_CHECKING:
    from livebode.runtime.segmented import SegmentedRun

_URGENT = {"change", "backlog", "doubtful", "roles-doubtful", "baseline-unknown"}
_LOGGED_ELSEWHERE = {*KINDS, "configuration-applied", "configuration-refused"}
_logger = logging.getLogger(__name__)


class Audience:
    """Receives what a run publishes; this class ignores it.

    Its methods are called in the tracking thread, after the record was written, so they must return at once and must
    not raise. Longer work must be done in another thread; all arguments are immutable.
    """

    def share(self, overview: Overview) -> None:
        """Receives the thinned copy of the next run, which grows with it, so that no second copy is needed."""

    def begin(self, directory: Path, summary: Mapping[str, Any], health: Callable[[], Health] | None) -> None:
        """The run begins: its directory, the initial run.json, and a function for the present health of a live source.

        It is called again after `finish` if an edited configuration makes another run continue with the next sample.
        """

    def set_clock(self, pieces: Sequence[tuple[float, float]]) -> None:
        """Relation of the run's seconds to the time of day, as in `RunClock`; called again when it is more accurate."""

    def write(self, responses: Responses) -> None:
        """New responses; when a run continues, first the newest previous ones."""

    def write_parameters(self, *parts: Parameters) -> None:
        """Fitted parameters of the responses, quantities derived from them, and margins."""

    def write_event(self, event: Event) -> None:
        """An event that a person should know."""

    def drain_events(self) -> list[Event]:
        """Events from the audience since the last call, to be recorded: a person acknowledged an event."""
        return []

    def followed(self, block: Block) -> None:
        """All results of this Block are published; a LiveBlock contains its time of arrival."""

    def finish(self, summary: Mapping[str, Any]) -> None:
        """The run ended: the final run.json."""


class Relay(Audience):
    """Forwards everything to another audience; a subclass can inspect it."""

    def __init__(self, audience: Audience) -> None:
        self._audience = audience

    def share(self, overview: Overview) -> None:
        self._audience.share(overview)

    def begin(self, directory: Path, summary: Mapping[str, Any], health: Callable[[], Health] | None) -> None:
        self._audience.begin(directory, summary, health)

    def set_clock(self, pieces: Sequence[tuple[float, float]]) -> None:
        self._audience.set_clock(pieces)

    def write(self, responses: Responses) -> None:
        self._audience.write(responses)

    def write_parameters(self, *parts: Parameters) -> None:
        self._audience.write_parameters(*parts)

    def write_event(self, event: Event) -> None:
        self._audience.write_event(event)

    def drain_events(self) -> list[Event]:
        return self._audience.drain_events()

    def followed(self, block: Block) -> None:
        self._audience.followed(block)

    def finish(self, summary: Mapping[str, Any]) -> None:
        self._audience.finish(summary)


class Outlet:
    """Publishes the results of a run: first to the record, then to the audience.

    Events go through `groups`, and are logged where their source has not done so.
    """

    def __init__(self, record: RunDirectory | SegmentedRun, audience: Audience, groups: EventGroups) -> None:
        self._record, self._audience, self._groups = record, audience, groups

    def write(self, responses: Responses) -> None:
        if len(responses):
            self._record.write(responses)
            self._audience.write(responses)

    def write_parameters(self, *parts: Parameters) -> None:
        self._record.write_parameters(*parts)
        self._audience.write_parameters(*parts)

    def write_event(self, event: Event) -> None:
        self._report(self._groups.take(event))

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
            self._record.write_event(event)
            if event.kind not in _LOGGED_ELSEWHERE:
                level = logging.WARNING if event.kind in _URGENT else logging.INFO
                _logger.log(level, "%s: %s", self._record.path, event.message)
            self._audience.write_event(event)

    def drain_events(self) -> list[Event]:
        """Record the events from the audience."""
        return self._audience.drain_events()
