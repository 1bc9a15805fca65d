"""The journal: what was recorded since the last segment was closed, with the state to go on from."""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import pyarrow as pa

from livebode.records.segments.frames import COMMIT, ROWS, SCHEMA, to_frame, whole_frames
from livebode.records.table import Table

FOLDER = "open"
_LENGTH = struct.Struct("<I")


@dataclass(frozen=True)
class Commit:
    """A moment up to which the record is complete.

    Attributes
    ----------
    sample, time_s
        Number of the next sample, which is not in the record yet, and its time in the source's clock.
    unix_s
        When this was written, seconds since 1970.
    events_bytes
        Length of events.jsonl then.
    states
        What goes on from there, as named bytes.
    """

    sample: int
    time_s: float
    unix_s: float
    events_bytes: int
    states: Mapping[str, bytes]

    @property
    def position(self) -> tuple[int, int]:
        """What grows from one commit to the next."""
        return self.sample, self.events_bytes

    def to_frame(self) -> bytes:
        head = {"sample": self.sample, "time_s": self.time_s, "unix_s": self.unix_s, "events_bytes": self.events_bytes}
        text = json.dumps(head | {"states": {name: len(state) for name, state in self.states.items()}}).encode()
        return to_frame(COMMIT, _LENGTH.pack(len(text)), text, *self.states.values())

    @classmethod
    def of(cls, payload: memoryview) -> Commit:
        at = _LENGTH.size + _LENGTH.unpack_from(payload)[0]
        head = json.loads(bytes(payload[_LENGTH.size : at]))
        states = {}
        for name, length in head.pop("states").items():
            states[name] = bytes(payload[at : at + length])
            at += length
        return cls(**head, states=states)


@dataclass
class Journal:
    """What a journal holds up to its last commit; nothing and no commit where there is none.

    Attributes
    ----------
    rows
        Record batches of each table.
    commit
        The last one, up to whose end the journal counts.
    length
        Bytes up to there; what is behind them was being written when it ended.
    """

    rows: dict[str, list[pa.RecordBatch]] = field(default_factory=dict)
    commit: Commit | None = None
    length: int = 0

    @classmethod
    def read(cls, path: Path) -> Journal:
        """The journal in this file; OSError where it cannot be read."""
        data = path.read_bytes()
        found, names, schemas, last = cls(), [], [], None
        waiting: list[tuple[int, memoryview]] = []
        for kind, table, payload, end in whole_frames(data):
            if kind == SCHEMA:
                name, _, schema = bytes(payload).partition(b"\0")
                names.append(name.decode())
                schemas.append(pa.ipc.read_schema(pa.py_buffer(schema)))
            elif kind == ROWS:
                waiting.append((table, payload))
            elif kind == COMMIT:
                last, found.length = payload, end
                for at, message in waiting:
                    batch = pa.ipc.read_record_batch(pa.py_buffer(message), schemas[at])
                    found.rows.setdefault(names[at], []).append(batch)
                waiting.clear()
        if last is not None:
            found.commit = Commit.of(last)
        return found


def head(tables: Mapping[str, Table]) -> bytes:
    """How a journal begins: the names and schemas of its tables."""
    return b"".join(
        to_frame(SCHEMA, name.encode() + b"\0", table.schema.serialize().to_pybytes()) for name, table in tables.items()
    )


def path_of(run: Path, number: int) -> Path:
    return run / FOLDER / f"{number:06d}.journal"


def numbers(run: Path) -> list[int]:
    """Of the journals that are there, ascending."""
    return sorted(int(path.stem) for path in (run / FOLDER).glob("*.journal") if path.stem.isdecimal())
