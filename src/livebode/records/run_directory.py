"""The directory of a run: written next to its place, and moved there when it is complete."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from livebode.core import Event, MatrixResponses, Parameters, RecordError, Responses
from livebode.core.files import whole_directory
from livebode.core.writing import writing
from livebode.records.matrix_table import COVARIANCE, MATRIX_RESPONSES, covariance_rows, matrix_rows
from livebode.records.parameter_table import PARAMETERS, parameter_rows
from livebode.records.removal import check_removable, remove
from livebode.records.response_table import RESPONSES, as_batch
from livebode.records.segments.json_lines import to_line
from livebode.records.segments.lock import Lock
from livebode.records.summary_file import COPY, RUN, to_document
from livebode.records.table_file import TableFile

_logger = logging.getLogger(__name__)


class RunDirectory:
    """Responses, events and a summary of one run in a new directory that appears only when it is complete.

    Use it as a context manager: leaving it without an exception moves the directory to its place, any exception removes
    what was written. Files, readable with any tool: ``responses.parquet`` (see `RESPONSES`), ``events.jsonl`` (one
    object a line: kind, sample, time_s, message, details) and ``run.json``.

    Parameters
    ----------
    path
        Path of the directory.
    force
        Whether to replace an existing directory. Only the directory of a run is replaced.
    responses
        Whether the run has responses; an output-only run has only parameters.
    matrix
        Whether these are matrices; their covariance is then in ``covariance.parquet``.

    Raises
    ------
    RecordError
        If the path exists and must not be replaced, or the disk reports an error.
    """

    def __init__(self, path: Path, *, force: bool = False, responses: bool = True, matrix: bool = False) -> None:
        self.path = path
        self._force = force
        self._has_matrices = matrix
        self._has_responses = responses

    def __enter__(self) -> RunDirectory:
        self._check_free()
        with writing(self.path, RecordError), contextlib.ExitStack() as undo:
            self.partial = undo.enter_context(whole_directory(self.path, remove))
            self._events = (self.partial / "events.jsonl").open("wb")
            self._responses: TableFile | None = None
            if self._has_responses:
                table = MATRIX_RESPONSES if self._has_matrices else RESPONSES
                self._responses = TableFile(self.partial / "responses.parquet", table)
            self._covariance: TableFile | None = None
            if self._has_matrices:
                self._covariance = TableFile(self.partial / "covariance.parquet", COVARIANCE)
            self._parameters: TableFile | None = None
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

    def write(self, responses: Responses) -> None:
        """Append responses."""
        assert self._responses is not None
        with writing(self.path, RecordError):
            self._responses.write(as_batch(responses))

    def write_matrices(self, responses: MatrixResponses) -> None:
        """Append matrices of responses with their covariance."""
        assert self._responses is not None
        assert self._covariance is not None
        with writing(self.path, RecordError):
            self._responses.write(matrix_rows(responses))
            self._covariance.write(covariance_rows(responses))

    def write_parameters(self, *parts: Parameters) -> None:
        """Append fitted parameters and derived quantities; the first ones create ``parameters.parquet``."""
        with writing(self.path, RecordError):
            if self._parameters is None:
                self._parameters = TableFile(self.partial / "parameters.parquet", PARAMETERS)
            for parameters in parts:
                self._parameters.write(parameter_rows(parameters))

    def write_event(self, event: Event) -> None:
        """Append an event."""
        with writing(self.path, RecordError):
            self._events.write(to_line(asdict(event)))

    def finish(self, summary: dict[str, Any], draw: Callable[[Path], None]) -> None:
        """Close the tables, write run.json with their checksums, and let `draw` add pictures to the directory."""
        with writing(self.path, RecordError):
            data = to_document(summary | {"files": self._close()})
            for name in (RUN, COPY):
                (self.partial / name).write_bytes(data)
            draw(self.partial)

    def _close(self) -> dict[str, Any]:
        """Close the files; the parts of the tables, for run.json."""
        self._events.close()
        tables = {
            "covariance.parquet": self._covariance,
            "parameters.parquet": self._parameters,
            "responses.parquet": self._responses,
        }
        return {name: table.close() for name, table in tables.items() if table is not None}

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
            Lock(self.path).release()
