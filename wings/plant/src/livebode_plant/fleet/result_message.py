"""Messages of results: responses and parameters of the axes of a partition as tables, with its events."""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import asdict, field
from hashlib import blake2b
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from livebode.core import FleetError, Parameters, Responses
from livebode.dataclass import dataclass
from livebode.records import PARAMETER_SCHEMA, parameter_rows
from livebode.tables import from_numpy, text
from livebode_plant.fleet.alike_axes import Output, StackedRows
from livebode_plant.fleet.axis_stream import RESPONSE_BYTES, AxisStream
from livebode_plant.lake.wide_responses import wide_columns, wide_schema

_PLACE = (("axis", pa.string()), ("run", pa.int64()), ("number", pa.int64()))
_DIGEST_BYTES = 8
_BITS = (
    "first", "sample", "time_s", "schedule", "dof", "ready", "valid", "value", "weight", "sigma", "coherence",
    "input_coherence", "distortion", "variation",
)  # fmt: skip
_WIDE = pa.schema(
    [
        field.with_type(pa.list_(field.type.value_type)) if pa.types.is_fixed_size_list(field.type) else field
        for field in wide_schema(1)
    ]
)
ROWS = pa.schema([*_PLACE, ("digest", pa.int64()), *_WIDE])
"""A row for each response: key of the axis; number in the log of the first message of its run; number of the response
within that run; digest of all its bits in full precision; and the columns of `wide_schema`, as lists of any length,
since the axes of a partition have different lines. `from_wide` reads those of one axis."""
PARAMETERS = pa.schema([*_PLACE, *pa.schema(PARAMETER_SCHEMA)])
"""A row for each parameter, derived quantity and margin of a fitted response, which has this number; the other columns
are those of parameters.parquet."""


class AxisRows(NamedTuple):
    """Responses of one axis or of several: key, run and number of each row."""

    axes: Sequence[str]
    runs: Sequence[int]
    numbers: Sequence[int]
    responses: Responses

    @classmethod
    def of(cls, axis: str, run: int, number: int, responses: Responses) -> AxisRows:
        """Consecutive responses of a run of an axis, from this number on."""
        count = len(responses)
        return cls([axis] * count, [run] * count, range(number, number + count), responses)


class AxisFits(NamedTuple):
    """Parameters of the responses with these numbers, (rows,), of a run of an axis."""

    axis: str
    run: int
    numbers: NDArray[np.int64]
    parameters: Parameters


def response_table(parts: Sequence[AxisRows]) -> pa.Table:
    """Rows of `ROWS`, part by part."""
    if not parts:
        return ROWS.empty_table()
    every = [part.responses for part in parts]
    own = [
        text([axis for part in parts for axis in part.axes]),
        from_numpy(np.array([run for part in parts for run in part.runs], dtype=np.int64)),
        from_numpy(np.array([number for part in parts for number in part.numbers], dtype=np.int64)),
        from_numpy(np.concatenate([digests(batch) for batch in every])),
    ]
    return pa.Table.from_arrays([*own, *wide_columns(every, _WIDE)], schema=ROWS)


def parameter_table(parts: Sequence[AxisFits]) -> pa.Table:
    """Rows of `PARAMETERS`; axes with the same model are converted at once."""
    alike: dict[object, list[AxisFits]] = {}
    for part in parts:
        if len(part.parameters):
            fits = part.parameters
            alike.setdefault((fits.model, fits.names, fits.units), []).append(part)
    batches = []
    for members in alike.values():
        every = Parameters.join([part.parameters for part in members])
        width = len(every.names)
        counts = [width * len(part.numbers) for part in members]
        place = [
            text([part.axis for part in members], np.repeat(np.arange(len(members)), counts)),
            from_numpy(np.repeat([part.run for part in members], counts)),
            from_numpy(np.repeat(np.concatenate([part.numbers for part in members]), width)),
        ]
        batches.append(pa.Table.from_arrays([*place, *pa.table(parameter_rows(every)).columns], schema=PARAMETERS))
    return pa.concat_tables([PARAMETERS.empty_table(), *batches]).combine_chunks()


def digests(responses: Responses) -> NDArray[np.int64]:
    """A digest of all bits of each response, shape (rows,): stored rows are rounded, so it proves what was computed."""
    rows = len(responses)
    columns = [getattr(responses, name) for name in _BITS]
    table = np.hstack([np.ascontiguousarray(column).view(np.uint8).reshape(rows, -1) for column in columns])
    content = b"".join(blake2b(row, digest_size=_DIGEST_BYTES).digest() for row in table)
    return np.frombuffer(content, np.int64)


def grid_of(responses: Responses) -> Mapping[str, Any]:
    """What `from_wide` needs besides the rows: an entry ``found`` of run.json."""
    lines = responses.lines
    grid = {"bins": list(lines.bins), "quiet_bins": list(lines.quiet), "window": lines.window}
    return grid | {"rate_hz": lines.rate_hz, "quantity": responses.quantity, "unit": responses.unit}


