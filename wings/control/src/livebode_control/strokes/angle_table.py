"""A table of torque over one turn, for the feedforward of a drive: CSV, C header or Structured Text."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from os import PathLike
from pathlib import Path

import numpy as np

from livebode.arrays import Floats
from livebode.core import UsageError, whole_file
from livebode.structured_text import comment, real

_PER_ROW = 4
_LOADED_AT_ONCE = 32  # points per cycle, so that the first cycle is as short as the others


def write_angle_table(path: str | PathLike[str], torque: Floats, note: list[str], unit: str = "") -> None:
    """Write torque at even angles of one turn, from 0 on, in the format of the suffix: .csv, .h or .st.

    Parameters
    ----------
    path
        The file.
    torque
        Shape (points,); the drive interpolates between them and begins again after the last one.
    note
        Lines of text at the beginning of the file.
    unit
        Of the torque.

    Raises
    ------
    UsageError
        If the suffix is not supported.
    OSError
        If the file cannot be written; an existing file is unchanged then.
    """
    place = Path(path)
    if place.suffix not in _WRITERS:
        raise UsageError(
            "not-one-of",
            f"{place.name!r} does not end in a supported suffix",
            f"choose {', '.join(_WRITERS)}",
            argument="table",
            value=place.suffix,
            allowed=list(_WRITERS),
        )
    with whole_file(place) as partial:
        partial.write_text(_WRITERS[place.suffix](torque, note, unit), encoding="utf-8")


def _csv(torque: Floats, note: list[str], unit: str) -> str:
    angle = np.arange(torque.size) * 2 * np.pi / torque.size
    head = [f"# {line}" for line in note]
    name = f"torque [{unit}]" if unit else "torque"
    rows = [f"{a!r},{value!r}" for a, value in zip(angle.tolist(), torque.tolist())]
    return "\n".join([*head, f"angle [rad],{name}", *rows]) + "\n"


def _c_header(torque: Floats, note: list[str], unit: str) -> str:
    about = "\n".join(f" * {line}".replace("*/", "* /") for line in [f"Feedforward over one turn, {unit}.", *note])
    rows = _rows([float(value).hex() for value in torque])
    return f"""/*
{about}
 */
#ifndef RIPPLE_FEEDFORWARD_H
#define RIPPLE_FEEDFORWARD_H

#define RIPPLE_FEEDFORWARD_POINTS {torque.size}

static const double ripple_feedforward[RIPPLE_FEEDFORWARD_POINTS] = {{
{rows}
}};

#endif
"""


def _structured_text(torque: Floats, note: list[str], unit: str) -> str:
    """A function block without conversions from LREAL and initial values, in which controllers differ.

    Its table is loaded in its first cycles; the torque is 0 until then.
    """
    text = comment("\n".join([f"Feedforward over one turn, {unit}.", *note]))
    points, last = torque.size, torque.size - 1
    halvings = int(np.ceil(np.log2(points)))
    return f"""{text}FUNCTION_BLOCK FB_RippleFeedforward
VAR_INPUT
    angle : LREAL; // of the shaft, rad, from 0 to 2 pi; outside, the torque is 0
END_VAR
VAR_OUTPUT
    torque : LREAL;
END_VAR
VAR
    place : LREAL;
    below : DINT;
    above : DINT;
    half : DINT;
    i : DINT;
    loaded : UDINT;
    table : ARRAY [0..{last}] OF LREAL;
END_VAR
IF loaded < {-(-points // _LOADED_AT_ONCE)} THEN
    CASE loaded OF
{_loading(torque)}
    END_CASE
    loaded := loaded + 1;
END_IF
torque := 0.0;
place := angle * {real(points / (2 * np.pi))};
IF (loaded = {-(-points // _LOADED_AT_ONCE)}) AND (place >= 0.0) AND (place < {points}.0) THEN
    below := 0;
    half := {1 << (halvings - 1)};
    FOR i := 1 TO {halvings} DO
        IF (below + half <= {last}) AND (place >= DINT_TO_LREAL(below + half)) THEN
            below := below + half;
        END_IF
        half := half / 2;
    END_FOR
    above := below + 1;
    IF above = {points} THEN
        above := 0;
    END_IF
    torque := table[below] + (place - DINT_TO_LREAL(below)) * (table[above] - table[below]);
END_IF
END_FUNCTION_BLOCK
"""


def _loading(torque: Floats) -> str:
    """The cases of a table's parts."""
    lines = []
    for i, value in enumerate(torque.tolist()):
        if i % _LOADED_AT_ONCE == 0:
            lines.append(f"    {i // _LOADED_AT_ONCE}:")
        lines.append(f"        table[{i}] := {real(value)};")
    return "\n".join(lines)


_WRITERS: Mapping[str, Callable[[Floats, list[str], str], str]] = {
    ".csv": _csv,
    ".h": _c_header,
    ".st": _structured_text,
}


def _rows(values: list[str]) -> str:
    rows = (values[i : i + _PER_ROW] for i in range(0, len(values), _PER_ROW))
    return ",\n".join("    " + ", ".join(row) for row in rows)
