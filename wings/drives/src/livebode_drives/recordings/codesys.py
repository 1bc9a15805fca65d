"""Traces of CODESYS 3 and of controls with it (ctrlX and others) as text: one variable after the other."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import IO, ClassVar

import numpy as np

from livebode.core import RecordingError
from livebode.dataclass import dataclass
from livebode.sources import COLUMNS_MAX, Chunk, Column, Recording, Skipped, damaged, oversized
from livebode_drives.recordings.timed_columns import TimedColumns, as_columns
from livebode_drives.recordings.twincatwords import unique_names

VARIABLE = re.compile(rb"(\d+)\.Variable;(.*)")
DATA = re.compile(rb"\d+\.Data;")
FLAGS = re.compile(rb"Flags;[ \t]*(\d{1,10})\s*$")
IN_MS, IN_US = 0x10, 0x20
"""Flags of a trace: the unit of its times."""
LINE_BYTES_MAX = 1 << 16
WORDS = {b"TRUE": 1.0, b"FALSE": 0.0}
TIME, VALUE = 1, 2


@dataclass(frozen=True)
class TracedVariable:
    """The samples of a variable: byte and line at which they begin, their number, and a fingerprint of their times."""

    name: str
    position: int
    line: int
    samples: int
    times: bytes
    is_text: bool


class CodesysRecording(Recording):
    """A trace. Channels have the names of the variables; those of equal times have one clock."""

    format: ClassVar[str] = "codesys"

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        with path.open("rb") as file:
            unit, sections = read_sections(file)
        names = unique_names([section.name for section in sections], [""] * len(sections))
        sections = [replace(section, name=name) for section, name in zip(sections, names)]
        self.skipped = tuple(Skipped(section.name, why) for section in sections if (why := unusable(section)))
        groups: dict[tuple[int, bytes], list[Column]] = {}
        for section in sections:
            if not unusable(section):
                channel = Column(section.name, key=(section, VALUE))
                groups.setdefault((section.samples, section.times), []).append(channel)
        timed = [
            TimedColumns(Column("t", unit, key=(channels[0].key[0], TIME)), tuple(channels), samples)
            for (samples, _), channels in groups.items()
        ]
        self.columns = tuple(as_columns(sorted(timed, key=lambda group: -len(group.channels))))

    def chunks(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        sections = list(dict.fromkeys(column.key[0] for column in columns))
        place = {section: section.position for section in sections}
        samples = columns[0].samples or 0
        with self.path.open("rb") as file:
            for first in range(0, samples, rows):
                count = min(rows, samples - first)
                read: dict[TracedVariable, list[tuple[float, float]]] = {}
                for section in sections:
                    file.seek(place[section])
                    read[section] = [row_of(file, section.line + first + k) for k in range(count)]
                    place[section] = file.tell()
                yield [
                    np.array([row[column.key[1] - TIME] for row in read[column.key[0]]], dtype=np.float64)
                    for column in columns
                ]


def unusable(section: TracedVariable) -> str:
    return "it has no samples" if not section.samples else "it contains text" if section.is_text else ""


def read_sections(file: IO[bytes]) -> tuple[str, list[TracedVariable]]:
    """Unit of the times, and the variables; the values are not read."""
    unit, name, number = "ms", "", 0
    sections: list[TracedVariable] = []
    while line := file.readline(LINE_BYTES_MAX):
        number += 1
        if match := FLAGS.match(line):
            unit = "us" if int(match[1]) & (IN_MS | IN_US) == IN_US else "ms"
        elif match := VARIABLE.match(line):
            name = match[2].decode("utf-8", "replace").strip()
        elif DATA.match(line):
            section = read_section(file, name, number + 1)
            number += section.samples
            sections.append(section)
            if len(sections) > COLUMNS_MAX:
                raise oversized(f"the trace has more than {COLUMNS_MAX} variables", COLUMNS_MAX)
    return unit, sections


def read_section(file: IO[bytes], name: str, number: int) -> TracedVariable:
    """The samples from here to the first line that is not one, which remains to be read."""
    start = end = file.tell()
    samples, digest, is_text = 0, hashlib.blake2b(), False
    while (line := file.readline(LINE_BYTES_MAX)).startswith(b";"):
        cells = line.split(b";", 2)
        is_text = is_text or (samples == 0 and len(cells) > VALUE and not is_value(cells[VALUE].strip()))
        digest.update(cells[TIME].strip() + b";")
        samples += 1
        end = file.tell()
    file.seek(end)
    return TracedVariable(name, start, number, samples, digest.digest(), is_text)


def row_of(file: IO[bytes], number: int) -> tuple[float, float]:
    """Time and value of the next line."""
    line = file.readline(LINE_BYTES_MAX)
    cells = [cell.strip() for cell in line.split(b";", VALUE)]
    if len(cells) <= VALUE:
        raise damaged(f"line {number} is not '; time; value'", line=number)
    for cell in cells[TIME:]:
        if not is_value(cell):
            shown = cell[:40].decode("utf-8", "replace")
            raise RecordingError(
                "cell-not-a-number",
                f"line {number}: {shown!r} is not a number",
                "correct it",
                line=number,
                value=shown,
            )
    return as_number(cells[TIME]), as_number(cells[VALUE])


def is_value(cell: bytes) -> bool:
    try:
        as_number(cell)
    except ValueError:
        return False
    return True


def as_number(cell: bytes) -> float:
    """
    >>> as_number(b"-1.5"), as_number(b"1,5"), as_number(b"TRUE")
    (-1.5, 1.5, 1.0)
    """
    if b"_" in cell:  # float would ignore it
        raise ValueError(cell)
    return WORDS[cell] if cell in WORDS else float(cell.replace(b",", b"."))
