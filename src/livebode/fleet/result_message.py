"""Messages of results: the responses of the axes of a partition as one Arrow table, with its events."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
import pyarrow as pa

from livebode.arrow import from_numpy
from livebode.core import Responses
from livebode.fleet.axis_stream import RESPONSE_BYTES, AxisStream, Output
from livebode.records.response_table import SCHEMA as RESPONSE_SCHEMA
from livebode.records.response_table import as_batch

SCHEMA = pa.schema([("axis", pa.string()), ("run", pa.int64()), ("number", pa.int64()), *RESPONSE_SCHEMA])
"""Columns: key of the axis, number in the log of the first message of its run, number of the response within that run,
and those of responses.parquet."""
_META = b"livebode"
_EVENT_BYTES = 500
"""Of an event without its sentence."""


@dataclass(frozen=True)
class ResultMessage:
    """What the owner of a partition stores at once.

    Attributes
    ----------
    through
        Number in the log: the outputs of all messages of the partition up to it are stored.
    owner
        Name of the process that stored it.
    claim
        Whether it only claims the partition, without results.
    rows
        As in `SCHEMA`.
    events
        With axis, kind, sample, time_s, message and details each.
    recipes
        Recipe of each axis in it.
    """

    through: int
    owner: str
    claim: bool = False
    rows: pa.Table = field(default_factory=SCHEMA.empty_table)
    events: Sequence[Mapping[str, Any]] = ()
    recipes: Mapping[str, str] = field(default_factory=dict)

    def to_bytes(self) -> bytes:
        """Arrow's stream format, compressed; everything except the rows in the metadata of its schema."""
        about = {name: getattr(self, name) for name in ("through", "owner", "claim", "events", "recipes")}
        table = self.rows.replace_schema_metadata({_META: json.dumps(about).encode()})
        sink = pa.BufferOutputStream()
        with pa.ipc.new_stream(sink, table.schema, options=pa.ipc.IpcWriteOptions(compression="zstd")) as writer:
            writer.write_table(table)
        return bytes(sink.getvalue())

    @classmethod
    def from_bytes(cls, data: bytes) -> ResultMessage:
        """The message in these bytes."""
        table = pa.ipc.open_stream(data).read_all()
        return cls(rows=table, **json.loads(table.schema.metadata[_META]))


class PendingResults:
    """Outputs that are not stored yet."""

    def __init__(self) -> None:
        self._responses: dict[tuple[str, int], list[tuple[int, Responses]]] = {}
        self._events: list[dict[str, Any]] = []
        self._recipes: dict[str, str] = {}
        self.nbytes = 0

    def __bool__(self) -> bool:
        return bool(self._responses or self._events)

    def add(self, key: str, stream: AxisStream, output: Output) -> None:
        """Append the output of a message of this axis."""
        self._events += [{"axis": key, "run": stream.run, **asdict(event)} for event in output.events]
        self.nbytes += sum(_EVENT_BYTES + len(event.message) for event in output.events)
        if output.responses is not None:
            self._responses.setdefault((key, stream.run), []).append((output.number, output.responses))
            self.nbytes += output.responses.value.size * RESPONSE_BYTES
        if output.responses is not None or output.events:
            self._recipes[key] = stream.recipe

    def add_event(self, key: str, event: Mapping[str, Any]) -> None:
        """Append an event that no message of the log causes."""
        self._events.append({"axis": key, **event})

    def message(self, through: int, owner: str) -> ResultMessage:
        """All of them as one message."""
        batches = [
            response_rows(key, run, outputs[0][0], Responses.join([responses for _, responses in outputs]))
            for (key, run), outputs in self._responses.items()
        ]
        # One batch instead of one for each axis: buffers of a few rows are neither small nor fast to compress.
        rows = pa.Table.from_batches(batches, SCHEMA).combine_chunks()
        return ResultMessage(through, owner, rows=rows, events=self._events, recipes=self._recipes)


def response_rows(key: str, run: int, number: int, responses: Responses) -> pa.RecordBatch:
    """The responses as rows of `SCHEMA`, those of an axis's run that begin with this number."""
    batch = as_batch(responses)
    numbers = np.repeat(np.arange(number, number + len(responses)), len(responses.lines))
    columns = [_repeated(key, len(numbers)), from_numpy(np.full_like(numbers, run)), from_numpy(numbers)]
    return pa.RecordBatch.from_arrays([*columns, *batch.columns], schema=SCHEMA)


def _repeated(word: str, times: int) -> pa.Array[Any]:
    letters = word.encode()
    ends = np.arange(times + 1, dtype=np.int32) * len(letters)
    return pa.Array.from_buffers(pa.string(), times, [None, pa.py_buffer(ends), pa.py_buffer(letters * times)])
