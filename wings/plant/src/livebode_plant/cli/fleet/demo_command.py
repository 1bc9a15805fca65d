"""`livebode fleet demo`: a fleet on this computer, one of whose workers is killed."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from livebode.cli import Json


def demo_command(
    seconds: Annotated[float, typer.Option(min=4, help="Duration of the simulation.")] = 20.0,
    axes: Annotated[int, typer.Option(min=1, max=200, help="Number of simulated axes.")] = 20,
    workers: Annotated[int, typer.Option(min=2, max=16, help="Number of worker processes.")] = 3,
    as_json: Json = False,
) -> None:
    """Start a log, three workers and 20 simulated axes, kill a worker, and check that nothing is lost."""
    import tempfile

    from livebode.records import to_json
    from livebode_plant.cli.fleet.verdict import require_exact, verdict
    from livebode_plant.fleet.demo import demo

    began = time.monotonic()

    def say(sentence: str) -> None:
        if not as_json:
            print(f"{time.monotonic() - began:5.1f} s  {sentence}", flush=True)

    with tempfile.TemporaryDirectory(prefix="livebode-fleet-") as folder:
        result = demo(Path(folder), axes=axes, workers=workers, seconds=seconds, say=say)
    if as_json:
        print(to_json(result.check.as_dict() | {"silence_s": result.silence_s}))
    require_exact(result.check)
    say(verdict(result.check))