_EVENT_BYTES = 500
"""Size of an event without its sentence."""
_PARAMETER_BYTES = 100
_HEAD = struct.Struct("<4sH")
_MAGIC, _VERSION = b"LBRM", 2
_LENGTH = struct.Struct("<I")


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
        Responses as in `ROWS`, one row for each (axis, run, number), rounded to float32, each with a digest
        of its exact bits. `from_wide(rows of one axis, grids[axis])` gives them as Responses.
    parameters
        As in `PARAMETERS`: one row for each parameter, derived quantity and margin of (axis, run, number).
    events
        With axis, run, kind, sample, time_s, message and details each; alarms of monitoring are among them.
    recipes
        Recipe of each axis in it.
    grids
        Lines, quantity and unit of each axis in `rows`, as an entry ``found`` of run.json.
    logged_s
        When the log received the newest samples of each axis that are in it, seconds since 1970.
    """

    through: int
    owner: str
    claim: bool = False
    rows: pa.Table = field(default_factory=ROWS.empty_table)
    parameters: pa.Table = field(default_factory=PARAMETERS.empty_table)
    events: Sequence[Mapping[str, Any]] = ()
    recipes: Mapping[str, str] = field(default_factory=dict)
    grids: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    logged_s: Mapping[str, float] = field(default_factory=dict)

    def to_bytes(self) -> bytes:
        """A head with the version, and compressed together JSON and both tables as Arrow streams.

        All in one is much smaller than each buffer of Arrow by itself: these have a few rows.
        """
        names = ("through", "owner", "claim", "events", "recipes", "grids", "logged_s")
        about = json.dumps({name: getattr(self, name) for name in names}).encode()
        sink = pa.BufferOutputStream()
        sink.write(_HEAD.pack(_MAGIC, _VERSION))
        with pa.CompressedOutputStream(sink, "zstd") as packed:
            packed.write(_LENGTH.pack(len(about)) + about)
            for table in (self.rows, self.parameters):
                with pa.ipc.new_stream(packed, table.schema) as writer:
                    writer.write_table(table)
        return bytes(sink.getvalue())

    @classmethod
    def from_bytes(cls, data: bytes) -> ResultMessage:
        """The message in these bytes.

        Raises
        ------
        FleetError
            If another version of livebode wrote it in another form.
        """
        version = _HEAD.unpack_from(data)[1] if data[: len(_MAGIC)] == _MAGIC and len(data) >= _HEAD.size else 1
        if version != _VERSION:
            raise FleetError(
                "results-of-other-version",
                f"the results in the log have version {version}, and this livebode reads version {_VERSION}",
                "continue with the livebode that wrote them, or start nats-server with an empty directory",
                found=version,
                readable=_VERSION,
            )
        with pa.CompressedInputStream(pa.BufferReader(data[_HEAD.size :]), "zstd") as packed:
            about = json.loads(packed.read(_LENGTH.unpack(packed.read(_LENGTH.size))[0]))
            rows, parameters = (pa.ipc.open_stream(packed).read_all() for _ in range(2))
        return cls(rows=rows, parameters=parameters, **about)


class PendingResults:
    """Outputs that are not stored yet."""

    def __init__(self) -> None:
        self._responses: list[AxisRows] = []
        self._parameters: list[AxisFits] = []
        self._events: list[dict[str, Any]] = []
        self._recipes: dict[str, str] = {}
        self._logged_s: dict[str, float] = {}
        self.nbytes = 0

    def __bool__(self) -> bool:
        return bool(self._responses or self._events)

    def add(self, key: str, stream: AxisStream, output: Output) -> None:
        """Append the output of a message of this axis."""
        self._events += [{"axis": key, "run": stream.run, **asdict(event)} for event in output.events]
        # The details repeat the message as its template and its facts.
        self.nbytes += sum(_EVENT_BYTES + 3 * len(event.message) for event in output.events)
        if output.responses is not None:
            self._responses.append(AxisRows.of(key, stream.run, output.number, output.responses))
            self.nbytes += output.responses.value.size * RESPONSE_BYTES
        for parameters in output.parameters:
            self._parameters.append(AxisFits(key, stream.run, output.fitted, parameters))
            self.nbytes += parameters.value.size * _PARAMETER_BYTES
        if output.responses is not None or output.events:
            self._recipes[key], self._logged_s[key] = stream.recipe, stream.log_s

    def add_rows(self, keys: Sequence[str], streams: Sequence[AxisStream], stack: StackedRows) -> None:
        """Append the responses of several axes."""
        runs = [stream.run for stream in streams]
        self._responses.append(AxisRows(keys, runs, stack.numbers, stack.responses))
        self.nbytes += stack.responses.value.size * RESPONSE_BYTES
        for key, stream in zip(keys, streams):
            self._recipes[key], self._logged_s[key] = stream.recipe, stream.log_s

    def add_event(self, key: str, event: Mapping[str, Any]) -> None:
        """Append an event that no message of the log causes."""
        self._events.append({"axis": key, **event})

    def message(self, through: int, owner: str) -> ResultMessage:
        """One message of all outputs."""
        return ResultMessage(
            through,
            owner,
            rows=response_table(self._responses),
            parameters=parameter_table(self._parameters),
            events=self._events,
            recipes=self._recipes,
            grids=self._grids(),
            logged_s=self._logged_s,
        )

    def _grids(self) -> dict[str, Mapping[str, Any]]:
        grids: dict[str, Mapping[str, Any]] = {}
        for part in self._responses:
            grids |= dict.fromkeys(part.axes, grid_of(part.responses))
        return grids
