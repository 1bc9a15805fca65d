"""Destination: where a run goes, and who hears of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from livebode.core import Event, Model, Responses
from livebode.session.audience import Audience

Progress = Callable[[int, int | None], None]
Draw = Callable[[Responses, Path, str, Model | None], None]
Tell = Callable[[Event], None]


@dataclass(frozen=True)
class Destination:
    """Where a run goes, and who hears of it.

    Parameters
    ----------
    directory
        Where the run is to stand. In one piece it appears only when whole; in segments it is there from the beginning,
        and an unfinished one of the same axis is gone on with.
    draw
        Called with the thinned responses, the directory before it is put in place, the scheduling signal's name
        with its unit, and the newest fit, to add pictures.
    force
        Replace an earlier run there.
    progress
        Called after each block with samples done and in all (None where not known).
    tell
        Called with what the record in segments itself has to say: that it goes on, pauses or removes what is oldest.
    audience
        Sees all that the run publishes.
    """

    directory: Path
    draw: Draw
    force: bool = False
    progress: Progress = lambda *_: None
    tell: Tell = lambda _: None
    audience: Audience = field(default_factory=Audience)
