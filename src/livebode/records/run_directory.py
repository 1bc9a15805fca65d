"""The directory of a run: written next to its place, and moved there when it is complete."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from livebode.core import Event, RecordError, whole_directory, writing
from livebode.records._result_rows import RESPONSE_TABLES, result_rows
from livebode.records.column_table import ColumnTable
from livebode.records.segments import manifest
from livebode.records.segments.json_lines import EVENTS, to_line
from livebode.records.segments.manifest import Segment
from livebode.records.segments.segment_writer import TableFile
from livebode.records.summary_file import COPY, RUN, to_document

_logger = logging.getLogger(__name__)


class RunDirectory:
    """Responses, events and a summary of one run in a new directory that appears only when it is complete.

    Use it as a context manager: leaving it without an exception moves the directory to its place, any exception removes
    what was written. Files, readable with any tool: ``responses.parquet`` (see `RESPONSES`), ``events.jsonl`` (one
    object a line: kind, sample, time_s, message, details), ``manifest.jsonl`` and ``run.json``.

    Parameters
    ----------
    path
        Path of the directory.
    force
        Whether to replace an existing directory. Only the directory of a run is replaced.
    tables
        The tables of the run. Each has a file from the beginning, except the parameters: a run may have no fits.

    Raises
    ------
    RecordError
        If the path exists and must not be replaced, or the disk reports an error.
    """

    def __init__(self, path: Path, tables: Mapping[str, ColumnTable] = RESPONSE_TABLES, *, force: bool = False) -> None:
        self.path, self._tables, self._force = path, tables, force

    def __enter__(self) -> RunDirectory:
        self._check_free()
        with writing(self.path, RecordError), contextlib.ExitStack() as undo:
            self.partial = undo.enter_context(whole_directory(self.path, _remove))
            self._events = (self.partial / EVENTS).open("wb")
            self._files: dict[str, TableFile] = {}
            for name in self._tables:
                if name != "parameters":
                    self._open(name)
            self._place = undo.pop_all()
        _logger.info("%s: the record begins", self.path)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: object) -> None:
        with writing(self.path, RecordError):
            if error is not None:
                with contextlib.suppress(OSError, ValueError):  # the closed files are removed below
                    self._close()
                self._place.__exit__(kind, error, error.__traceback__)
                if isinstance(error, OSError):
                    raise error
                return
            with self._place:
                self._close()
                self._check_free()
        _logger.info("%s: the record is complete", self.path)

    def write(self, results: Any) -> None:
        """Append results: responses, matrices of them, or parameters."""
        with writing(self.path, RecordError):
            for name, rows in result_rows(results).items():
                (self._files.get(name) or self._open(name)).write(rows)

    def _open(self, name: str) -> TableFile:
        self._files[name] = TableFile(self.partial / f"{name}.parquet", self._tables[name])
        return self._files[name]

    def write_event(self, event: Event) -> None:
        """Append an event."""
        with writing(self.path, RecordError):
            self._events.write(to_line(asdict(event)))

    def finish(self, summary: dict[str, Any], draw: Callable[[Path], None]) -> None:
        """Close the tables, write manifest and run.json, and let `draw` add pictures to the directory."""
        with writing(self.path, RecordError):
            lines = manifest.first_line() + manifest.closing_line(1, self._close(), None)
            (self.partial / manifest.NAME).write_bytes(lines)
            size_bytes = {name: (self.partial / name).stat().st_size for name in (EVENTS, manifest.NAME)}
            data = to_document(summary | {"size_bytes": size_bytes})
            for name in (RUN, COPY):
                (self.partial / name).write_bytes(data)
            draw(self.partial)

    def _close(self) -> list[Segment]:
        """Close the files; the segments of the tables."""
        self._events.close()
        return [self._files[name].close() for name in sorted(self._files)]

    def _check_free(self) -> None:
        if not self.path.exists() and not self.path.is_symlink():
            return
        segments = (self.path / "open").is_dir()
        if not self._force and segments:
            raise RecordError(
                "exists",
                f"{str(self.path)!r} exists already and is recorded in segments",
                "continue that run, or replace it with force",
                path=str(self.path),
                argument="force",
            )
        if not self._force:
            raise RecordError(
                "exists",
                f"{str(self.path)!r} exists already",
                "choose another path, or replace it with force",
                path=str(self.path),
                argument="force",
            )
        from livebode.records.removal import check_removable

        check_removable(self.path)
        if segments:
            from livebode.records.segments.lock import Lock

            Lock(self.path).release()


def _remove(directory: Path) -> None:
    from livebode.records.removal import remove

    remove(directory)
