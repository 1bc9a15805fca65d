"""A run from its beginning to its end."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from livebode.configuration.axis import RecordSection
from livebode.preparation.follower import Follower
from livebode.runtime.audience import Audience
from livebode.runtime.destination import Destination, Draw, Progress, Tell
from livebode.runtime.fits import Fits
from livebode.runtime.following import Outcome, Source, Tracking
from livebode.runtime.pipeline import Pipeline
from livebode.runtime.watching import Watching


def record(
    source: Source,
    tracker: Follower,
    directory: Path,
    *,
    about: dict[str, Any],
    force: bool,
    progress: Progress,
    draw: Draw,
    audience: Audience | None = None,
    watching: Watching | None = None,
    fits: Fits | None = None,
    kept: RecordSection | None = None,
    again: bool = True,
    tell: Tell = lambda _: None,
    **delivery: Any,
) -> Outcome:
    """Track a source and write a run directory, with a `Tracking` of these parameters."""
    to = Destination(directory, draw, force, progress, tell, audience or Audience())
    pipeline = Pipeline(tracker, fits, watching)
    return whole(Tracking(source, pipeline, to, about=about, kept=kept, again=again, **delivery))


def whole(tracking: Tracking) -> Outcome:
    """The run from its beginning to its end."""
    with tracking:
        tracking.follow()
        tracking.end()
        outcome = tracking.finish()
    tracking.to.audience.finish(outcome.summary)
    return outcome
