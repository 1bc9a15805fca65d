"""`run`: the entrance to the run loop for an axis."""

from __future__ import annotations

import time

from livebode.configuration import NOT_RECORDED, Axis, open_recordings
from livebode.core import RunClock, moments_by
from livebode.estimates import rule
from livebode.runtime.allocation import keep_freed_memory
from livebode.runtime.documents import RunStep
from livebode.runtime.estimate import ExaminedRecording, Outcome
from livebode.runtime.feed import Feed
from livebode.runtime.recorder import Destination
from livebode.runtime.run_control import RunControl
from livebode.runtime.run_loop import RunLoop
from livebode.runtime.summary import provenance


def run(axis: Axis, to: Destination, control: RunControl | None = None) -> Outcome:
    """Track a recording or several, or a machine while it works, and write a run directory.

    A recording is written at once, or with a journal if the axis has a [record]. A live source is always recorded in
    segments, and ends with its sender or when `control` requests it; all received samples are then recorded. The same
    axis in the same directory continues an unfinished run: a live source with the sender's next sample, where missing
    samples are a gap whose length follows from the sender's numbers. A change of the configuration by `control`
    finishes the run, and a new run next to it (NAME-2 and so on) continues with the next sample of the same source; the
    result is that of the last run. A machine that is not switched on yet is waited for, and reported after `timeout_s`.

    Raises
    ------
    LivebodeError
        For any error in the recording or the configuration, if the machine rejects the connection, or if the run is
        stopped before samples arrive. At once nothing is written; with a journal what was recorded so far remains.
    StoppedError
        If `control` ends a recording before its end; the directory is as for an error.
    """
    control, started = control or RunControl(), time.perf_counter()
    keep_freed_memory()
    kind = axis.kind
    if not axis.source.live:
        to.announce(RunStep("opening"))
    named, logs = open_recordings(axis)
    if not logs:  # the source is live
        from livebode.runtime.live import run_live

        return run_live(axis, to, control)
    of: ExaminedRecording = rule(kind, "recording")(named, logs, to)
    about = {"configuration": of.axis.model_dump(mode="json", exclude=NOT_RECORDED, by_alias=True), "found": of.found}
    about |= provenance(of.axis, of.digests)
    feed = Feed(of.source, control, noticed=of.noticed, recorded=of.recorded, started=started)
    loop = RunLoop(feed, of.estimate, to, about=about, segments=of.axis.record)
    to.announce(RunStep("tracking"))
    with moments_by(RunClock.of_kind(of.clock)):
        return loop.run()
