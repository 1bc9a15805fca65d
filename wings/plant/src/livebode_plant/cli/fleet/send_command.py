"""`livebode fleet send`: live sources into the log."""

from __future__ import annotations

import contextlib
import threading
from pathlib import Path
from typing import Annotated

import typer

from livebode.cli import Json, NextCommand
from livebode.core import calls_at_end
from livebode_plant.cli.fleet.options import Fleet


def send_command(
    axis: Annotated[Path, typer.Argument(metavar="AXIS.TOML", help="Axes with a live source and a [machine] section.")],
    fleet: Fleet,
    as_json: Json = False,
) -> NextCommand:
    """Send the samples of live sources to the log, through a buffer on disk, until they end, Ctrl-C or SIGTERM.

    While the log cannot be reached, also at the start, the buffer grows up to its limit; then its oldest messages are
    deleted and counted.
    """
    from livebode.cli import warnings_shown
    from livebode.configuration import ConfigurationFile
    from livebode.records import to_json
    from livebode.sources.live import make_source
    from livebode_plant.fleet.edge import edge_buffers, send_sources
    from livebode_plant.fleet.fleet_settings import FleetSettings, machine_key

    settings = FleetSettings.read(fleet)
    axes = ConfigurationFile(axis, {}).read()
    keys = {machine_key(own, f"{axis}, axis {name}" if name else str(axis)): own for name, own in axes.items()}
    stop = threading.Event()
    with contextlib.ExitStack() as opened:
        opened.enter_context(warnings_shown())
        buffers = opened.enter_context(edge_buffers(settings.edge, keys))
        sources = {key: opened.enter_context(make_source(own.source).open()) for key, own in keys.items()}
        with calls_at_end(stop.set):  # not before: a source opens with the first data of its sender
            if not as_json:
                print(f"{len(sources)} axes send to {settings.log.url}; Ctrl-C ends", flush=True)
            sent = send_sources(settings.log, sources, buffers, stop)
    print(to_json({"messages": sent}) if as_json else f"the log has stored {sent} messages")
    return NextCommand("fleet", "status", fleet)
