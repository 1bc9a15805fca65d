"""Destination: directory and subscribers of a run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from livebode.core import MatrixResponses, Model, Responses
from livebode.runtime.documents import Subscriber
from livebode.runtime.recorder import Recorder

Draw = Callable[[Responses, Path, str, Model | None], None]
DrawMatrix = Callable[[MatrixResponses, Path], None]


def nothing() -> None:
    """No preparation."""


def no_pictures(_responses: MatrixResponses, _into: Path) -> None:
    """No pictures of a matrix run."""


@dataclass(frozen=True)
class Destination:
    """Directory and subscribers of a run.

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
    subscribers
        Each receives every document that the run publishes.
    record
        Record of a recording's run in place of a run directory. `draw` and `force` then have no effect.
    prepare
        Called once when a recording has been opened: loads, beside the run, what `draw` needs.
    findings
        Called at the end of the run: entries of run.json about its subscribers.
    draw_matrix
        Instead of `draw` of a matrix run: called with the newest matrix that has a valid column, and the directory.
    """

    directory: Path
    draw: Draw
    force: bool = False
    subscribers: tuple[Subscriber, ...] = ()
    record: Recorder | None = None
    prepare: Callable[[], None] = nothing
    findings: Callable[[], Mapping[str, Any]] = dict
    draw_matrix: DrawMatrix = no_pictures
