"""Recording: the common form of all formats. Column: one series of values. The errors of all readers."""

from __future__ import annotations

import re
import warnings
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from livebode.core import LivebodeError, RecordingError
from livebode.dataclass import dataclass
from livebode.locations import LocalCopy, Location, original, with_originals
from livebode.tables import PACKED_MAX


def damaged(message: str, **facts: object) -> RecordingError:
    """The error for content that contradicts its format."""
    return RecordingError("damaged", message, "copy or export the file again", **facts)


def truncated(message: str, **facts: object) -> RecordingError:
    """The error for a file that ends before its content does."""
    return RecordingError("truncated", message, "check that the file was copied completely", **facts)


def oversized(message: str, limit: int, **facts: object) -> RecordingError:
    """The error for more columns, parts or bytes than are read."""
    return RecordingError("too-large", message, "check that this is a recording", limit=limit, **facts)


def check_packed(path: Path, values: int) -> None:
    """RecordingError if a file declares more numbers than any compression fits into it."""
    stored = path.stat().st_size
    if 8 * values > PACKED_MAX * stored:
        raise damaged(f"it declares {values} numbers in {stored} bytes", declared=values, size_bytes=stored)


Chunk = list[NDArray[Any]]
"""One array for each requested column, of equal length, any numeric type; int64 nanoseconds for temporal ones."""

COLUMNS_MAX = 20_000
"""A file with more columns is treated as damaged."""


@dataclass(frozen=True)
class Column:
    """A series of numbers in a file.

    Parameters
    ----------
    name
        Name by which the user requests it; a path if the format nests.
    unit
        Empty if the file does not contain it.
    samples
        Number of values; None if only reading gives it.
    aliases
        Other names of this column.
    temporal
        True for dates and durations: usable as time only, read as int64 nanoseconds.
    key
        Where the values are, for the format's own use.
    group
        What it is sampled with, where the format defines it: columns of two groups have clocks of their own.
    clock
        True for the time column of its group.
    """

    name: str
    unit: str = ""
    samples: int | None = None
    aliases: tuple[str, ...] = ()
    temporal: bool = False
    key: Any = field(default=None, repr=False, compare=False)
    group: str = ""
    clock: bool = False


@dataclass(frozen=True)
class Skipped:
    """Something in the file that is not a channel, and why."""

    name: str
    reason: str


class Recording(ABC):
    """A file opened by its format: the columns in it and a way to stream them.

    A subclass sets `columns` in `__init__` from the head of the file, and opens the file again in each `chunks`.
    """

    format: ClassVar[str]
    named_by_file: ClassVar[bool] = False
    """Whether programs write the file's name before that of a variable; elsewhere that place is a topic or a group."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.copy: LocalCopy | None = None
        """What `path` is a copy of, if that is at a URL; it exists as long as this."""
        self.columns: tuple[Column, ...] = ()
        self.skipped: tuple[Skipped, ...] = ()
        self.scalars: Mapping[str, float] = {}
        """Single numbers of the file by name, such as fs."""
        self.rate_hz: float | None = None
        """Rate where the format itself defines it."""
        self.breaks: tuple[int, ...] = ()
        """Rows at which a new record begins though no sample is counted as missing."""

    @property
    def place(self) -> Location:
        """Where the recording is, for its user: its path or URL."""
        return self.path if self.copy is None else self.copy.url

    def without_file(self, name: str) -> str:
        """The name of a channel or an expression without that of the file, as dSPACE writes it."""
        return _without_prefix(name, self.place.stem) if self.named_by_file else name

    @abstractmethod
    def chunks(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        """The values of `columns` (one common length) from the first to the last, about `rows` at a time."""


class ArrayRecording(Recording):
    """Columns in memory: signals of a Python session, or what a live source sent.

    Parameters
    ----------
    place
        Where they are from, for errors.
    columns
        Each with its samples as `key`, shape (samples,); all of one length.
    """

    format = "arrays"

    def __init__(self, place: Location, columns: Sequence[Column]) -> None:
        super().__init__(Path(str(place)))
        self._place = place
        self.columns = tuple(columns)

    @property
    def place(self) -> Location:
        """Where they are from."""
        return self._place

    def chunks(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        """The samples of these columns, about `rows` at a time."""
        for first in range(0, columns[0].key.size, rows):
            yield [column.key[first : first + rows] for column in columns]


def _without_prefix(name: str, prefix: str) -> str:
    """The name without the prefix at its beginning, or at that of a channel in an expression.

    >>> _without_prefix("meas1.Y(3).Data - meas1.Y(4).Data", "meas1"), _without_prefix("meas10.speed", "meas1")
    ('Y(3).Data - Y(4).Data', 'meas10.speed')
    """
    return re.sub(rf"(?<![\w.]){re.escape(prefix)}\.(?=\w)", "", name)


@contextmanager
def contained(path: Path, kind: str) -> Iterator[None]:
    """Convert any error of a library on a damaged file into a RecordingError of one sentence that names the file.

    >>> with contained(Path("a.mat"), "MATLAB"):
    ...     raise KeyError("mdtype 77")
    Traceback (most recent call last):
        ...
    livebode.RecordingError: cannot read a.mat as MATLAB: mdtype 77; check that the file is complete and of this format
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the libraries warn before they fail; only the failure matters
            yield
    except LivebodeError as error:
        raise named(error, path) from error.__cause__
    except PermissionError:
        raise RecordingError(
            "not-readable", f"no permission to read {path}", "ask for read access to it", path=str(path)
        ) from None
    except MemoryError:
        place = original(str(path))
        raise RecordingError(
            "damaged",
            f"{place} declares more data than fits in memory",
            "check that the file is not damaged",
            path=place,
        ) from None
    except Exception as error:
        lines = str(error.args[0] if isinstance(error, KeyError) and error.args else error).strip().splitlines()
        reason = original((lines[0] if lines else type(error).__name__)[:200].rstrip(" ."))
        place = original(str(path))
        raise RecordingError(
            "damaged",
            f"cannot read {place} as {kind}: {reason}",
            "check that the file is complete and of this format",
            path=place,
            format=kind,
        ) from error


@contextmanager
def located(path: Location) -> Iterator[None]:
    """Errors inside it name the file, as a fact and at the beginning of their message."""
    try:
        yield
    except LivebodeError as error:
        raise named(error, path) from error.__cause__


def named(error: LivebodeError, path: Location) -> LivebodeError:
    """The error with the name of its file, or its URL; unchanged if it already names a file."""
    if "path" not in error.facts:
        error.facts["path"] = str(path)
        error = error.at(str(path))
    return with_originals(error)


def guarded(chunks: Iterator[Chunk], path: Path, kind: str) -> Iterator[Chunk]:
    """`chunks`, with any error of reading converted to RecordingError."""
    while True:
        chunk: Chunk | None = None
        with contained(path, kind):
            chunk = next(chunks, None)
        if chunk is None:
            return
        yield chunk


def stacked(chunk: Chunk) -> NDArray[np.float64]:
    """The arrays of a chunk as rows of float64, shape (channels, samples); one float64 array is not copied."""
    with np.errstate(all="ignore"):  # wider types than float64 may overflow to infinity
        if len(chunk) == 1:
            return np.asarray(chunk[0], dtype=np.float64)[np.newaxis]
        data = np.empty((len(chunk), len(chunk[0])))
        for row, values in zip(data, chunk, strict=True):
            row[:] = values
    return data
