"""`livebode fleet replay`: results computed again from the log, to compare the stored ones or as tables of one axis."""

from __future__ import annotations

import json
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict
from hashlib import blake2b
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from livebode.configuration import Axis
from livebode.core import FleetError, Responses, whole_file, writing
from livebode.dataclass import dataclass
from livebode.records import RESPONSE_SCHEMA, as_batch
from livebode.tables import from_numpy, text, to_numpy
from livebode_plant.fleet.axis_stream import AxisStream
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.reader import stored_messages
from livebode_plant.fleet.result_message import (
    PARAMETERS,
    ROWS,
    AxisFits,
    PendingResults,
    ResultMessage,
    parameter_table,
)
from livebode_plant.fleet.subjects import LOG, LOG_STREAM, RESULT_STREAM, RESULTS, axis_path, key_of

_DIGEST_BYTES = 16
_NAMES = ROWS.names[3:]
Run = tuple[str, int]
"""Key of an axis, and number of the first message of the run."""
_FITTED = PARAMETERS.names[2:]
_OUTSIDE = "state-rejected"
"""Kind of event that reports a takeover, not the data: one computation without interruption has none."""


@dataclass
class AxisCheck:
    """Results of an axis: expected ones, and stored ones that differ from them.

    Attributes
    ----------
    responses, parameters, events
        Computed again, from the messages whose results must be stored. Of parameters, a row is one quantity of a fit.
    missing, doubled, different
        Responses of these that are not stored, stored more than once, stored with other bits.
    unexpected
        Responses that are stored, but not computed again.
    parameters_missing, parameters_unexpected, events_missing, events_unexpected
        Rows and events that are not stored, or stored more often than computed; one with other bits counts as both.
    other_recipe
        Responses stored with another configuration than today's, so not compared.
    """

    responses: int = 0
    missing: int = 0
    doubled: int = 0
    different: int = 0
    unexpected: int = 0
    parameters: int = 0
    parameters_missing: int = 0
    parameters_unexpected: int = 0
    events: int = 0
    events_missing: int = 0
    events_unexpected: int = 0
    other_recipe: int = 0

    @property
    def exact(self) -> bool:
        responses = self.missing or self.doubled or self.different or self.unexpected
        parameters = self.parameters_missing or self.parameters_unexpected
        return not (responses or parameters or self.events_missing or self.events_unexpected)


@dataclass(frozen=True)
class CheckResult:
    """Verdicts by the path of the axis, and the claims of partitions: one at the start, one for each takeover."""

    axes: Mapping[str, AxisCheck]
    claims: int
    messages: int

    @property
    def exact(self) -> bool:
        return all(axis.exact for axis in self.axes.values())

    @property
    def total(self) -> AxisCheck:
        """The sum over all axes."""
        sums: Counter[str] = Counter()
        for axis in self.axes.values():
            sums.update(asdict(axis))
        return AxisCheck(**sums)

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        axes = {path: asdict(axis) for path, axis in self.axes.items()}
        return {"exact": self.exact, "claims": self.claims, "messages": self.messages, "axes": axes}


class _ResultDigests:
    """Digests of results by run, and for each partition the message up to which they are complete."""

    def __init__(self) -> None:
        self.responses: dict[Run, list[tuple[int, bytes]]] = {}
        self.parameters: dict[Run, Counter[bytes]] = defaultdict(Counter)
        self.events: dict[Run, Counter[bytes]] = defaultdict(Counter)
        self.recipes: dict[Run, str] = {}
        self.through: dict[str, int] = {}
        self.claims = 0

    def add(self, partition: str, message: ResultMessage) -> None:
        self.through[partition] = message.through
        self.claims += message.claim
        for key, run, number, digest in _digests(message.rows):
            self.responses.setdefault((key, run), []).append((number, digest))
            self.recipes[key, run] = message.recipes[key]
        _count(self.parameters, _fitted_digests(message.parameters))
        for event in message.events:
            if event["kind"] != _OUTSIDE:
                _count(self.events, [(event["axis"], event["run"], _event_digest(event))])
                self.recipes[event["axis"], event["run"]] = message.recipes[event["axis"]]


async def check_results(log: FleetLog, axes: Mapping[str, Axis]) -> CheckResult:
    """Compute all results again from the log, in one process and without interruption, and compare the stored ones.

    A fleet may run meanwhile: what is not stored yet is not expected.

    Raises
    ------
    FleetError
        If the log no longer has its beginning.
    """
    stored = _ResultDigests()
    extent = await log.extent(RESULT_STREAM)
    async for message in stored_messages(log, RESULT_STREAM, f"{RESULTS}.*", extent.last, extent.first):
        stored.add(message.subject.split(".")[1], ResultMessage.from_bytes(message.data))
    extent = await log.extent(LOG_STREAM)
    if extent.first > 1:
        raise FleetError(
            "log-incomplete",
            f"the log begins at message {extent.first}: older ones are deleted",
            "check a fleet whose log still has its beginning; see size_gb and age_days in [log]",
            first=extent.first,
        )
    again = _Again(axes, stored)
    async for message in stored_messages(log, LOG_STREAM, f"{LOG}.>", extent.last):
        again.process(message.subject, message.data, message.number, message.stored_s)
    return CheckResult(again.verdicts(), stored.claims, extent.last)


