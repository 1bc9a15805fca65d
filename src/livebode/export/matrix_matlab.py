"""MATLAB: a struct of matrices with fields for `frd` and `idfrd`."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import REASONS, MatrixResponses, needing
from livebode.export.matlab import VARIABLE
from livebode.export.result import WriteResult, whole


def write_matrix_mat(
    path: Path, parts: Iterable[MatrixResponses], about: Mapping[str, Any] | None = None
) -> WriteResult:
    """Write matrices as a MATLAB v5 file with one struct `livebode`.

    Fields: ``H`` (outputs, inputs, lines, responses) complex and ``w`` (lines, 1) in rad/s, for `frd(H, w)`;
    ``CovarianceData`` (outputs, inputs, lines, 2, 2, responses) as `idfrd` takes it: for each entry the covariance of
    real and imaginary part, sigma²/2 on the diagonal because the error is circular; ``sigma`` and
    its part ``variation`` in the shape of H; ``noise`` (outputs, outputs, lines, responses) and ``spread`` (inputs,
    inputs, lines, responses), whose Kronecker product is the covariance of all entries by noise; ``coherence``
    (outputs, lines, responses), ``condition`` (lines, responses), ``valid`` and ``reason`` (inputs, lines, responses)
    with ``reasons`` as their words; ``OutputName``, ``InputName``, ``units`` (outputs, inputs); ``f_hz``
    (lines, 1), ``time_s``, ``dof``, ``first``, ``sample`` (1, responses), ``Ts`` in seconds, ``window``, and ``run``,
    run.json as text. A single response has only lines with a valid column; invalid columns are NaN.

    Raises
    ------
    RecordError
        If there are no responses.
    OutputError
        If there are more values than `VALUES_MAX`.
    """
    with needing("SciPy", "analysis", "an export for MATLAB"):
        from scipy.io import savemat

    responses = whole(parts, "mat")
    struct = _struct(responses) | ({} if about is None else {"run": json.dumps(about, ensure_ascii=False)})
    savemat(path, {VARIABLE: struct}, appendmat=False, do_compression=True)
    return WriteResult(len(responses))


def _struct(responses: MatrixResponses) -> dict[str, Any]:
    kept = responses.valid[0].any(axis=1) if len(responses) == 1 else np.ones(len(responses.lines), dtype=bool)
    frequency_hz = responses.frequency_hz[kept]
    over_lines = {
        name: _lines_and_rows_last(getattr(responses, name)[:, kept])
        for name in ("sigma", "variation", "noise", "spread", "coherence", "condition", "valid", "reason")
    }
    over_time = {name: getattr(responses, name)[np.newaxis] for name in ("time_s", "dof")}
    # MATLAB counts in doubles; with int64, every sum would become int64.
    samples = {name: getattr(responses, name)[np.newaxis].astype(np.float64) for name in ("first", "sample")}
    return {
        "H": _lines_and_rows_last(responses.value[:, kept]),
        "w": 2 * np.pi * frequency_hz[:, np.newaxis],
        "f_hz": frequency_hz[:, np.newaxis],
        "CovarianceData": _of_parts(over_lines["sigma"]),
        **over_lines,
        **over_time,
        **samples,
        "reasons": _cells(REASONS),
        "OutputName": _cells(responses.outputs),
        "InputName": _cells(responses.inputs),
        "units": np.array(responses.units or [[""] * len(responses.inputs)] * len(responses.outputs), dtype=object),
        "Ts": 1 / responses.lines.rate_hz,
        "window": float(responses.lines.window),
    }


def _lines_and_rows_last(values: NDArray[Any]) -> NDArray[Any]:
    """(rows, lines, …) as (…, lines, rows)."""
    return np.moveaxis(values, (0, 1), (-1, -2))


def _of_parts(sigma: NDArray[np.float64]) -> NDArray[np.float64]:
    """Covariance of real and imaginary part, (outputs, inputs, lines, 2, 2, rows)."""
    half = sigma**2 / 2
    return np.asarray(half[:, :, :, np.newaxis, np.newaxis] * np.eye(2)[:, :, np.newaxis])


def _cells(words: tuple[str, ...]) -> NDArray[np.object_]:
    cells = np.empty((len(words), 1), dtype=object)
    # SciPy writes an object with attributes, such as a Message, as a struct.
    cells[:, 0] = [str(word) for word in words]
    return cells
