"""`livebode measure`: design, play, record and track in one command."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from livebode.cli import Json, NextCommand, console

if TYPE_CHECKING:
    from livebode_design.experiment import Experiment
    from livebode_design.measurement import ReadyMeasurement
    from livebode_design.playback import StopRequest


def measure_command(
    experiment: Annotated[
        Path, typer.Argument(metavar="EXPERIMENT.toml", help="Machine, limits, required accuracy, and [source].")
    ],
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="New directory for the design, the recording and the run.")
    ] = Path("measurement"),
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Print what would be played and check the controller; play nothing.")
    ] = False,
    simulated: Annotated[
        bool, typer.Option("--simulated", help="Play on a simulation of the \\[belt] axis in place of \\[source].")
    ] = False,
    as_json: Json = False,
) -> NextCommand | None:
    """Design an excitation, play it on the controller, record, and track the response; Ctrl-C ramps it down.

    A limit, a second without samples, SIGTERM and a closed terminal ramp it down, too. What was recorded remains.
    """
    from livebode.records import to_json
    from livebode_design.design_command import working
    from livebode_design.design_terminal import show_design
    from livebode_design.experiment import Experiment
    from livebode_design.measurement import prepare

    asked = Experiment.read(experiment)
    with working():
        prepared = prepare(asked, simulated=simulated)
    if not as_json:
        show_design(prepared.design)
        print()
        _show_playing(prepared)
    if dry_run:
        if as_json:
            print(to_json({"playing": prepared.plain()} | prepared.design.plain()))
        return NextCommand("measure", experiment, *["--simulated"] * simulated, out=out)
    return _measure(asked, prepared, out, as_json)


def _show_playing(prepared: ReadyMeasurement) -> None:
    from livebode_design.design_terminal import plain_table

    table = plain_table("measurement", "value")
    for row in prepared.rows():
        table.add_row(*row)
    console(markup=False).print(table)


def _measure(asked: Experiment, prepared: ReadyMeasurement, out: Path, as_json: bool) -> NextCommand:
    from livebode.cli import run_targets
    from livebode.locations import location
    from livebode.plugins import loaded
    from livebode_design.measurement import measure

    def say(sentence: str) -> None:
        print(f"livebode: {sentence}", flush=True, file=sys.stderr if as_json else sys.stdout)

    with _stopping() as (request, signals):
        made = measure(asked, prepared, out, request, say=say, draw=loaded(asked.picture))
    say(f"{made.samples} samples in {out / made.log}, {made.lost} of them lost")
    if signals:
        say("the measurement was stopped, and not tracked")
        raise KeyboardInterrupt if signals[0] == signal.SIGINT else SystemExit(128 + signals[0])
    return run_targets(
        [location(str(out / "axis.toml"))], {}, [], output_only=False, band=None, out=str(out / "run"),
        force=False, serve=False, port=None, as_json=as_json,
    )  # fmt: skip


@contextmanager
def _stopping() -> Iterator[tuple[StopRequest, list[int]]]:
    """Signals that ramp down, in place of those that end the process."""
    from livebode_design.playback import StopRequest

    request, came = StopRequest(), list[int]()

    def ask(number: int, _: object) -> None:
        came.append(number)
        request.ask()

    kinds = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
    before = {number: signal.signal(number, ask) for number in kinds}
    try:
        yield request, came
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
