"""Records of a run in one piece: there is nothing to continue and nothing to commit, and samples are not recorded."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from livebode.configuration import RecordSection
from livebode.core import Block, Event
from livebode.records import ColumnTable, RunDirectory
from livebode.runtime.documents import Document, FitResults

if TYPE_CHECKING:
    from livebode.records import RunRecord


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
