"""One run on a live source: until the source ends, or somebody ends it."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from livebode.session.audience import Audience
from livebode.session.axis import Axis, RecordSection
from livebode.session.fits import Fits
from livebode.session.plan import live_follower
from livebode.session.tracking import Draw, Outcome, Progress, Tell, record
from livebode.session.watching import make_watching
from livebode.sources.live import LiveSource, open_source

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


def run_live(
    axis: Axis,
    directory: Path,
    *,
    force: bool = False,
    progress: Progress,
    draw: Draw,
    tell: Tell = lambda _: None,
    audience: Audience | None = None,
) -> Outcome:
    """Track a machine while it works and leave a run directory in segments; parameters as in `run`.

    Ends where the source ends, and whole, with what has come, on the first Ctrl-C (SIGINT or SIGTERM); a second one
    leaves what was recorded. The same axis in the same directory goes on with the run, behind a gap.

    Raises
    ------
    InputError
        Where the configuration cannot be, or no samples come.
    """
    with open_source(axis.source) as source, ended_by_signals(source):
        tracker = live_follower(axis, source.rate_hz)
        about = {
            "configuration": axis.model_dump(mode="json", exclude_defaults=True, exclude={"serve"}),
            "found": {"format": source.format, "rate_from": "the sender"},
        }
        fits = Fits.of(axis.fit, tracker.settings.loop)
        return record(
            source,
            tracker,
            directory,
            about=about,
            force=force,
            progress=progress,
            draw=draw,
            fits=fits,
            watching=make_watching(axis, tracker.settings),
            kept=axis.record or RecordSection(),
            again=False,
            tell=tell,
            audience=audience,
        )


@contextmanager
def ended_by_signals(source: LiveSource) -> Iterator[None]:
    """The first signal ends the source; the second does what it did before."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in _SIGNALS}

    def end(_number: int, _frame: object) -> None:
        source.stop()
        restore()

    def restore() -> None:
        for number, handler in before.items():
            signal.signal(number, handler)

    for number in _SIGNALS:
        signal.signal(number, end)
    try:
        yield
    finally:
        restore()
