"""One axis on a live source, until the source ends or is stopped, including changes of its configuration."""

from __future__ import annotations

import contextlib
import logging
import threading
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

from livebode.configuration import NOT_RECORDED, Axis, RecordSection
from livebode.core import ConfigError, Event, LivebodeError, moments_by
from livebode.estimates import rule
from livebode.language import Message
from livebode.runtime import successors
from livebode.runtime.clock_relation import ClockRelation
from livebode.runtime.continuing import PreviousRun, StreamPosition, stream_position
from livebode.runtime.estimate import Estimate, Outcome
from livebode.runtime.live_feed import LiveFeed
from livebode.runtime.recorded_run import source_of
from livebode.runtime.recorder import Destination
from livebode.runtime.run_control import RunControl
from livebode.runtime.run_loop import RunLoop
from livebode.runtime.summary import provenance
from livebode.sources.live import LiveSource, ReplaySource

_logger = logging.getLogger(__name__)


def run_live(axis: Axis, to: Destination, control: RunControl) -> Outcome:
    """Track a machine until its source ends or is stopped, in as many runs as its configuration has changes."""
    _check_apart(axis.source.replay, to.directory)
    source = source_of(axis.source)
    control.controls(source)
    position = StreamPosition() if to.force else stream_position(successors.newest(to.directory))
    if position.left_at is not None:
        source.resume(position.left_at)
    with source.open(partial(_report_late, to, source)), contextlib.ExitStack() as finishing:
        estimate = rule(axis.kind, "estimate").live(axis, source)
        return _Succession(source, position, to, control, finishing).run(estimate)


def _check_apart(replayed: Path | None, directory: Path) -> None:
    """ConfigError if the run would be written where its own samples are: force would remove them."""
    if replayed is not None and replayed.resolve() in [path.resolve() for path in successors.all_of(directory)]:
        raise ConfigError(
            "key-conflict",
            f"source.replay is {str(replayed)!r}, and so is the directory of the run",
            "choose another directory for the run",
            key="source.replay",
            path=str(replayed),
        )


def _report_late(to: Destination, source: LiveSource, why: str) -> None:
    """Report that a machine has not sent yet; without a run, the time is that of this computer."""
    if source.unusable:  # switching the machine on would not help: it sends
        message = Message("{why}; the axis waits: compare the sender with [source]", why=why)
    else:
        message = Message("{why}; the axis waits: switch the machine on, or check the address", why=why)
    event = Event("waiting", 0, time.time(), message)
    _logger.warning("%s", event.message)
    to.announce(event)


class _Succession:
    """The runs of one open source; each continues with the next sample after the previous one."""

    def __init__(
        self,
        source: LiveSource,
        position: StreamPosition,
        to: Destination,
        control: RunControl,
        finishing: contextlib.ExitStack,
    ) -> None:
        self._source, self._position, self._to = source, position, to
        self._control, self._finishing = control, finishing
        self._relation = ClockRelation()
        if isinstance(source, ReplaySource):
            self._relation.clock.pieces = list(source.clock.pieces)

    def run(self, estimate: Estimate) -> Outcome:
        """The first run and all that follow, until the end."""
        with moments_by(self._relation.clock):
            return self._run(estimate)

    def _run(self, estimate: Estimate) -> Outcome:
        from livebode.runtime.segmented import make_way  # needs a POSIX system

        directory, previous, force = self._to.directory, None, self._to.force
        if force:
            for later in successors.all_of(directory)[:0:-1]:
                make_way(later)  # the newest first, so that after a kill the remaining ones are still consecutive
        else:
            directory = successors.newest(directory)
        while True:
            to = replace(self._to, directory=directory, force=force)
            loop = self._loop(estimate, to, previous)
            with contextlib.ExitStack() as leaving:
                leaving.enter_context(loop)
                loop.follow()
                following = None if self._control.ended else self._control.take_next()
                if following is None:
                    loop.end()
                    outcome = loop.finish()
                    break
                directory, force = successors.free(self._to.directory), False
                previous = self._hand_over(loop, estimate, following, directory)
                self._finish_beside(loop, leaving.pop_all())
                estimate = following
        loop.publish_end()
        return outcome

    def _loop(self, estimate: Estimate, to: Destination, previous: PreviousRun | None) -> RunLoop:
        axis = estimate.axis
        assert axis is not None
        about = {
            # Most keys of a source apply to other kinds of source.
            "configuration": axis.model_dump(mode="json", exclude=NOT_RECORDED | {"source"}, by_alias=True)
            | {"source": axis.source.model_dump(mode="json", exclude_defaults=True, by_alias=True)},
            **provenance(axis),
            "found": {"format": self._source.format, "rate_from": "the sender", "clock": "relative"},
        }
        feed = LiveFeed(self._source, self._control, self._position, previous, self._relation)
        return RunLoop(feed, estimate, to, about=about, segments=axis.record or RecordSection())

    def _hand_over(self, loop: RunLoop, estimate: Estimate, following: Estimate, directory: Path) -> PreviousRun:
        """End a run; the next one continues with as much of its state as possible."""
        continues = following.take_over(estimate)
        loop.end(directory.name, handed_over=continues)
        loop.publish_end()
        counts = dict(following.counts) if continues else {}
        return PreviousRun(loop.to.directory.name, *loop.position, counts)

    def _finish_beside(self, loop: RunLoop, leaving: contextlib.ExitStack) -> None:
        """Draw its pictures and close it while the next one continues."""

        def finish() -> None:
            try:
                with moments_by(self._relation.clock), leaving:
                    loop.finish()
            except LivebodeError as error:
                _logger.error("%s: %s", loop.to.directory, error)
                self._to.announce(Event("record-unfinished", *loop.position, error.words))

        thread = threading.Thread(target=finish, name="livebode finishing")
        thread.start()
        self._finishing.callback(thread.join)
