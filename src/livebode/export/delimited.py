"""CSV: one row for each response and line, with the units in the header."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from arro3 import io as arrow_io

from livebode.core import RecordError, Responses
from livebode.export.result import WriteResult
from livebode.tables import Table
from livebode.tables.table import Column


def write_csv(path: Path, parts: Iterable[Responses], _about: Mapping[str, Any] | None = None) -> WriteResult:
    """Write responses in long form, part by part.

    Columns: ``time [s]``, ``schedule``, ``frequency [Hz]``, ``re``, ``im``, ``magnitude [dB]``, ``phase [deg]``,
    ``sigma``, ``dof``, ``coherence``, ``valid`` (1 or 0), ``first``, ``sample``, ``ready`` (1 or 0); re, im and sigma
    with the response's unit in brackets, where it has one. A number is a short decimal that gives the same double;
    an unknown value is ``NaN``.

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
            write_rows(file, _as_table(part))
            rows += len(part)
        if not rows:
            raise RecordError("no-responses", "the run has no responses to export", "see its events")
    return WriteResult(rows)


def write_header(file: BinaryIO, header: Sequence[str]) -> None:
    """Write the first line; a name is quoted only where it must be."""
    line = io.StringIO()
    csv.writer(line, lineterminator="\n").writerow(header)
    file.write(line.getvalue().encode())


def write_rows(file: BinaryIO, rows: Table) -> None:
    """Write rows without a header; text is quoted only where it must be."""
    text = io.BytesIO()  # errors of the disk have no number from arro3
    arrow_io.write_csv(rows, text, header=False)
    file.write(text.getbuffer())


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


def _as_table(part: Responses) -> Table:
    rows, lines = part.value.shape
    value = part.value.ravel()
    with np.errstate(divide="ignore"):
        magnitude_db = 20 * np.log10(np.abs(value))
    columns: dict[str, Column] = {
        "time": np.repeat(part.time_s, lines),
        "schedule": np.repeat(part.schedule, lines),
        "frequency": np.tile(part.lines.frequency_hz, rows),
        "re": value.real.copy(),
        "im": value.imag.copy(),
        "magnitude": magnitude_db,
        "phase": np.degrees(np.angle(value)),
        "sigma": part.sigma.ravel(),
        "dof": np.repeat(part.dof, lines),
        "coherence": part.coherence.ravel(),
        "valid": part.valid.ravel().astype(np.int8),
        "first": np.repeat(part.first, lines),
        "sample": np.repeat(part.sample, lines),
        "ready": np.repeat(part.ready.astype(np.int8), lines),
    }
    return Table.of(columns)
