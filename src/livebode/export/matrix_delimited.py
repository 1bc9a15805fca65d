"""CSV of matrices: one row for each response, entry and line."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from livebode.core import REASONS, MatrixResponses, RecordError
from livebode.export.delimited import Column, write_columns, write_header
from livebode.export.result import WriteResult

_HEADER = (
    *("time [s]", "output", "input", "frequency [Hz]", "re", "im", "magnitude [dB]", "phase [deg]", "sigma", "unit"),
    *("dof", "coherence", "condition", "valid", "reason", "first", "sample"),
)


def write_matrix_csv(
    path: Path, parts: Iterable[MatrixResponses], _about: Mapping[str, Any] | None = None
) -> WriteResult:
    """Write matrices in long form, part by part: for each response, output, input and line one row.

    Columns: ``time [s]``, ``output``, ``input``, ``frequency [Hz]``, ``re``, ``im``, ``magnitude [dB]``,
    ``phase [deg]``, ``sigma``, ``unit`` (of re, im and sigma), ``dof``, ``coherence`` (multiple, of the output),
    ``condition``, ``valid`` (1 or 0), ``reason`` (why the column is invalid), ``first``, ``sample``. A number is the
    shortest decimal that gives the same double; an unknown value is ``nan``. The covariance between entries is not in
    the file.

    Raises
    ------
    RecordError
        If there are no responses.
    """
    rows = 0
    with path.open("wb") as file:
        write_header(file, _HEADER)
        for part in parts:
            for row in range(len(part)):
                write_columns(file, _columns(part[row : row + 1]))
            rows += len(part)
        if not rows:
            raise RecordError("no-responses", "the run has no responses to export", "see its events")
    return WriteResult(rows)


def _columns(matrix: MatrixResponses) -> list[Column]:
    """Of one response, over (outputs, inputs, lines)."""
    shape = len(matrix.outputs), len(matrix.inputs), len(matrix.lines)

    def long(values: Any) -> Any:
        return np.broadcast_to(values, shape).ravel()

    value = matrix.value[0].transpose(1, 2, 0).ravel()
    reason = matrix.reason[0].T
    entries = [(output, input) for output in matrix.outputs for input in matrix.inputs]
    units = [matrix.entry(output, input).unit for output, input in entries]
    with np.errstate(divide="ignore"):
        magnitude_db = 20 * np.log10(np.abs(value))
    return [
        long(matrix.time_s),
        _repeated([output for output, _ in entries], shape[2]),
        _repeated([input for _, input in entries], shape[2]),
        long(matrix.frequency_hz),
        value.real,
        value.imag,
        magnitude_db,
        np.degrees(np.angle(value)),
        matrix.sigma[0].transpose(1, 2, 0).ravel(),
        _repeated(units, shape[2]),
        long(matrix.dof),
        long(matrix.coherence[0].T[:, np.newaxis]),
        long(matrix.condition[0]),
        long(reason == 0),
        [REASONS[number] for number in long(reason)],
        long(matrix.first),
        long(matrix.sample),
    ]


def _repeated(words: Sequence[str], times: int) -> list[str]:
    return [word for word in words for _ in range(times)]
