"""Progress in a followed file or directory: marks to continue at, and the lines between two marks."""

from __future__ import annotations

import zlib
from dataclasses import asdict, replace
from pathlib import Path
from typing import BinaryIO, Literal, Self

from livebode.dataclass import dataclass
from livebode.sources.live.position import Mark

PIECE_BYTES = 1 << 19
LINE_BYTES_MAX = 1 << 20


class _Plain:
    """A mark as plain data."""

    def as_plain(self) -> Mark:
        return asdict(self)  # type: ignore[call-overload, no-any-return]

    @classmethod
    def of(cls, mark: Mark) -> Self:
        return cls(**mark)


@dataclass(frozen=True)
class FileMark(_Plain):
    """A piece of a file: `rows` rows and `offset` bytes of CRC-32 `crc` are before it, `end` of `end_crc` with it."""

    offset: int
    rows: int
    crc: int
    end: int
    end_crc: int

    @classmethod
    def start(cls, file: BinaryIO, offset: int) -> FileMark:
        """Mark before the first row, `offset` bytes from the beginning of the file."""
        crc, _ = _checksum(file, 0, offset, 0)
        return cls(offset, 0, crc, offset, crc)

    def kept_in(self, file: BinaryIO) -> Literal["all", "most", "none"]:
        """Whether the file begins with all that was read, with all before the last piece, or with neither."""
        crc, at = _checksum(file, 0, self.offset, 0)
        if (crc, at) != (self.crc, self.offset):
            return "none"
        if _checksum(file, self.offset, self.end, crc) == (self.end_crc, self.end):
            return "all"
        return "most" if self.rows else "none"  # two files may begin with the same headings


@dataclass(frozen=True)
class FolderMark(_Plain):
    """A file of a directory, with the CRC-32 `crc` of its bytes.

    `seen` is the name before it, `counted` the rows up to there, `stop` those with it; `last` is the number of the
    sample after its last one, if it was read completely; `timed`: a time column numbers its samples.
    """

    name: str
    crc: int
    seen: str
    counted: int
    timed: bool
    stop: int = 0
    last: int | None = None


@dataclass(frozen=True)
class CompleteLines:
    """Complete lines, and their position."""

    raw: bytes
    mark: FileMark

    @property
    def after(self) -> FileMark:
        """Behind it."""
        mark, rows = self.mark, self.mark.rows + self.raw.count(b"\n")
        return FileMark(mark.end, rows, mark.end_crc, mark.end, mark.end_crc)


class FileLines:
    """Reads a growing file in pieces of complete lines, from a mark."""

    def __init__(self, file: BinaryIO, begin: FileMark, encoding: str) -> None:
        self._file, self._encoding, self._at = file, encoding, begin
        self._begun = b""
        self.cut = False
        """Whether a line of the last piece was skipped because it is too long."""
        file.seek(begin.offset)

    def read(self, until: int) -> CompleteLines | None:
        """The next lines, which do not cross byte `until`; None if nothing was added."""
        before = until - self._file.tell()
        read = self._file.read(min(PIECE_BYTES, before) if before > 0 else PIECE_BYTES)
        if not read:
            return None
        lines, self._begun = whole_lines(self._begun + read, self._encoding)
        at = self._at
        piece = CompleteLines(lines, replace(at, end=at.offset + len(lines), end_crc=zlib.crc32(lines, at.crc)))
        self._at = piece.after
        self.cut = len(self._begun) > LINE_BYTES_MAX
        if self.cut:
            self._skip()
        return piece

    def _skip(self) -> None:
        end, crc = self._at.offset + len(self._begun), zlib.crc32(self._begun, self._at.crc)
        self._at, self._begun = FileMark(end, self._at.rows, crc, end, crc), b""


def checksum(path: Path) -> int:
    """CRC-32 of a whole file."""
    with path.open("rb") as file:
        return _checksum(file, 0, path.stat().st_size, 0)[0]


def _checksum(file: BinaryIO, first: int, last: int, crc: int) -> tuple[int, int]:
    """`crc` continued over the bytes from `first` to before `last`, and where the file ends if it ends earlier."""
    file.seek(first)
    while first < last and (piece := file.read(min(PIECE_BYTES, last - first))):
        crc, first = zlib.crc32(piece, crc), first + len(piece)
    return crc, first


def whole_lines(raw: bytes, encoding: str) -> tuple[bytes, bytes]:
    r"""The complete lines, and the beginning of the next.

    >>> whole_lines(b"1,2\n3,4\n5", "utf-8")
    (b'1,2\n3,4\n', b'5')
    """
    end = {"utf-16-le": b"\n\0", "utf-16-be": b"\0\n"}.get(encoding, b"\n")
    at = raw.rfind(end)
    at = at + len(end) if at >= 0 else 0
    return raw[:at], raw[at:]
