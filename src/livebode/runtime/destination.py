"""Destination: directory and subscribers of a run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from livebode.runtime.documents import Subscriber

if TYPE_CHECKING:
    from livebode.runtime.recorder import Recorder

Draw = Callable[[Any, Path], None]
"""Draws an estimate (`Estimate`, which cannot be named here without a circle) into a directory."""


def nothing() -> None:
    """No preparation."""


@dataclass(frozen=True)
class Destination:
    """Directory and subscribers of a run.

    Parameters
    ----------
    directory
        Directory of the run. Written at once it appears only when complete; with a journal it exists from the
        beginning, and an unfinished one of the same axis is continued.
    draw
        Called to add pictures: with the estimate, and the directory before it is renamed.
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
    """

    directory: Path
    draw: Draw
    force: bool = False
    subscribers: tuple[Subscriber, ...] = ()
    record: Recorder | None = None
    prepare: Callable[[], None] = nothing
    findings: Callable[[], Mapping[str, Any]] = dict
