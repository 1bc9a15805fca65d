"""The formats by suffix."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from os import PathLike
from pathlib import Path

from livebode.core import UsageError, whole_file
from livebode.excitation import Waveform
from livebode_design.files.arrays import write_mat, write_npz
from livebode_design.files.c_header import write_c_header
from livebode_design.files.delimited import write_csv
from livebode_design.files.structured_text import write_st

FORMATS: Mapping[str, Callable[[Path, Waveform, str], None]] = {
    ".csv": write_csv,
    ".npz": write_npz,
    ".mat": write_mat,
    ".h": write_c_header,
    ".st": write_st,
}
"""Writers of an excitation, by the suffix of the file. A further format is a function and a row here."""


def write(path: str | PathLike[str], waveform: Waveform, name: str = "excitation") -> None:
    """Write one period in the format of the suffix, whole or not at all.

    Raises
    ------
    UsageError
        If the suffix is not supported.
    DesignError
        If the format forbids the name.
    OSError
        If the file cannot be written; an existing file is unchanged then.
    """
    place = Path(path)
    if place.suffix not in FORMATS:
        raise UsageError(
            "not-one-of",
            f"{place.name!r} does not end in a supported suffix",
            f"choose {', '.join(FORMATS)}",
            argument="out",
            value=place.suffix,
            allowed=list(FORMATS),
        )
    with whole_file(place) as partial:
        FORMATS[place.suffix](partial, waveform, name)
