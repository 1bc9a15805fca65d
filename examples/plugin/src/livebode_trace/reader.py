"""The reader: the first line is `TRACE1 RATE NAME[UNIT] …`, each other line one value for each name."""

from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import ClassVar

import numpy as np

from livebode.sources import Chunk, Column, Recording, contained, damaged


class TraceRecording(Recording):
    """A trace, read in pieces: `columns` and `rate_hz` are from its first line."""

    format: ClassVar[str] = "trace"

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        with path.open(encoding="utf-8") as file, contained(path, self.format):
            begin, *words = file.readline().split() or [""]
            if begin != "TRACE1" or len(words) < 2:
                raise damaged("its first line is not TRACE1 RATE NAME[UNIT] …")
            self.rate_hz = float(words[0])
        parts = [name.rstrip("]").partition("[") for name in words[1:]]
        self.columns = tuple(Column(name, unit, key=number) for number, (name, _, unit) in enumerate(parts))

    def chunks(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        """The values of these columns, so many rows at a time."""
        with self.path.open(encoding="utf-8") as file:
            file.readline()
            while lines := list(islice(file, rows)):
                yield list(np.loadtxt(lines, usecols=[column.key for column in columns], ndmin=2).T)
