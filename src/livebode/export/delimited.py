"""CSV: one row for each response and line, with the units in the header."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import pyarrow as pa
from pyarrow.csv import CSVWriter, WriteOptions

from livebode.arrow import from_numpy
from livebode.core import RecordError, Responses
from livebode.export.result import WriteResult


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
        writer: CSVWriter | None = None
        for part in parts:
            if not len(part):
                continue
            batch = _as_batch(part)
            writer = writer or begin(file, _header(part.unit), batch.schema)
            writer.write_batch(batch)
            rows += len(part)
        if writer is None:
            raise RecordError("no-responses", "the run has no responses to export", "see its events")
        writer.close()
    return WriteResult(rows)


def begin(file: BinaryIO, header: list[str], schema: pa.Schema) -> CSVWriter:
    """A writer of CSV below this header, which is quoted only where it must be."""
    line = io.StringIO()
    csv.writer(line, lineterminator="\n").writerow(header)
    file.write(line.getvalue().encode())
    return CSVWriter(file, schema, write_options=WriteOptions(include_header=False, quoting_style="needed"))


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


def _as_batch(part: Responses) -> pa.RecordBatch:
    rows, lines = part.value.shape
    value = part.value.ravel()
    with np.errstate(divide="ignore"):
        magnitude_db = 20 * np.log10(np.abs(value))
    columns = {
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
    return pa.RecordBatch.from_arrays([from_numpy(c) for c in columns.values()], names=list(columns))
