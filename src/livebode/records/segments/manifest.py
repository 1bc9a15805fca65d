"""manifest.jsonl: the closed segments, the journals that they are from, and the removed segments."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, field
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from livebode.core import Event, RecordError
from livebode.dataclass import dataclass
from livebode.records.inside import read_bytes
from livebode.records.json_format import VERSIONS, check_version, format_of
from livebode.records.segments.json_lines import in_line, to_line

if TYPE_CHECKING:
    from livebode.records.segments.damage import Damage
    from livebode.records.segments.journal import Journal

NAME = "manifest.jsonl"
TIERS = ("responses_1s", "responses_1min", "responses_1h")
TABLES = ("responses", "covariance", "parameters", "samples", *TIERS)
_SHA256 = re.compile("[0-9a-f]{64}")
SEGMENT_NAME = re.compile(r"[a-z0-9_]+(?:/(\d{6,9})(?:-(\d{6,9}))?)?\.parquet")


@dataclass(frozen=True)
class SegmentPart:
    """Consecutive bytes of a segment: a row group, or, with no rows, the bytes after the last one."""

    rows: int
    size_bytes: int
    sha256: str

    @property
    def sound(self) -> bool:
        """Whether a run can have written it."""
        numbers = type(self.rows) is int and type(self.size_bytes) is int
        return numbers and self.rows >= 0 < self.size_bytes and bool(_SHA256.fullmatch(self.sha256))


@dataclass(frozen=True)
class Segment:
    """A closed segment: rows of one table as a Parquet file.

    Its rows are from one journal, from several that were merged, or, with the name of the table, those of a whole run.
    `name` is its path in the run's directory; `first_sample`, `last_sample`, `first_s` and `last_s` are the extremes of
    its rows, 0 if it has none; `parts` are its row groups and the end of the file.
    """

    name: str
    table: str
    first_sample: int
    last_sample: int
    first_s: float
    last_s: float
    parts: tuple[SegmentPart, ...]

    @property
    def rows(self) -> int:
        """Number of its rows."""
        return sum(part.rows for part in self.parts)

    @property
    def size_bytes(self) -> int:
        """Size of its file."""
        return sum(part.size_bytes for part in self.parts)

    @property
    def numbers(self) -> tuple[int, int]:
        """The first and the last journal that its rows can be from."""
        return segment_numbers(self.name)

    @classmethod
    def of(cls, first: int, last: int, values: Mapping[str, Any]) -> Segment:
        """The segment of these journals in a line; ValueError if a run cannot have written it."""
        parts = tuple(SegmentPart(**part) for part in values["parts"])
        segment = cls(**{**values, "parts": parts})
        samples, times_s = (segment.first_sample, segment.last_sample), (segment.first_s, segment.last_s)
        sound = (
            segment.table in TABLES
            and segment.name in (name_of(segment.table, first, last), f"{segment.table}.parquet")
            and all(type(value) is int for value in samples)
            and all(type(value) in (int, float) and math.isfinite(value) for value in (*samples, *times_s))
            and all(part.sound for part in parts)
            and all(part.rows for part in parts[:-1])
        )
        if not sound or not parts or parts[-1].rows:
            raise ValueError("the segment is invalid")
        return segment


@dataclass(frozen=True)
class Retained:
    """A damaged journal that was closed: its number, its size, and its damaged places."""

    number: int
    size_bytes: int
    damages: tuple[Damage, ...]

    @classmethod
    def of(cls, number: int, values: Mapping[str, Any]) -> Retained:
        from livebode.records.segments.damage import Damage  # a finished run has none

        return cls(number, int(values["size_bytes"]), tuple(Damage.of(place) for place in values["places"]))

    @classmethod
    def of_journal(cls, run: Path, number: int, read: Journal) -> Retained | None:
        """None if it is intact."""
        if not read.damages:
            return None
        from livebode.records.segments import journal

        return cls(number, (run / journal.name_of(number)).stat().st_size, tuple(read.damages))

    @property
    def event(self) -> Event:
        """The event that reports it."""
        from livebode.records.segments import journal
        from livebode.records.segments.damage import event_of

        return event_of(journal.name_of(self.number), self.damages, journal.set_aside_name(self.number))


@dataclass
class Manifest:
    """Content of manifest.jsonl.

    `segments` are the recorded ones, by age, `gone` those removed for the budget or merged, `closed` the numbers of the
    journals that they are from, and `until` one to which all are closed; `retained` the damaged journals. `merged` has,
    for the name of a segment that was merged, the new segment and the number of its rows before those of the old one.
    `version` is that of the file, `length` that of its complete lines, `torn` the bytes after them, and `broken` the
    numbers of the damaged lines.
    """

    segments: list[Segment] = field(default_factory=list)
    gone: list[Segment] = field(default_factory=list)
    closed: set[int] = field(default_factory=set)
    until: int = 0
    retained: list[Retained] = field(default_factory=list)
    merged: dict[str, tuple[Segment, int]] = field(default_factory=dict)
    version: int = VERSIONS["manifest"]
    length: int = 0
    torn: bytes = b""
    broken: list[int] = field(default_factory=list)
    _removed: set[str] = field(default_factory=set)

    @classmethod
    def read(cls, run: Path) -> Manifest:
        """All intact lines; OSError if there is no file, RecordError if it has another version."""
        data = read_bytes(run, NAME)
        length = data.rfind(b"\n") + 1
        manifest, before = cls(length=length, torn=data[length:]), b""
        for number, line in enumerate(data.splitlines(keepends=True), 1):
            if line != before:  # each is written twice
                manifest._read_line(line, number)
            before = line
        check_version(run / NAME, "manifest", manifest.version)
        manifest.gone += [segment for segment in manifest.segments if segment.name in manifest._removed]
        manifest.segments = [segment for segment in manifest.segments if segment.name not in manifest._removed]
        return manifest

    def is_closed(self, number: int) -> bool:
        """Whether this journal has become segments."""
        return number in self.closed or 0 < number <= self.until

    @property
    def last_closed(self) -> int:
        """The newest journal that has become segments; 0 before the first."""
        return max(self.closed, default=self.until)

    def place(self, name: str) -> tuple[Segment, int] | None:
        """The segment that has the rows of a merged one now, and the number of its rows before them."""
        before, segment = 0, None
        while (step := self.merged.get(name)) is not None:
            segment, name, before = step[0], step[0].name, before + step[1]
        return None if segment is None or segment.name in self._removed else (segment, before)

    def _read_line(self, line: bytes, number: int) -> None:
        for value in in_line(line):
            try:
                if isinstance(value, bytes):
                    raise ValueError
                self._add(value)
            except (ValueError, TypeError, KeyError, AttributeError):
                if line.endswith(b"\n"):
                    self.broken.append(number)

    def _add(self, value: Mapping[str, Any]) -> None:
        if "format" in value:
            self.version = int(value["version"])
            return
        if "removed" in value:
            self._removed |= set(value["removed"])
            return
        if "closed_until" in value:
            self._shorten(value)
            return
        if "merged" in value:
            self._merge(value["merged"], value["segment"])
            return
        number = value["closed"]
        if type(number) is not int or not 0 < number < 10**9:
            raise ValueError
        segments = [Segment.of(number, number, segment) for segment in value["segments"]]
        retained = [Retained.of(number, value["retained"])] if "retained" in value else []
        if not self.is_closed(number):
            self.closed.add(number)
            self.segments += segments
            self.retained += retained

    def _shorten(self, value: Mapping[str, Any]) -> None:
        """Take the line that replaces all earlier ones."""
        until = value["closed_until"]
        if type(until) is not int or not 0 <= until < 10**9:
            raise ValueError
        segments = [Segment.of(*segment_numbers(values["name"]), values) for values in value["segments"]]
        retained = [Retained.of(int(values["number"]), values) for values in value["retained"]]
        by_name = {segment.name: segment for segment in segments}
        for new, name, rows in value["places"]:
            self.merged[str(name)] = by_name[new], int(rows)
        self.segments, self.retained, self.until, self.closed = segments, retained, until, set()

    def _merge(self, names: Sequence[str], values: Mapping[str, Any]) -> None:
        index = {segment.name: number for number, segment in enumerate(self.segments)}
        parts = [self.segments[index[name]] for name in names]
        segment = Segment.of(parts[0].numbers[0], parts[-1].numbers[1], values)
        if len(parts) < 2 or {part.table for part in parts} != {segment.table}:
            raise ValueError
        before = 0
        for part in parts:
            self.merged[part.name] = segment, before
            before += part.rows
        if before != segment.rows:
            raise ValueError
        self.segments[index[names[0]]] = segment
        self.gone += parts
        self.segments = [segment for segment in self.segments if segment.name not in self.merged]

    @property
    def missing(self) -> list[tuple[int, int]]:
        """First and last numbers of closed journals whose line is damaged, so that their segments are not known."""
        known = [self.until, *sorted(self.closed)] if self.broken else []
        return [(a + 1, b - 1) for a, b in pairwise(known) if b > a + 1]

    def is_short(self, journals: Sequence[int]) -> bool:
        """Whether its last lines are missing, where these are the numbers of the existing journals."""
        return not self.broken and min(journals, default=0) > self.last_closed + 1

    def check(self, run: Path, journals: Sequence[int]) -> None:
        """RecordError if lines are missing that were written: their segments would be lost; see `is_short`."""
        if self.is_short(journals):
            raise RecordError(
                "damaged",
                f"{str(run / NAME)!r} is damaged after byte {self.length}",
                "restore it from a backup",
                path=str(run / NAME),
                offset_bytes=self.length,
            )


def name_of(table: str, first: int, last: int) -> str:
    """Path of the file of a table's rows from one journal, or from the first to the last one, in the run's directory.

    >>> name_of("responses", 7, 7), name_of("responses", 1, 32)
    ('responses/000007.parquet', 'responses/000001-000032.parquet')
    """
    return f"{table}/{first:06d}.parquet" if first == last else f"{table}/{first:06d}-{last:06d}.parquet"


def segment_numbers(name: str) -> tuple[int, int]:
    """The numbers in `name_of`, 1 and 1 for the name of a table; ValueError for another name."""
    numbers = SEGMENT_NAME.fullmatch(name)
    if numbers is None:
        raise ValueError(f"{name!r} is not the name of a segment")
    first = int(numbers[1] or 1)
    return first, int(numbers[2] or first)


def short_line(
    until: int,
    segments: Iterable[Segment],
    retained: Iterable[Retained],
    places: Iterable[tuple[str, str, int]],
) -> bytes:
    """Line: all journals up to this number are closed, and these are their segments; it replaces all earlier lines.

    `places` are those of `Manifest.merged` that a reader may still need: new name, old name, number of rows before.
    """
    damaged = [{"number": damaged_journal.number} | _to_json(damaged_journal) for damaged_journal in retained]
    line = {"closed_until": until, "segments": [asdict(segment) for segment in segments]}
    return to_line(line | {"retained": damaged, "places": list(places)}) * 2


def first_line() -> bytes:
    """Line: the format of the file; written twice."""
    return to_line(format_of("manifest")) * 2


def closing_line(number: int, segments: Iterable[Segment], retained: Retained | None) -> bytes:
    """Line: a journal's rows are now in these segments; written twice, because it is the only reference to them."""
    line: dict[str, Any] = {"closed": number, "segments": [asdict(segment) for segment in segments]}
    if retained is not None:
        line["retained"] = _to_json(retained)
    return to_line(line) * 2


def _to_json(retained: Retained) -> dict[str, Any]:
    return {"size_bytes": retained.size_bytes, "places": [place.to_json() for place in retained.damages]}


def merge_line(parts: Iterable[Segment], segment: Segment) -> bytes:
    """Line: the rows of these segments are now in another one; written twice, because it is the only reference."""
    return to_line({"merged": [part.name for part in parts], "segment": asdict(segment)}) * 2


def removal_line(segments: Iterable[Segment]) -> bytes:
    """Line: these segments were removed to meet the disk budget; also written twice."""
    gone = list(segments)
    return to_line({"removed": [s.name for s in gone], "size_bytes": sum(s.size_bytes for s in gone)}) * 2
