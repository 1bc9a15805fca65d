"""CSV: one row for each response and line, with the units in the header."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from livebode.core import RecordError, Responses
from livebode.export.result import WriteResult
from livebode.tables import Words, write_rows

Column = NDArray[Any] | Sequence[str]
"""Numbers, or text."""
_ROWS = 1 << 14


def write_csv(path: Path, parts: Iterable[Responses], _about: Mapping[str, Any] | None = None) -> WriteResult:
    """Write responses in long form, part by part.

    Columns: ``time [s]``, ``schedule``, ``frequency [Hz]``, ``re``, ``im``, ``magnitude [dB]``, ``phase [deg]``,
    ``sigma``, ``dof``, ``coherence``, ``valid`` (1 or 0), ``first``, ``sample``, ``ready`` (1 or 0); re, im and sigma
    with the response's unit in brackets, where it has one. A number is the shortest decimal that gives the same double;
    an unknown value is ``nan``.

    Raises
    ------
    RecordError
        If there are no responses.
    """
    rows = 0
    with path.open("wb") as file:
        for part in parts:
            if not len(part):
                continue
            if not rows:
                write_header(file, _header(part.unit))
            write_columns(file, _columns(part))
            rows += len(part)
        if not rows:
            raise RecordError("no-responses", "the run has no responses to export", "see its events")
    return WriteResult(rows)


def write_header(file: BinaryIO, header: Sequence[str]) -> None:
    """Write the first line; a name is quoted only where it must be."""
    line = io.StringIO()
    csv.writer(line, lineterminator="\n").writerow(header)
    file.write(line.getvalue().encode())


def write_columns(file: BinaryIO, columns: Sequence[Column]) -> None:
    """Write rows without a header, some at a time; text is quoted.

    >>> file = io.BytesIO()
    >>> write_columns(file, [np.array([0.1, 2]), ["a", 'b"c']])
    >>> file.getvalue()
    b'0.1,"a"\\n2,"b""c"\\n'
    """
    for first in range(0, len(columns[0]), _ROWS):
        file.write(write_rows([_cells(column[first : first + _ROWS]) for column in columns]))


def _cells(column: Column) -> NDArray[Any] | Words:
    if isinstance(column, np.ndarray):
        return np.ascontiguousarray(column, np.float64 if column.dtype.kind == "f" else np.int64)
    words = list(dict.fromkeys(column))
    place = {word: at for at, word in enumerate(words)}
    quoted = ['"' + word.replace('"', '""') + '"' for word in words]
    return Words([word.encode() for word in quoted], np.array([place[word] for word in column]))


def _header(unit: str) -> list[str]:
    of = f" [{unit}]" if unit else ""
    complexes = [f"re{of}", f"im{of}", "magnitude [dB]", "phase [deg]", f"sigma{of}"]
    return [
        "time [s]",
        "schedule",
        "frequency [Hz]",
        *complexes,
        "dof",
        "coherence",
        "valid",
        "first",
        "sample",
        "ready",
    ]


def _columns(part: Responses) -> list[Column]:
    rows, lines = part.value.shape
    value = part.value.ravel()
    with np.errstate(divide="ignore"):
        magnitude_db = 20 * np.log10(np.abs(value))
    return [
        np.repeat(part.time_s, lines),
        np.repeat(part.schedule, lines),
        np.tile(part.lines.frequency_hz, rows),
        value.real,
        value.imag,
        magnitude_db,
        np.degrees(np.angle(value)),
        part.sigma.ravel(),
        np.repeat(part.dof, lines),
        part.coherence.ravel(),
        part.valid.ravel(),
        np.repeat(part.first, lines),
        np.repeat(part.sample, lines),
        np.repeat(part.ready, lines),
    ]