class _Again:
    """The uninterrupted computation: a stream for each run of each axis, whose outputs become messages of results."""

    def __init__(self, axes: Mapping[str, Axis], stored: _ResultDigests) -> None:
        self._axes, self._stored, self._expected = axes, stored, _ResultDigests()
        self._runs: dict[str, list[int]] = {}
        for key, run in stored.recipes:
            self._runs.setdefault(key, []).append(run)
        self._streams: dict[str, AxisStream] = {}

    def process(self, subject: str, data: bytes, number: int, stored_s: float) -> None:
        key, partition = key_of(subject), subject.split(".")[1]
        if key not in self._axes or number > self._stored.through.get(partition, 0):
            return
        if key not in self._streams or number in self._runs.get(key, ()):
            self._streams[key] = AxisStream(self._axes[key], number)
        stream, pending = self._streams[key], PendingResults()
        pending.add(key, stream, stream.process(data, number, stored_s))
        self._expected.add(partition, pending.message(number, ""))

    def verdicts(self) -> dict[str, AxisCheck]:
        verdicts: dict[str, AxisCheck] = {axis_path(key): AxisCheck() for key in sorted(self._axes)}
        stored, expected = self._stored, self._expected
        for run in sorted(expected.recipes.keys() | stored.recipes.keys()):
            verdict = verdicts.setdefault(axis_path(run[0]), AxisCheck())
            responses = stored.responses.get(run, [])
            stream = self._streams.get(run[0])
            if run in stored.recipes and (stream is None or stored.recipes[run] != stream.recipe):
                verdict.other_recipe += len(responses)
                continue
            _compare(verdict, dict(expected.responses.get(run, ())), responses)
            _compare_rows(verdict, "parameters", expected.parameters[run], stored.parameters[run])
            _compare_rows(verdict, "events", expected.events[run], stored.events[run])
        return verdicts


def _compare(verdict: AxisCheck, expected: Mapping[int, bytes], stored: list[tuple[int, bytes]]) -> None:
    times = Counter(number for number, _ in stored)
    verdict.responses += len(expected)
    verdict.missing += len(expected.keys() - times.keys())
    verdict.doubled += sum(times.values()) - len(times)
    verdict.unexpected += len(times.keys() - expected.keys())
    verdict.different += sum(number in expected and expected[number] != digest for number, digest in stored)


def _compare_rows(verdict: AxisCheck, name: str, expected: Counter[bytes], stored: Counter[bytes]) -> None:
    counts = {name: expected, f"{name}_missing": expected - stored, f"{name}_unexpected": stored - expected}
    for count, rows in counts.items():
        setattr(verdict, count, getattr(verdict, count) + rows.total())


def _digests(rows: pa.Table) -> Iterator[tuple[str, int, int, bytes]]:
    """Axis, run, number and digest of each response in a table, from all bits of its row."""
    rows = rows.combine_chunks()
    cells = [_cells(rows[name]) for name in _NAMES]
    place = (rows[name].to_pylist() for name in ("axis", "run", "number"))
    for index, (key, run, number) in enumerate(zip(*place)):
        content = b"".join(cell(index) for cell in cells)
        yield key, run, number, _digest(content)


def _count(counts: dict[Run, Counter[bytes]], found: Iterable[tuple[str, int, bytes]]) -> None:
    for key, run, digest in found:
        counts[key, run][digest] += 1


def _fitted_digests(rows: pa.Table) -> Iterator[tuple[str, int, bytes]]:
    """Axis, run and digest of each row of parameters."""
    columns = [rows[name].to_pylist() for name in _FITTED]
    for key, run, *content in zip(rows["axis"].to_pylist(), rows["run"].to_pylist(), *columns):
        yield key, run, _digest(repr(content).encode())  # the shortest text of a float is exact


def _event_digest(event: Mapping[str, Any]) -> bytes:
    content = {name: event[name] for name in ("kind", "sample", "time_s", "message", "details")}
    return _digest(json.dumps(content, sort_keys=True).encode())


def _digest(content: bytes) -> bytes:
    return blake2b(content, digest_size=_DIGEST_BYTES).digest()


