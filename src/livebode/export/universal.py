"""Universal File Format, dataset 58: one frequency response function for each response."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import Response, Responses, SignalError, not_installed
from livebode.export.result import WriteResult

_LABEL, _ID = 20, 80  # longest unit and line of text in the format
_LINES_MIN = 2
_UNKNOWN, _TIME, _FREQUENCY = 0, 17, 18  # specific data types
_FRF, _SCALAR = 4, 0


def write_uff(path: Path, parts: Iterable[Responses], about: Mapping[str, Any] | None = None) -> WriteResult:
    """Write one ASCII dataset 58 for each response, in order (extra `uff`).

    Function type 4 (frequency response function), complex in double precision (12 digits), abscissa in Hz, response
    and reference node 1, scalar. The ordinate's unit is its label, cut at 20 letters; ID line 1 is the quantity
    with its channels, ID line 2 the quantity's unit in full, ID line 4 the time, schedule and extent; the time is
    also the z-axis value.

    Invalid lines are omitted, because the format has no NaN. The spacing is even if the valid lines are evenly spaced
    and six digits represent start and step exactly; else it is uneven, with six digits per frequency. Responses with
    fewer than two valid lines are omitted. The format has no field for sigma and coherence.

    Raises
    ------
    ExtraError
        If pyuff is not installed.
    SignalError
        If no response has two valid lines.
    """
    channels = _channels(about or {})
    return write_functions(path, ((response, channels, {}) for part in parts for response in part))


def write_functions(path: Path, functions: Iterable[tuple[Response, str, Mapping[str, Any]]]) -> WriteResult:
    """Write datasets 58 of responses, each with the words for its channels, and fields other than those of node 1.

    Raises
    ------
    ExtraError, SignalError
        As `write_uff`.
    """
    try:
        import pyuff
    except ImportError:
        raise not_installed("pyuff is not installed", package="pyuff", extra="uff") from None
    written = left_out = 0
    with path.open("wb") as file, TemporaryDirectory(prefix=f"{path.name}-", dir=path.parent) as folder:
        # pyuff reads the file again after each set that it appends; sets can simply be concatenated.
        scratch = os.path.join(folder, "set")
        for response, channels, fields in functions:
            if np.count_nonzero(response.valid) < _LINES_MIN:
                left_out += 1
                continue
            written += 1
            try:
                dataset = {**_dataset(response, written, channels), **fields}
                pyuff.UFF(scratch).write_sets(dataset, mode="overwrite")
            except Exception as error:
                raise _cause(error) from None
            file.write(Path(scratch).read_bytes())
    if not written:
        raise SignalError(
            "too-few-lines",
            f"no response has {_LINES_MIN} valid lines, which UFF 58 needs",
            "export csv or mat, which accept a response with fewer",
            lines_min=_LINES_MIN,
        )
    return WriteResult(written, left_out)


def _cause(error: BaseException) -> BaseException:
    """The original error: pyuff converts a full disk, and even the end of the program, to its own error."""
    while error.__context__ is not None:
        error = error.__context__
    return error


def _dataset(response: Response, number: int, channels: str) -> dict[str, Any]:
    valid = response.valid
    frequency_hz = response.lines.frequency_hz[valid]
    return {
        "type": 58,
        "binary": 0,
        "id1": text(f"{response.quantity} {channels}".strip(), _ID),
        "id2": text(response.unit, _ID),
        "id4": text(_moment(response), _ID),
        "func_type": _FRF,
        "func_id": number,
        "rsp_node": 1,
        "rsp_dir": _SCALAR,
        "ref_node": 1,
        "ref_dir": _SCALAR,
        "abscissa_spacing": int(_even(frequency_hz)),
        "abscissa_spec_data_type": _FREQUENCY,
        "abscissa_axis_lab": "Frequency",
        "abscissa_axis_units_lab": "Hz",
        "ordinate_spec_data_type": _UNKNOWN,
        "ordinate_axis_lab": text(response.quantity, _LABEL),
        "ordinate_axis_units_lab": text(response.unit, _LABEL),
        "orddenom_spec_data_type": _UNKNOWN,
        "z_axis_spec_data_type": _TIME,
        "z_axis_axis_lab": "Time",
        "z_axis_axis_units_lab": "s",
        "z_axis_value": response.time_s,
        "x": frequency_hz,
        "data": response.value[valid],
    }


def _even(frequency_hz: NDArray[np.float64]) -> bool:
    start, step = (float(f"{x:.5e}") for x in (frequency_hz[0], frequency_hz[1] - frequency_hz[0]))
    return np.allclose(start + step * np.arange(len(frequency_hz)), frequency_hz, rtol=1e-12, atol=0)


def _channels(about: Mapping[str, Any]) -> str:
    signals = about.get("configuration", {}).get("signals", {})
    return (
        f"from {signals.get('input') or signals.get('excitation')} to {signals['output']}"
        if "output" in signals
        else ""
    )


def _moment(response: Response) -> str:
    schedule = f" schedule {response.schedule:.6g}" if np.isfinite(response.schedule) else ""
    return f"{response.time_s:.9g} s{schedule} samples {response.first} to {response.sample}"


def text(words: str, length: int) -> str:
    """Text that a line of the format can contain: ASCII, no line breaks, not blank."""
    plain = words.replace("µ", "u").replace("μ", "u").replace("°", "deg").encode("ascii", "replace").decode()
    return "".join(c if c.isprintable() else "?" for c in plain).strip()[:length] or "NONE"
