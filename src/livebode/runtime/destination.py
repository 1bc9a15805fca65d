"""Destination: directory and receivers of a run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from livebode.core import Event, Model, Responses
from livebode.runtime.audience import Audience

Progress = Callable[[int, int | None], None]
Draw = Callable[[Responses, Path, str, Model | None], None]
Tell = Callable[[Event], None]


@dataclass(frozen=True)
class Destination:
    """Directory and receivers of a run.

    Parameters
    ----------
    directory
        Directory of the run. In one piece it appears only when complete; in segments it exists from the beginning,
        and an unfinished one of the same axis is continued.
    draw
        Called to add pictures: with the thinned responses, the directory before it is renamed, the scheduling signal's
        name with its unit, and the newest fit.
    force
        Replace an earlier run there.
    progress
        Called after each block with the number of tracked samples and of all samples (None if not known).
    tell
        Called with messages of the record in segments: it continues, pauses, or removes its oldest segments.
    audience
        Receives everything that the run publishes.
    """

    directory: Path
    draw: Draw
    force: bool = False
    progress: Progress = lambda *_: None
    tell: Tell = lambda _: None
    audience: Audience = field(default_factory=Audience)
