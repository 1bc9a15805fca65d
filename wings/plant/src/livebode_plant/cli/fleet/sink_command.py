"""`livebode fleet sink`: the results of a fleet into a lake."""

from __future__ import annotations

from typing import Annotated

import typer

from livebode.cli import Json, NextCommand
from livebode.core import calls_at_end
from livebode_plant.cli.fleet.options import Fleet


def sink_command(
    fleet: Fleet,
    once: Annotated[bool, typer.Option("--once", help="Store what the log has now, and end.")] = False,
    as_json: Json = False,
) -> NextCommand | None:
    """Store the results of a fleet in a lake, each once: all of them, their means over minutes and hours, and events.

    The log has them for a limited time, the lake as long as [sink] says. It ends at Ctrl-C or SIGTERM, and may be
    killed: the lake contains the position up to which the log was read.
    """
    import asyncio

    from livebode.records import to_json
    from livebode_plant.fleet.fleet_settings import FleetSettings
    from livebode_plant.fleet.log import FleetLog, with_log
    from livebode_plant.fleet.sink import Sink
    from livebode_plant.fleet.sink_tables import SinkTotals

    settings = FleetSettings.read(fleet)
    url = settings.sink.url

    async def store(log: FleetLog) -> SinkTotals:
        await log.create_streams()
        sink, stop = Sink(log, settings.sink), asyncio.Event()
        loop = asyncio.get_running_loop()
        with calls_at_end(lambda: loop.call_soon_threadsafe(stop.set)):
            if not (as_json or once):
                print(f"results of {settings.log.url} are stored in {url}; Ctrl-C ends", flush=True)
            await sink.run(stop, once=once)
        return sink.totals

    totals = with_log(settings.log, "livebode sink", store)
    if as_json:
        print(to_json(totals.as_dict() | {"lake": url}))
        return None
    print(f"{url}: {totals.responses:,} responses, {totals.parameters:,} parameters, {totals.events:,} events stored")
    if totals.deleted:
        print(f"{totals.deleted:,} messages of results were deleted from the log before they were read")
    return NextCommand("archive", "list", url)
