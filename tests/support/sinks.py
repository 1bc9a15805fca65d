"""The results of a log into a lake, in this process."""

from __future__ import annotations

import asyncio
from pathlib import Path

from livebode_plant.fleet.fleet_settings import LogSection, SinkSection
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.sink import Sink
from livebode_plant.fleet.sink_tables import SinkTotals


def sink_once(log: LogSection, lake: Path, commit_s: float = 60.0) -> SinkTotals:
    async def store() -> SinkTotals:
        async with FleetLog(log, "sink") as connection:
            sink = Sink(connection, SinkSection(lake=str(lake), commit_s=commit_s))
            await sink.run(asyncio.Event(), once=True)
            return sink.totals

    return asyncio.run(store())
