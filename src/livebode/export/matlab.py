"""MATLAB: a struct with fields for `frd` and `idfrd`."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from livebode.core import Responses, needing
from livebode.export.result import WriteResult, whole

VARIABLE = "livebode"


def write_mat(path: Path, parts: Iterable[Responses], about: Mapping[str, Any] | None = None) -> WriteResult:
    """Write responses as a MATLAB v5 file with one struct `livebode`.

    Fields: ``H`` (1, 1, lines, responses) complex and ``w`` (lines, 1) in rad/s, for `frd(H, w)`;
    ``sigma``, ``coherence`` and ``valid`` (lines, responses); ``f_hz`` (lines, 1); ``time_s``, ``schedule``,
    ``dof``, ``first``, ``sample``, ``ready`` (1, responses); ``Ts`` in seconds, ``window``, ``quantity``, ``unit``, and
    ``run``, run.json as text. A single response has only its valid lines; several have NaN at invalid lines.

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


def _struct(responses: Responses) -> dict[str, Any]:
    lines = responses.lines
    kept = responses.valid[0] if len(responses) == 1 else np.ones(len(lines), dtype=bool)
    frequency_hz = lines.frequency_hz[kept]
    over_lines = {name: getattr(responses, name).T[kept] for name in ("sigma", "coherence", "valid")}
    over_time = {name: getattr(responses, name)[np.newaxis] for name in ("time_s", "schedule", "dof", "ready")}
    # MATLAB counts in doubles; with int64, every sum would become int64.
    samples = {name: getattr(responses, name)[np.newaxis].astype(np.float64) for name in ("first", "sample")}
    return {
        "H": responses.value.T[kept][np.newaxis, np.newaxis],
        "w": 2 * np.pi * frequency_hz[:, np.newaxis],
        "f_hz": frequency_hz[:, np.newaxis],
        **over_lines,
        **over_time,
        **samples,
        "Ts": 1 / lines.rate_hz,
        "window": float(lines.window),
        "quantity": responses.quantity,
        "unit": responses.unit,
    }
