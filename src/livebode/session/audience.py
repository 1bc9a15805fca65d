"""Audience: who sees what a run publishes while it goes: a dashboard, a terminal."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from livebode.core import Block, Event, Parameters, Responses
from livebode.records import RunDirectory
from livebode.session.event_groups import EventGroups
from livebode.session.overview import Overview
from livebode.sources.live import KINDS, Health

if TYPE_CHECKING:
    from livebode.session.segmented import SegmentedRun

_URGENT = {"change", "backlog", "doubtful", "roles-doubtful", "baseline-unknown"}
_LOGGED_ELSEWHERE = {*KINDS, "configuration-applied", "configuration-refused"}
_logger = logging.getLogger(__name__)


class Audience:
    """Hears what a run publishes; this one does nothing with it.

    It is called in the thread that tracks, after the record has taken the same, so every method must return at once and
    may not raise. What it needs time for it does elsewhere, on what it kept; all that it is given is immutable.
    """

    def share(self, overview: Overview) -> None:
        """The thinned copy of the run that begins next, which grows with it: there need not be another one."""

    def begin(self, directory: Path, summary: Mapping[str, Any], health: Callable[[], Health] | None) -> None:
        """The run begins: where it is recorded, run.json as it begins, and how a live source is doing, at any time.

        It comes again behind a `finish` where an edited configuration makes another run go on with the next sample.
        """

    def set_clock(self, pieces: Sequence[tuple[float, float]]) -> None:
        """Which time of day the run's seconds are, as `RunClock` keeps it; again when it is known better."""

    def write(self, responses: Responses) -> None:
        """New responses; of a run that is gone on with first the newest from before."""

    def write_parameters(self, *parts: Parameters) -> None:
        """What was fitted to them, what follows from that, and margins."""

    def write_event(self, event: Event) -> None:
        """What a person should know."""

    def drain_events(self) -> list[Event]:
        """What the audience has to say since the last call, to be recorded: that somebody acknowledged an event."""
        return []

    def followed(self, block: Block) -> None:
        """All that comes of this Block has been published; a LiveBlock says when it arrived."""

    def finish(self, summary: Mapping[str, Any]) -> None:
        """The run has ended: run.json as it ends."""


class Relay(Audience):
    """Passes everything on to another audience; a subclass looks at what goes by."""

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
    """Where a run puts what comes of its samples: into the record first, then before the audience.

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
        """Publish the events that have waited long enough at `time_s` of the machine."""
        self._report(self._groups.due(time_s))

    def report_groups_while_silent(self, now_s: float) -> None:
        """The same at `now_s` of this computer, while the machine's time does not pass."""
        self._report(self._groups.due_while_silent(now_s))

    def finish_groups(self) -> None:
        """Publish all events that wait: nothing more will come."""
        self._report(self._groups.finish())

    def _report(self, events: list[Event]) -> None:
        for event in events:
            self._record.write_event(event)
            if event.kind not in _LOGGED_ELSEWHERE:
                level = logging.WARNING if event.kind in _URGENT else logging.INFO
                _logger.log(level, "%s: %s", self._record.path, event.message)
            self._audience.write_event(event)

    def drain_events(self) -> list[Event]:
        """What the audience wants recorded."""
        return self._audience.drain_events()
