"""Find the line of an error that a fast parser reports without its position."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from livebode.core import RecordingError
from livebode.sources.cells import EMPTY, CellKind, is_comment, is_moment, is_number
from livebode.sources.dialect import BLANK, Dialect


def locate(path: Path, dialect: Dialect, columns: Sequence[int], line_bytes_max: int) -> RecordingError | None:
    """The error in the first line that is too long, has a wrong number of cells, or text in `columns`; else None.

    Lines count from 1 as in an editor.
    """
    number = 0
    with path.open("r", encoding=dialect.encoding, errors="replace", newline=None) as file:
        while line := file.readline(line_bytes_max + 1):
            number += 1
            if number < dialect.first_line or not line.strip(BLANK) or (dialect.untidy and is_comment(line)):
                continue
            if len(line) > line_bytes_max:
                return RecordingError(
                    "line-too-long",
                    f"line {number} of {path} is longer than {line_bytes_max} bytes",
                    "check that this is a recording",
                    path=str(path),
                    line=number,
                    limit_bytes=line_bytes_max,
                )
            if error := check_line(path, dialect, columns, number, line.rstrip("\n")):
                return error
    return None


def check_line(path: Path, dialect: Dialect, columns: Sequence[int], number: int, line: str) -> RecordingError | None:
    cells = dialect.split(line)
    if dialect.ragged:
        if cells == ["EOF"]:
            return None
        cells += [""] * (dialect.width - len(cells))
    if len(cells) != dialect.width:
        return RecordingError(
            "line-ragged",
            f"line {number} of {path} has {len(cells)} cells, the others {dialect.width}",
            f"repair this line, or {_of_a_mark(dialect)}",
            path=str(path),
            line=number,
            cells=len(cells),
            columns=dialect.width,
        )
    for at in columns:
        cell = cells[at].strip()
        fits = is_moment(cell) if dialect.kinds[at] is CellKind.MOMENT else is_number(cell, dialect.decimal)
        if cell not in EMPTY and not fits:
            name = dialect.headings[at]
            return RecordingError(
                "cell-not-a-number",
                f"line {number} of {path}, column {name!r}: {cell[:40]!r} is not a number",
                "correct it, or leave it empty if this is not the time"
                if any(is_number(other, dialect.decimal) or is_moment(other) for other in cells)
                else _of_a_mark(dialect),
                path=str(path),
                line=number,
                channel=name,
                value=cell[:40],
            )
    return None


def _of_a_mark(dialect: Dialect) -> str:
    """Remedy for a line that a logger writes where samples are missing: without a time, it alone shows the gap."""
    row = (" " if dialect.spaced else dialect.delimiter).join(["nan"] * dialect.width)
    return (
        f"delete this line if the time continues to rise behind it, replace it by {row!r} if there is no column of "
        "time, or else split the file there"
    )
