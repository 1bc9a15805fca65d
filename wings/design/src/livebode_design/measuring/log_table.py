"""LogTable: the samples of a measurement as a text table, which is complete at any moment up to its last line."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Self

import numpy as np

from livebode.core import Block, writing


class LogTable:
    """Appends Blocks to a new CSV file with a time column.

    Raises
    ------
    OutputError
        If the disk reports an error.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        with writing(path):
            self._file = path.open("x", encoding="utf-8")
        self._empty = True

    def append(self, block: Block) -> None:
        """Write the samples of a Block."""
        text = io.StringIO()
        if self._empty:
            units = [f"{c.name} [{c.unit}]" if c.unit else c.name for c in block.channels]
            text.write(",".join(["t [s]", *units]) + "\n")
            self._empty = False
        time_s = np.arange(block.start, block.start + len(block)) / block.rate_hz
        np.savetxt(text, np.vstack([time_s, block.data]).T, fmt="%.12g", delimiter=",")
        with writing(self._path):
            self._file.write(text.getvalue())
            self._file.flush()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()
