"""`livebode fleet run`: the coordinator and the workers of a fleet on this computer."""

from __future__ import annotations

import threading

from livebode.cli.fleet.options import Fleet
from livebode.cli.options import Json
from livebode.core.ending import calls_at_end

_STEP_S = 0.25


def run_command(fleet: Fleet, as_json: Json = False) -> None:
    """Start the workers of a fleet on this computer, and replace those that die, until Ctrl-C or SIGTERM.

    Nothing has to be ended in order: what is not stored yet is computed again from the log at the next start.
    """
    import asyncio

    from livebode.fleet.coordinator import FleetCoordinator
    from livebode.fleet.log import FleetLog
    from livebode.fleet.settings import FleetSettings

    settings = FleetSettings.read(fleet)
    axes = settings.read_axes()

    async def prepare() -> None:
        async with FleetLog(settings.log, "livebode run") as log:
            await log.create_streams(update=True)
            await log.use_partitions(settings.partitions)

    asyncio.run(prepare())
    stop = threading.Event()
    with calls_at_end(stop.set), FleetCoordinator(settings, axes) as coordinator:
        if not as_json:
            about = f"{settings.workers} workers share {settings.partitions} partitions of {len(axes)} axes"
            print(f"{about}; Ctrl-C ends", flush=True)
        while not stop.wait(_STEP_S):
            coordinator.step()
    if not as_json:
        print("stopped; the log has everything that is not processed yet")
