"""A byte stream simplified for the reader of rows: UTF-8 without comments, blank lines and a final Ctrl-Z.

Where blanks separate columns, each run of them becomes a tab.
"""

from __future__ import annotations

import codecs
import io
import re
from typing import BinaryIO

from livebode.sources.dialect import Dialect

PIECE = 1 << 20
COMMENT = re.compile(r"(?m)^[ \t]*[#%].*\n?")
BLANK_LINE = re.compile(r"(?m)^[ \x1a]+\r?(?:\n|\Z)")
END_MARK = "\x1a"
"""Ctrl-Z, which DOS programs and LabVIEW write at the end of a text."""
MARGINS = re.compile(r"(?m)^[ \t]+|[ \t]+(?=\r?$)")
BLANKS = re.compile(r"[ \t]+")


class Tidied(io.RawIOBase):
    r"""The text of `raw` from its current position, simplified line by line as its dialect needs it.

    >>> blanks = Dialect("\t", True, ".")
    >>> io.BufferedReader(Tidied(io.BytesIO(b"  1   2 \n# note\n 3 4"), blanks)).read()
    b'1\t2\n3\t4'
    """

    def __init__(self, raw: BinaryIO, dialect: Dialect) -> None:
        self._raw, self._dialect = raw, dialect
        # A ragged table grows by its width with each short line: its pieces are as much smaller.
        self._piece = max(1 << 12, PIECE // max(dialect.width, 1)) if dialect.ragged else PIECE
        self._decoder = codecs.getincrementaldecoder(dialect.encoding)("replace")
        self._kept = ""
        self._ready = b""
        self._done = False

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: bytearray | memoryview) -> int:  # type: ignore[override]
        while not self._ready and not self._done:
            self._fill()
        count = min(len(buffer), len(self._ready))
        buffer[:count] = self._ready[:count]
        self._ready = self._ready[count:]
        return count

    def _fill(self) -> None:
        raw = self._raw.read(self._piece)
        self._done = not raw
        text = self._kept + self._decoder.decode(raw, final=self._done)
        end = len(text) if self._done else text.rfind("\n") + 1
        if end == 0 and len(text) > 4 * PIECE:  # no valid line is this long; the reader of rows reports it
            end = len(text)
        text, self._kept = text[:end], text[end:]
        text = BLANK_LINE.sub("", COMMENT.sub("", text))
        if self._done:
            text = text.rstrip(END_MARK)
        if self._dialect.ragged:
            lines = (line.rstrip("\r") for line in text.split("\n"))
            text = "".join(self._filled(line) for line in lines if line.strip() not in ("", "EOF"))
        elif self._dialect.spaced:
            text = BLANKS.sub("\t", MARGINS.sub("", text))
        self._ready = text.encode("utf-8")

    def _filled(self, line: str) -> str:
        if self._dialect.spaced:
            line = "\t".join(self._dialect.split(line))
        missing = self._dialect.width - 1 - line.count(self._dialect.delimiter)
        return f"{line}{self._dialect.delimiter * missing}\n"
