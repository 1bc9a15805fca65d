"""One axis on a live source, until the source ends or is stopped, including changes of its configuration."""

from __future__ import annotations

import contextlib
import logging
import threading
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

from livebode.configuration.axis import Axis, RecordSection
from livebode.core import Event, LivebodeError
from livebode.core.clock import moments_by
from livebode.runtime import successors
from livebode.runtime.clock_relation import ClockRelation
from livebode.runtime.continuing import Before, StreamPosition, stream_position
from livebode.runtime.destination import Destination
from livebode.runtime.following import Outcome, Tracking
from livebode.runtime.orders import Orders
from livebode.runtime.pipeline import Pipeline
from livebode.sources.live import LiveSource, make_source

_logger = logging.getLogger(__name__)


def run_live(axis: Axis, to: Destination, orders: Orders | None = None) -> Outcome:
    """Track a machine while it works and write a run directory in segments.

    Ends with the source, or when `orders` request it; all received samples are then recorded. The same axis in the same
    directory continues the run with the sender's next sample; missing samples are a gap whose length follows from the
    sender's numbers. A change by `orders` finishes the run, and a new run next to it (NAME-2 and so on) continues with
    the next sample of the same source; the result is that of the last run.

    It waits for a machine that is not switched on yet, and reports this after `timeout_s`.

    Raises
    ------
    LivebodeError
        If the configuration is invalid, the machine rejects the connection, or the run is stopped before samples
        arrive.
    """
    orders = orders or Orders()
    source = make_source(axis.source)
    orders.of(source)
    position = StreamPosition() if to.force else stream_position(successors.newest(to.directory))
    if position.left_at is not None:
        source.resume(position.left_at)
    with source.open(partial(_late, to)), contextlib.ExitStack() as finishing:
        pipeline = Pipeline.live(axis, source)
        return _Succession(source, position, to, orders, finishing).run(pipeline)


def _late(to: Destination, why: str) -> None:
    """Report that a machine has not sent yet; without a run, the time is that of this computer."""
    event = Event("waiting", 0, time.time(), f"{why}; the axis waits: switch the machine on, or check the address")
    _logger.warning("%s", event.message)
    to.tell(event)
    to.audience.write_event(event)


class _Succession:
    """The runs of one open source; each continues with the next sample after the previous one."""

    def __init__(
        self,
        source: LiveSource,
        position: StreamPosition,
        to: Destination,
        orders: Orders,
        finishing: contextlib.ExitStack,
    ) -> None:
        self._source, self._position, self._to = source, position, to
        self._orders, self._finishing = orders, finishing
        self._relation = ClockRelation()

    def run(self, pipeline: Pipeline) -> Outcome:
        """The first run and all that follow, until the end."""
        with moments_by(self._relation.clock):
            return self._run(pipeline)

    def _run(self, pipeline: Pipeline) -> Outcome:
        from livebode.runtime.segmented import make_way  # needs a POSIX system

        directory, before, force = self._to.directory, None, self._to.force
        if force:
            for later in successors.all_of(directory)[:0:-1]:
                make_way(later)  # the newest first, so that after a kill the remaining ones are still consecutive
        else:
            directory = successors.newest(directory)
        while True:
            to = replace(self._to, directory=directory, force=force)
            tracking = self._tracking(pipeline, to, before)
            with contextlib.ExitStack() as leaving:
                leaving.enter_context(tracking)
                tracking.follow()
                following = None if self._orders.ended else self._orders.take_next()
                if following is None:
                    tracking.end()
                    outcome = tracking.finish()
                    break
                directory, force = successors.free(self._to.directory), False
                before = self._handed_over(tracking, following, directory)
                self._finish_beside(tracking, leaving.pop_all())
                pipeline = following
        to.audience.finish(outcome.summary)
        return outcome

    def _tracking(self, pipeline: Pipeline, to: Destination, before: Before | None) -> Tracking:
        axis = pipeline.axis
        assert axis is not None
        about = {
            # Most keys of a source apply to other kinds of source.
            "configuration": axis.model_dump(mode="json", exclude={"serve", "source"})
            | {"source": axis.source.model_dump(mode="json", exclude_defaults=True)},
            "found": {"format": self._source.format, "rate_from": "the sender"},
        }
        return Tracking(
            self._source,
            pipeline,
            to,
            about=about,
            kept=axis.record or RecordSection(),
            again=False,
            orders=self._orders,
            position=self._position,
            before=before,
            relation=self._relation,
            until=self._orders.changing,
        )

    def _handed_over(self, tracking: Tracking, following: Pipeline, directory: Path) -> Before:
        """End a run; the next one continues with as much of its state as possible."""
        goes_on = following.take_over(tracking.pipeline)
        tracking.end(directory.name, handed_over=goes_on)
        tracking.to.audience.finish(tracking.summary)
        counts = dict(following.follower.counts) if goes_on else {}
        return Before(tracking.to.directory.name, *tracking.position, counts)

    def _finish_beside(self, tracking: Tracking, leaving: contextlib.ExitStack) -> None:
        """Draw its pictures and close it while the next one continues."""

        def finish() -> None:
            try:
                with moments_by(self._relation.clock), leaving:
                    tracking.finish()
            except LivebodeError as error:
                _logger.error("%s: %s", tracking.to.directory, error)
                self._to.tell(Event("record-unfinished", *tracking.position, str(error)))

        thread = threading.Thread(target=finish, name="livebode finishing")
        thread.start()
        self._finishing.callback(thread.join)
