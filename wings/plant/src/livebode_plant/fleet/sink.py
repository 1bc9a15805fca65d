"""Sink: the results of the log into a lake, each of them once, and the raw samples around alarms."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Iterable, Iterator, Sequence
from datetime import UTC, datetime, timedelta
from hashlib import sha256
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from livebode.analysis import ALARMS
from livebode.core import LEVELS, SourceError
from livebode.locations import location, write_whole
from livebode.records import samples_of
from livebode.sources.live import Batch
from livebode.tables import from_numpy
from livebode_plant.fleet.fleet_settings import SinkSection
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.message import read_message
from livebode_plant.fleet.reader import Reader, StoredMessage, stored_messages
from livebode_plant.fleet.sink_tables import SinkTables, SinkTotals
from livebode_plant.fleet.subjects import (
    LOG,
    LOG_STREAM,
    RESULT_STREAM,
    RESULTS,
    SINK,
    STATUS,
    axis_names,
    axis_path,
    axis_token,
)
from livebode_plant.lake import TABLES, Lake, StreamTable
from livebode_plant.lake.wide_responses import wide_options

KINDS = (*ALARMS, "axis-failed")
"""Kinds of the events around which samples are saved."""
AROUND_S = 60.0
_LATE_S = 5.0
_FOLDER = "fleet_alarm_samples"
_SCHEMA = TABLES["fleet_samples"].schema


class RaisedAlarm(NamedTuple):
    """An alarm of an axis by its key; when the log received the samples that raised it, seconds since 1970."""

    axis: str
    kind: str
    logged_s: float


class AlarmSamples:
    """Saves the samples of a minute before and after each alarm as files that `livebode run` reads.

    An alarm within a minute of an earlier one of its axis, whose file has its samples, gets no file of its own. File
    and row depend on the log alone: after a kill the same are written again.

    Parameters
    ----------
    log
        A connection.
    lake
        Where the files and their table are.
    name
        Of the log in the tables.
    """

    def __init__(self, log: FleetLog, lake: Lake, name: str) -> None:
        self._log, self._lake, self._name = log, lake, name
        self._waiting: set[RaisedAlarm] = set()
        self._until_s: dict[str, float] = {}

    def resume(self, days: float) -> None:
        """Find the alarms of the last days whose samples are not saved."""
        since = datetime.now(UTC) - timedelta(days=days)
        where = pc.is_in(pc.field("kind"), value_set=pa.array(KINDS)) & (pc.field("log") == self._name)
        events = StreamTable(self._lake, "fleet_events").read(list(TABLES["fleet_samples"].key), where, since.date())
        saved = self._lake.keys("fleet_samples")
        for *levels, logged, file in _tuples(self._lake.read("fleet_samples", [*LEVELS, "logged", "file"])):
            if file is not None:
                key = ".".join(map(axis_token, levels))
                self._until_s[key] = max(self._until_s.get(key, 0.0), logged.timestamp() + AROUND_S)
        new = events.filter(pa.array([row not in saved for row in _tuples(events)], pa.bool_()))
        self.add(new)

    def add(self, events: pa.Table) -> None:
        """Take rows of events; those that are not alarms of an axis are ignored."""
        for *levels, kind, logged in _tuples(events.select([*LEVELS, "kind", "logged"])):
            if kind in KINDS and any(levels):
                self._waiting.add(RaisedAlarm(".".join(map(axis_token, levels)), kind, logged.timestamp()))

    async def save_due(self) -> None:
        """Save the samples of alarms that were raised more than a minute ago.

        Raises
        ------
        ArchiveError, LocationError, OutputError
            If the lake cannot be written.
        """
        for alarm in sorted(self._waiting, key=lambda one: one.logged_s):
            if alarm.logged_s + AROUND_S + _LATE_S < time.time():
                rows = []
                if alarm.logged_s > self._until_s.get(alarm.axis, 0.0):
                    rows = await asyncio.to_thread(self._saved, alarm, await self._messages(alarm))
                    self._until_s[alarm.axis] = alarm.logged_s + AROUND_S
                await asyncio.to_thread(self._note, alarm, rows)
                self._waiting.discard(alarm)

    async def _messages(self, alarm: RaisedAlarm) -> list[StoredMessage]:
        subject = f"{LOG}.*.{alarm.axis}"
        first = await self._log.first_since(LOG_STREAM, subject, alarm.logged_s - AROUND_S)
        stop = await self._log.first_since(LOG_STREAM, subject, alarm.logged_s + AROUND_S)
        return [message async for message in stored_messages(self._log, LOG_STREAM, subject, stop - 1, first)]

    def _saved(self, alarm: RaisedAlarm, messages: Sequence[StoredMessage]) -> list[dict[str, Any]]:
        """Write a file for each epoch of the sender, and return their rows."""
        rows = []
        for batches in _alike(_batches(messages)):
            table, about = _samples(batches)
            name = f"{_time(alarm.logged_s):%Y-%m-%dT%H%M%S.%f}Z-{about['epoch']}-{about['first_sample']}.parquet"
            folders = [axis_token(level).replace("%20", " ") for level in axis_path(alarm.axis).split("/")]
            file = "/".join([_FOLDER, *folders, name])
            facts = about | {"machine": axis_path(alarm.axis), "alarm": alarm.kind, "alarm_s": alarm.logged_s}
            table = table.replace_schema_metadata({"livebode": json.dumps(facts, sort_keys=True)})
            buffer = pa.BufferOutputStream()
            pq.write_table(table, buffer, **wide_options(table.schema))
            place = location(self._lake.url)
            target = place.joinpath(file) if isinstance(place, Path) else place / file
            write_whole(target, buffer.getvalue().to_pybytes())
            rows.append({name: about[name] for name in _SCHEMA.names if name in about} | {"file": file})
        return rows

    def _note(self, alarm: RaisedAlarm, rows: Sequence[dict[str, Any]]) -> None:
        own = {"log": self._name, "kind": alarm.kind, "logged": _time(alarm.logged_s)}
        own |= dict(zip(LEVELS, axis_names(alarm.axis)))
        noted = [own | row for row in rows or [{"samples": 0}]]
        self._lake.add_rows("fleet_samples", pa.Table.from_pylist(noted, _SCHEMA))


def _tuples(table: pa.Table) -> Iterator[tuple[Any, ...]]:
    return zip(*(column.to_pylist() for column in table.columns))


def _time(at_s: float) -> datetime:
    return datetime.fromtimestamp(at_s, UTC)


def _batches(messages: Iterable[StoredMessage]) -> Iterator[Batch]:
    """The samples of messages; damaged ones and spectra have none."""
    for message in messages:
        try:
            batch = read_message(message.data, message.stored_s)
        except SourceError:
            continue
        if isinstance(batch, Batch):
            yield batch


def _alike(batches: Iterable[Batch]) -> Iterator[list[Batch]]:
    """Batches of one epoch with the same channels, in the order of their samples."""

    def kind(batch: Batch) -> tuple[Any, ...]:
        return batch.epoch, batch.rate_hz, tuple((channel.name, channel.unit) for channel in batch.channels)

    for _, group in groupby(sorted(batches, key=lambda one: (kind(one), one.first_sample)), kind):
        yield list(group)


def _samples(batches: Sequence[Batch]) -> tuple[pa.Table, dict[str, Any]]:
    """The samples, each once, with the sender's numbers; their time is that of the log or of the sender's clock."""
    parts, numbers, stop = [], [], batches[0].first_sample
    for batch in batches:
        new = max(stop, batch.first_sample)
        if new < batch.stop:
            parts.append(batch.data[:, new - batch.first_sample :])
            numbers.append(np.arange(new, batch.stop, dtype=np.int64))
            stop = batch.stop
    first = batches[0]
    begin_s = first.arrived_s - first.samples / first.rate_hz if first.stamp_s is None else first.stamp_s
    number = np.concatenate(numbers)
    time_s = begin_s + (number - number[0]) / first.rate_hz
    columns = [from_numpy(column) for column in (number, time_s, *np.concatenate(parts, axis=1))]
    about = {"epoch": str(first.epoch), "first_sample": int(number[0]), "samples": len(number)}
    missing = int(number[-1] - number[0]) + 1 - len(number)
    return pa.table(columns, schema=pa.schema(samples_of(first.channels).schema)), about | {"missing": missing}


_READ_S = 0.2
_DIGITS = 16


class Sink:
    """Reads the results of a log, and commits them to a lake with the position up to which they were read.

    It may be killed at any moment, and there may be two: each result is in the lake once. What the log deletes before
    it was read is an event with its extent.

    Parameters
    ----------
    log
        A connection of its own.
    settings
        The lake, and how long what is retained there.
    """

    def __init__(self, log: FleetLog, settings: SinkSection) -> None:
        self._log, self._tables, self._lake = log, SinkTables(settings), settings.url
        self._reported = (-1, 0.0)

    @property
    def totals(self) -> SinkTotals:
        """What it has stored."""
        return self._tables.totals

    async def run(self, stop: asyncio.Event, *, once: bool = False) -> None:
        """Store results until `stop` is set; with `once` those that the log has now.

        Raises
        ------
        ArchiveError, LocationError, OutputError
            If the lake cannot be read or written.
        FleetError
            If the log has results of another version of livebode.
        """
        tables, extent = self._tables, await self._log.extent(RESULT_STREAM)
        first = await asyncio.to_thread(tables.resume, extent.created_s)
        alarms = AlarmSamples(self._log, tables.lake, tables.name)
        await asyncio.to_thread(alarms.resume, self._log.settings.age_days)
        reader = Reader(self._log, RESULT_STREAM, f"{RESULTS}.*", first)
        try:
            while not stop.is_set() and not (once and max(reader.next, extent.first) > extent.last):
                messages = await reader.read(_READ_S)
                for events in await asyncio.to_thread(tables.process, messages):
                    alarms.add(events)
                await alarms.save_due()
                await self._report()
        finally:
            await reader.close()
        await asyncio.to_thread(tables.commit)
        await alarms.save_due()
        await self._report()

    async def _report(self) -> None:
        """Store in the log how far the lake is, for `livebode fleet status`."""
        if (through := self._tables.through) != self._reported:
            self._reported = through
            about = {"lake": self._lake, "through": through[0], "stored_s": through[1]}
            name = f"{SINK}{sha256(self._lake.encode()).hexdigest()[:_DIGITS]}"
            await self._log.append(f"{STATUS}.{name}", json.dumps(about).encode())