def _cells(column: pa.ChunkedArray[Any]) -> Callable[[int], bytes]:
    """The bytes of a row of a column of numbers, or of lists of them."""
    whole = pa.concat_arrays(column.chunks) if column.num_chunks else pa.array([], column.type)
    if not pa.types.is_list(column.type):
        numbers = to_numpy(whole)
        return lambda index: numbers[index].tobytes()
    values, ends = to_numpy(whole.values), to_numpy(whole.offsets)
    return lambda index: values[ends[index] : ends[index + 1]].tobytes()


def verdict(result: CheckResult) -> str:
    """One sentence with all figures."""
    total = result.total
    other = f", {total.other_recipe} with another configuration were not compared" if total.other_recipe else ""
    return (
        f"{total.responses:,} responses (axes: {len(result.axes)}): {total.missing} missing, {total.doubled} doubled, "
        f"{total.different + total.unexpected} different from one uninterrupted computation{other}"
        + _others(total.parameters, "parameters", total.parameters_missing, total.parameters_unexpected)
        + _others(total.events, "events", total.events_missing, total.events_unexpected)
    )


def _others(count: int, what: str, missing: int, unexpected: int) -> str:
    """Words about what many fleets have none of."""
    if not (count or unexpected):
        return ""
    return f"; {count:,} {what}: {missing} missing, {unexpected} doubled or different"


def require_exact(result: CheckResult) -> None:
    """FleetError with the figures if a response is missing, doubled or different."""
    if not result.exact:
        wrong = [path for path, axis in result.axes.items() if not axis.exact]
        raise FleetError(
            "not-exactly-once",
            f"{verdict(result)}; the axes are {', '.join(wrong[:5])}",
            "keep the log, and report this with `livebode doctor --bundle`",
            axes=wrong,
        )


SCHEMA = pa.schema([("axis", pa.string()), ("run", pa.int64()), ("number", pa.int64()), *pa.schema(RESPONSE_SCHEMA)])
"""Columns: key of the axis, number in the log of the first message of its run, number of the response within that run,
and those of responses.parquet, in full precision."""


class ReplayedAxis(NamedTuple):
    """Responses with the columns of `SCHEMA`; fits, derived quantities and margins with those of
    `result_message.PARAMETERS`, None without [fit]."""

    responses: pa.Table
    parameters: pa.Table | None


async def replayed(log: FleetLog, key: str, axis: Axis, from_s: float) -> ReplayedAxis:
    """What the messages of an axis give that the log has stored since `from_s` (seconds since 1970).

    The tracker begins at the first of them.

    Raises
    ------
    FleetError
        If the log has no such message, or the axis cannot be tracked from the first one on.
    """
    subject = f"{LOG}.*.{key}"
    through = (await log.extent(LOG_STREAM)).last
    stream: AxisStream | None = None
    batches, fits = [], []
    async for message in stored_messages(log, LOG_STREAM, subject, through):
        if message.stored_s < from_s:
            continue
        stream = stream or AxisStream(axis, message.number)
        output = stream.process(message.data, message.number, message.stored_s)
        if output.responses is not None:
            batches.append(_response_rows(key, stream.run, output.number, output.responses))
        fits += [AxisFits(key, stream.run, output.fitted, parameters) for parameters in output.parameters]
    if stream is None:
        raise FleetError(
            "no-data",
            f"the log has no data of {axis_path(key)} in this time",
            "choose an earlier beginning; see age_days and size_gb in [log]",
            axis=axis_path(key),
        )
    if stream.failure and not batches:
        raise FleetError(
            "axis-failed",
            f"{axis_path(key)} cannot be tracked: {stream.failure}",
            "repair its configuration or its sender, and choose a beginning after that",
            axis=axis_path(key),
        )
    parameters = None if axis.fit is None else parameter_table(fits)
    return ReplayedAxis(pa.concat_tables([SCHEMA.empty_table(), *batches]), parameters)


def _response_rows(key: str, run: int, number: int, responses: Responses) -> pa.Table:
    """The responses of an axis's run that begin with this number."""
    numbers = np.repeat(np.arange(number, number + len(responses)), len(responses.lines))
    place = [text([key], np.zeros_like(numbers)), from_numpy(np.full_like(numbers, run)), from_numpy(numbers)]
    return pa.Table.from_arrays([*place, *pa.table(as_batch(responses)).columns], schema=SCHEMA)


def write_replayed(found: ReplayedAxis, path: Path) -> dict[Path, int]:
    """Write the responses as a Parquet file, and beside it the parameters; OutputError if that is not possible.

    Returns the rows of each file, NAME.parquet and NAME-parameters.parquet.
    """
    tables = {path: found.responses}
    if found.parameters is not None:
        tables[path.with_stem(f"{path.stem}-parameters")] = found.parameters
    for place, table in tables.items():
        with writing(place), whole_file(place) as partial:
            pq.write_table(table, partial)
    return {place: table.num_rows for place, table in tables.items()}
