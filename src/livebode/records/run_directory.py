"""The directory that a run leaves: written beside its place, and moved there when it is whole."""

from __future__ import annotations

import contextlib
import errno
import logging
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pyarrow as pa

from livebode.core import Event, Parameters, RecordError, Responses
from livebode.records.parameter_table import PARAMETERS, parameter_rows
from livebode.records.piece import parts_of
from livebode.records.removal import check_removable, remove
from livebode.records.response_table import RESPONSES, as_batch
from livebode.records.segments.json_lines import to_line
from livebode.records.summary_file import COPY, RUN, to_document
from livebode.records.table_file import TableFile

_DISK = {errno.ENOSPC: "the disk is full", errno.EDQUOT: "the disk quota is used up"}

_logger = logging.getLogger(__name__)


class RunDirectory:
    """Responses, events and a summary of one run in a new directory that appears only when it is whole.

    Use it as a context manager: leaving it without an exception puts the directory in its place, any exception removes
    what was written. What any tool reads: ``responses.parquet`` (see `RESPONSES`), ``events.jsonl`` (one object
    a line: kind, sample, time_s, message, details) and ``run.json``.

    Parameters
    ----------
    path
        Where the directory is to stand.
    force
        Whether to replace a directory that stands there already. Only a directory that a run left is replaced.

    Raises
    ------
    RecordError
        If something stands there and is not to be or must not be replaced, or the disk refuses to take it.
    """

    def __init__(self, path: Path, *, force: bool = False) -> None:
        self.path = path
        self._force = force

    def __enter__(self) -> RunDirectory:
        self._check_free()
        with _disk_errors(self.path):
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self.partial = Path(tempfile.mkdtemp(prefix=f".{self.path.name}.partial-", dir=self.path.parent))
            try:
                self.partial.chmod(0o755)
                self._events = (self.partial / "events.jsonl").open("wb")
                self._responses = TableFile(self.partial / "responses.parquet", RESPONSES)
                self._parameters: TableFile | None = None
            except BaseException:
                shutil.rmtree(self.partial, ignore_errors=True)
                raise
        _logger.info("%s: the record begins", self.path)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: object) -> None:
        try:
            if kind is not None:
                with contextlib.suppress(OSError, pa.ArrowException):  # what is closed here is removed below
                    self._close()
            else:
                with _disk_errors(self.path):
                    self._close()
                    self._check_free()
                    self._put_in_place()
                _logger.info("%s: the record is complete", self.path)
        finally:
            shutil.rmtree(self.partial, ignore_errors=True)
        if isinstance(error, OSError):
            raise _disk_sentence(self.path, error) from None

    def write(self, responses: Responses) -> None:
        """Append responses."""
        with _disk_errors(self.path):
            self._responses.write(as_batch(responses))

    def write_parameters(self, *parts: Parameters) -> None:
        """Append what was fitted and what follows; the file ``parameters.parquet`` is there once anything was."""
        with _disk_errors(self.path):
            if self._parameters is None:
                self._parameters = TableFile(self.partial / "parameters.parquet", PARAMETERS)
            for parameters in parts:
                self._parameters.write(parameter_rows(parameters))

    def write_event(self, event: Event) -> None:
        """Append an event."""
        with _disk_errors(self.path):
            self._events.write(to_line(asdict(event)))

    def finish(self, summary: dict[str, Any], draw: Callable[[Path], None]) -> None:
        """Close the tables, write run.json with their checksums, and let `draw` add pictures to the directory."""
        with _disk_errors(self.path):
            self._close()
            files = {path.name: parts_of(path) for path in sorted(self.partial.glob("*.parquet"))}
            data = to_document(summary | {"files": files})
            for name in (RUN, COPY):
                (self.partial / name).write_bytes(data)
            draw(self.partial)

    def _close(self) -> None:
        for file in (self._responses, self._parameters, self._events):
            if file is not None:
                file.close()

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
        check_removable(self.path)
        if segments:
            from livebode.records.segments.lock import Lock  # needs a POSIX system, as what left them did

            Lock(self.path).release()

    def _put_in_place(self) -> None:
        old = None
        if self.path.exists():
            old = Path(tempfile.mkdtemp(prefix=f".{self.path.name}.old-", dir=self.path.parent))
            self.path.rename(old / "run")
        try:
            self.partial.rename(self.path)
        except OSError:
            if old is not None:
                (old / "run").rename(self.path)
            raise
        finally:
            if old is not None:
                with contextlib.suppress(OSError):
                    remove(old / "run")
                with contextlib.suppress(OSError):
                    old.rmdir()


def _disk_sentence(path: Path, error: OSError) -> RecordError:
    why = _DISK.get(error.errno or 0, os.strerror(error.errno) if error.errno else str(error))
    return RecordError(
        "not-written",
        f"the run could not be written to {str(path)!r}: {why}; nothing was left there",
        "make room, or choose another path",
        path=str(path),
        reason=why,
        errno=error.errno,
    )


@contextmanager
def _disk_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise _disk_sentence(path, error) from None
