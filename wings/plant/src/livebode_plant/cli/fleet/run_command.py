"""`livebode fleet run`: the coordinator and the workers of a fleet on this computer."""

from __future__ import annotations

import threading

from livebode.cli import Json
from livebode.core import calls_at_end
from livebode_plant.cli.fleet.options import Fleet

_STEP_S = 0.25


def run_command(fleet: Fleet, as_json: Json = False) -> None:
    """Start the workers of a fleet on this computer, and replace those that end or freeze, until Ctrl-C or SIGTERM.

    Nothing has to be ended in order: what is not stored yet is computed again from the log at the next start.
    """
    from livebode_plant.fleet.worker_process import import_early

    import_early()  # beside the imports of this process
    import asyncio

    from livebode.cli import warnings_shown
    from livebode_plant.fleet.coordinator import FleetCoordinator
    from livebode_plant.fleet.fleet_settings import FleetSettings
    from livebode_plant.fleet.log import FleetLog

    settings = FleetSettings.read(fleet)
    axes = settings.read_axes()

    async def prepare() -> None:
        async with FleetLog(settings.log, "livebode run") as log:
            await log.create_streams(update=True)
            await log.use_partitions(settings.partitions)

    asyncio.run(prepare())
    stop = threading.Event()
    with warnings_shown(), calls_at_end(stop.set), FleetCoordinator(settings, axes) as coordinator:
        if not as_json:
            about = f"{settings.workers} workers share {settings.partitions} partitions of {len(axes)} axes"
            print(f"{about}; Ctrl-C ends", flush=True)
        while not stop.wait(_STEP_S):
            coordinator.step()
    if not as_json:
        print("stopped; the log has everything that is not processed yet")
