"""Recorder: the record of a run, as the run loop uses it; WholeRecord: one that is written at once; Destination."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Self

from livebode.configuration import RecordSection
from livebode.core import Block, Event
from livebode.dataclass import dataclass
from livebode.records import ColumnTable, RunDirectory
from livebode.runtime.documents import Document, FitResults, Subscriber

if TYPE_CHECKING:
    from livebode.records import RunRecord


class Recorder(Protocol):
    """The record of a run, written at once or with a journal. Used as a context manager around the run."""

    path: Path

    @property
    def phase(self) -> float:
        """Part of an interval by which the axis is ahead of another one of the process in what it does at times."""

    def __enter__(self) -> Self: ...

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: object) -> None: ...

    @property
    def continues(self) -> bool:
        """Whether an unfinished run can be continued."""

    @property
    def clock(self) -> Sequence[tuple[float, float]]:
        """The clock of the run that it continues, as in `RunClock`."""

    @property
    def numbering(self) -> Sequence[tuple[int, int, int]]:
        """The numbers of the senders in the run that it continues, as in `SenderNumbers`."""

    @property
    def begun(self) -> str | None:
        """When the run that it continues began, as in run.json; None for a new one, or if nothing recorded it."""

    def previous(self) -> RunRecord | None:
        """The record that it continues; None for a new one."""

    def pieces(self, block: Block) -> Iterator[Block]:
        """The samples of a Block that are not in the record yet, in Blocks that are short enough for a commit."""

    def write_samples(self, block: Block) -> None:
        """Append the samples, if they are recorded, before they are tracked."""

    def take(self, document: Document) -> None:
        """Append a document, if it is recorded."""

    def commit(self, block: Block) -> None:
        """Store everything up to the end of this Block, if a commit is due."""

    @property
    def is_behind(self) -> bool:
        """Whether it is to store what it has before it gets more."""

    def catch_up(self) -> None:
        """Wait until it is not behind."""

    def commit_while_silent(self) -> None:
        """The same while no samples come."""

    def commit_last(self) -> None:
        """Store everything after the last Block; RecordError if it cannot be written."""

    def renew(self, **found: Any) -> None:
        """Write findings during the run to run.json now."""

    def limit(self, section: RecordSection) -> None:
        """Use other settings of the record from now."""

    def stopped(self) -> Event | None:
        """Message for a run that stops here, before it is finished; None if nothing of it remains."""

    def finish(self, summary: dict[str, Any], draw: Callable[[Path], None]) -> None:
        """Let `draw` add pictures, close all files and write run.json."""


class RecordInOnePiece:
    """What all records have that are complete or not there."""

    phase = 0.0
    continues = False
    clock = ()
    numbering = ()
    begun = None

    def previous(self) -> RunRecord | None:
        return None

    def pieces(self, block: Block) -> Iterator[Block]:
        yield block

    def write_samples(self, block: Block) -> None: ...

    def commit(self, block: Block) -> None: ...

    @property
    def is_behind(self) -> bool:
        return False

    def catch_up(self) -> None: ...

    def commit_while_silent(self) -> None: ...

    def commit_last(self) -> None: ...

    def renew(self, **found: Any) -> None: ...

    def limit(self, section: RecordSection) -> None: ...

    def stopped(self) -> Event | None:
        return None


class WholeRecord(RecordInOnePiece):
    """Writes the documents of a run to a `RunDirectory`; an exception leaves nothing behind."""

    def __init__(self, path: Path, tables: Mapping[str, ColumnTable], *, force: bool) -> None:
        self.path = path
        self._directory = RunDirectory(path, tables, force=force)

    def __enter__(self) -> Self:
        self._directory.__enter__()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: object) -> None:
        self._directory.__exit__(kind, error, trace)

    def take(self, document: Document) -> None:
        match document:
            case Event():
                self._directory.write_event(document)
            case FitResults(parts):
                for part in parts:
                    self._directory.write(part)
            case _:
                self._directory.write(document)

    def finish(self, summary: dict[str, Any], draw: Callable[[Path], None]) -> None:
        self._directory.finish(summary, draw)


Draw = Callable[[Any, Path], None]
"""Draws an estimate (`Estimate`, which cannot be named here without a circle) into a directory."""


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
    findings
        Called at the end of the run: entries of run.json about its subscribers.
    """

    directory: Path
    draw: Draw
    force: bool = False
    subscribers: tuple[Subscriber, ...] = ()
    record: Recorder | None = None
    findings: Callable[[], Mapping[str, Any]] = dict

    def announce(self, document: Document) -> None:
        """Pass a document to every subscriber, before or beside a run."""
        for subscriber in self.subscribers:
            subscriber(document)
