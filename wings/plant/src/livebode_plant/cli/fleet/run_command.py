"""`livebode fleet run`: the coordinator and the workers of a fleet on this computer."""

from __future__ import annotations

import threading
import time
from pathlib import Path
from typing import Annotated

import typer

from livebode.cli import Json, NextCommand
from livebode.core import UsageError, calls_at_end

_STEP_S = 0.25
_DEMO_AXES, _DEMO_WORKERS, _DEMO_S = 20, 3, 20.0


def run_command(
    fleet: Annotated[
        Path | None, typer.Argument(metavar="FLEET.TOML", help="Configuration of the fleet; not for --demo.")
    ] = None,
    demo: Annotated[
        bool,
        typer.Option(
            "--demo",
            help="Start a log, three workers and 20 simulated axes for 20 s instead, kill a worker, and check that "
            "nothing is lost.",
        ),
    ] = False,
    as_json: Json = False,
) -> NextCommand:
    """Start the workers of a fleet on this computer, and replace those that end or freeze, until Ctrl-C or SIGTERM.

    Nothing has to be ended in order: what is not stored yet is computed again from the log at the next start.
    """
    if (fleet is None) != demo:
        raise UsageError(
            "options",
            "give either FLEET.toml or --demo",
            "`livebode fleet run --demo` needs no fleet",
            options=["--demo"],
        )
    if fleet is None:
        _run_demo(as_json=as_json)
        return NextCommand("fleet", "status", demo=_DEMO_AXES)
    _run(fleet, as_json=as_json)
    return NextCommand("fleet", "status", fleet)


def _run(fleet: Path, *, as_json: bool) -> None:
    from livebode_plant.fleet.coordinator import import_early

    import_early()  # beside the imports of this process
    from livebode.cli import warnings_shown
    from livebode_plant.fleet.coordinator import FleetCoordinator
    from livebode_plant.fleet.fleet_settings import FleetSettings
    from livebode_plant.fleet.log import FleetLog, with_log

    settings = FleetSettings.read(fleet)
    axes = settings.read_axes()

    async def prepare(log: FleetLog) -> None:
        await log.create_streams(update=True)
        await log.use_partitions(settings.partitions)

    with_log(settings.log, "livebode run", prepare)
    stop = threading.Event()
    with warnings_shown(), calls_at_end(stop.set), FleetCoordinator(settings, axes) as coordinator:
        if not as_json:
            about = f"{settings.workers} workers share {settings.partitions} partitions of {len(axes)} axes"
            print(f"{about}; Ctrl-C ends", flush=True)
        while not stop.wait(_STEP_S):
            coordinator.step()
    if not as_json:
        print("stopped; the log has everything that is not processed yet")


def _run_demo(*, as_json: bool) -> None:
    import tempfile

    from livebode.records import to_json
    from livebode_plant.fleet.demo import demo
    from livebode_plant.fleet.replay import require_exact, verdict

    began = time.monotonic()

    def say(sentence: str) -> None:
        if not as_json:
            print(f"{time.monotonic() - began:5.1f} s  {sentence}", flush=True)

    with tempfile.TemporaryDirectory(prefix="livebode-fleet-") as folder:
        result = demo(Path(folder), axes=_DEMO_AXES, workers=_DEMO_WORKERS, seconds=_DEMO_S, say=say)
    if as_json:
        print(to_json(result.check.as_dict() | {"silence_s": result.silence_s}))
    require_exact(result.check)
    say(verdict(result.check))
