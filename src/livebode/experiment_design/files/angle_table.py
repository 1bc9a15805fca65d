"""A table of torque over one turn, for the feedforward of a drive: CSV, C header or Structured Text."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from livebode.core import UsageError
from livebode.core.files import whole_file

Floats = NDArray[np.float64]

_PER_ROW = 4


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
    comment = "\n".join(f" * {line}".replace("*/", "* /") for line in [f"Feedforward over one turn, {unit}.", *note])
    rows = _rows([float(value).hex() for value in torque])
    return f"""/*
{comment}
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
    comment = "\n".join(line.replace("*)", "* )") for line in [f"Feedforward over one turn, {unit}.", *note])
    last = torque.size - 1
    return f"""(*
{comment}
*)
FUNCTION F_RippleFeedforward : LREAL
VAR_INPUT
    angle : LREAL; (* of the shaft, rad, any number of turns *)
END_VAR
VAR
    place : LREAL;
    below : DINT;
    share : LREAL;
END_VAR
VAR CONSTANT
    turn : LREAL := 6.283185307179586;
    torque : ARRAY [0..{last}] OF LREAL := [
{_rows([repr(float(value)) for value in torque])}
    ];
END_VAR

place := angle / turn;
place := (place - LREAL_TO_DINT(place)) * {torque.size}.0;
IF place < 0.0 THEN
    place := place + {torque.size}.0;
END_IF
below := LREAL_TO_DINT(place - 0.5);
share := place - DINT_TO_LREAL(below);
below := (below + {torque.size}) MOD {torque.size};
F_RippleFeedforward := torque[below] + share * (torque[(below + 1) MOD {torque.size}] - torque[below]);

END_FUNCTION
"""


_WRITERS: Mapping[str, Callable[[Floats, list[str], str], str]] = {
    ".csv": _csv,
    ".h": _c_header,
    ".st": _structured_text,
}


def _rows(values: list[str]) -> str:
    rows = (values[i : i + _PER_ROW] for i in range(0, len(values), _PER_ROW))
    return ",\n".join("    " + ", ".join(row) for row in rows)
