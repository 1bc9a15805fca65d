"""LakeRecord: the record of a recording's run as files of a lake, without a run directory in between."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import ExitStack, suppress
from math import isfinite, nan
from pathlib import Path
from typing import Any, Self

import numpy as np
import pyarrow as pa

from livebode.analysis import FittedQuantities
from livebode.core import Event, MatrixResponses, Responses, writing
from livebode.records import parameter_rows, to_json
from livebode.runtime import Document, FitResults, RecordInOnePiece
from livebode.tables import from_numpy, text
from livebode_plant.lake import DataFile, Key
from livebode_plant.lake.data_file import ResultFileWriter
from livebode_plant.lake.wide_matrices import covariance_to_wide, entries_to_wide
from livebode_plant.lake.wide_responses import to_wide

_EVENTS = 10_000


class LakeRecord(RecordInOnePiece):
    """Writes responses or matrices of them, parameters and events to files of the lake's layout as they come.

    Parameters
    ----------
    path
        An existing directory for the files: PATH/TABLE/NAME.
    key
        The result.

    Attributes
    ----------
    files
        The files with rows, when the run is finished.
    fitted
        The valid fits.
    summary
        The run as in run.json.
    """

    def __init__(self, path: Path, key: Key) -> None:
        self.path, self._key = path, key
        self.files: tuple[DataFile, ...] = ()
        self.fitted = FittedQuantities()
        self.summary: dict[str, Any] = {}
        self._events: list[Event] = []
        self._open = ExitStack()
        self._writers: dict[str, ResultFileWriter] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: object) -> None:
        with suppress(*((OSError, pa.ArrowException) if error else ())):  # on a full disk, closing fails as well
            self._open.close()

    def take(self, document: Document) -> None:
        with writing(self.path):
            match document:
                case Responses():
                    self._write("responses", to_wide(document))
                case MatrixResponses():
                    self._write("responses", entries_to_wide(document))
                    self._write("covariance", covariance_to_wide(document))
                case FitResults(parts):
                    for part in parts:
                        rows = parameter_rows(part)
                        self._write("parameters", pa.table(rows))
                        self.fitted.add(rows)
                case Event():
                    self._events.append(document)
                    if len(self._events) == _EVENTS:
                        self._write_events()

    def finish(self, summary: dict[str, Any], draw: Callable[[Path], None]) -> None:  # noqa: ARG002 - no pictures
        self.summary = summary
        with writing(self.path):
            self._write_events()
            written = [writer.finish() for writer in self._writers.values()]
        self.files = tuple(file for file in written if file.rows)

    def _write(self, table: str, rows: pa.Table) -> None:
        if table not in self._writers:
            (self.path / table).mkdir()
            self._writers[table] = self._open.enter_context(ResultFileWriter(self.path / table, table, self._key))
        self._writers[table].write(rows)

    def _write_events(self) -> None:
        events, self._events = self._events, []
        if events:
            self._write("events", _rows_of(events))


def _rows_of(events: list[Event]) -> pa.Table:
    times = [event.time_s if isfinite(event.time_s) else nan for event in events]
    columns = {
        "kind": _text([event.kind for event in events]),
        "sample": from_numpy(np.array([event.sample for event in events], dtype=np.int64)),
        "time_s": from_numpy(np.array(times, dtype=np.float64)),
        "message": _text([event.message for event in events]),
        "details": _text([_details(event) for event in events]),
    }
    return pa.table(list(columns.values()), names=list(columns))


def _details(event: Event) -> str:
    return json.dumps(json.loads(to_json(event.details)), sort_keys=True, ensure_ascii=False)


def _text(words: list[str]) -> pa.Array[Any]:
    return text(words, np.arange(len(words)))
