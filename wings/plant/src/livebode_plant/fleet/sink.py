"""Sink: the results of the log into a lake, each of them once."""

from __future__ import annotations

import asyncio
import json
from hashlib import sha256

from livebode_plant.fleet.alarm_samples import AlarmSamples
from livebode_plant.fleet.fleet_settings import SinkSection
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.reader import Reader
from livebode_plant.fleet.sink_tables import SinkTables, SinkTotals
from livebode_plant.fleet.subjects import RESULT_STREAM, RESULTS, SINK, STATUS

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
