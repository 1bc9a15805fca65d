"""manifest.jsonl: which closed segments there are, which journals they came from, and which were removed."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from livebode.nouns import InputError
from livebode.records.segments.json_lines import to_line, whole_lines

NAME = "manifest.jsonl"


@dataclass(frozen=True)
class Segment:
    """A closed segment: one table's rows from one journal, as a Parquet file.

    `name` is its path in the run's directory; `first_s` and `last_s` are the times of its first and last row.
    """

    name: str
    table: str
    rows: int
    first_sample: int
    last_sample: int
    first_s: float
    last_s: float
    size_bytes: int
    sha256: str

    def read(self, run: Path) -> pa.Table:
        """Its rows; InputError where the file is not what the manifest says, FileNotFoundError where it is gone."""
        path = run / self.name
        data = path.read_bytes()
        if len(data) != self.size_bytes or hashlib.sha256(data).hexdigest() != self.sha256:
            raise InputError(f"{str(path)!r} is damaged: its checksum is not that of the manifest")
        # Without Arrow's threads, which a short process may not outlive in peace.
        return pq.ParquetFile(pa.BufferReader(data)).read(use_threads=False)


@dataclass
class Manifest:
    """What manifest.jsonl says.

    `segments` are those that stand, by age, `closed` the numbers of the journals that they came from; `length` is that
    of its whole lines, and `torn` what is behind them.
    """

    segments: list[Segment] = field(default_factory=list)
    closed: set[int] = field(default_factory=set)
    length: int = 0
    torn: bytes = b""

    @classmethod
    def read(cls, run: Path) -> Manifest:
        """Up to the first damaged line; OSError where there is none."""
        data = (run / NAME).read_bytes()
        lines, length = whole_lines(data)
        found = cls(length=length, torn=data[length:])
        for line in lines:
            if "closed" in line:
                found.closed.add(line["closed"])
                found.segments += [Segment(**segment) for segment in line["segments"]]
            else:
                gone = set(line["removed"])
                found.segments = [segment for segment in found.segments if segment.name not in gone]
        return found

    def check(self, run: Path, journals: Sequence[int], *, finished: bool) -> None:
        """InputError where a line is missing that was written whole once: what it names would be forgotten.

        `journals` are the numbers of those that are there. A line may be torn at the end, where the journal that it was
        to close is still there.
        """
        whole = not self.torn if finished else self.torn.count(b"\n") < 2
        if not whole or min(journals, default=0) > max(self.closed, default=0) + 1:
            raise InputError(f"{str(run / NAME)!r} is damaged after byte {self.length}; restore it")


def closing_line(journal: int, segments: Iterable[Segment]) -> bytes:
    """A journal's rows are in these segments from now on."""
    return to_line({"closed": journal, "segments": [asdict(segment) for segment in segments]})


def removal_line(segments: Iterable[Segment]) -> bytes:
    """These segments were removed to keep the disk budget."""
    gone = list(segments)
    return to_line({"removed": [s.name for s in gone], "size_bytes": sum(s.size_bytes for s in gone)})
