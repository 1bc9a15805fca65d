"""`livebode demo`: track a simulated axis, without hardware."""

from __future__ import annotations

import sys
from contextlib import nullcontext
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from livebode.cli import terminal
from livebode.cli.next_step import NextCommand
from livebode.cli.options import Json, Port, Serve

if TYPE_CHECKING:
    from livebode.core import Responses
    from livebode.runtime import Document

_SHOWN = 4
_SEED = 1
"""Of the noise: each demonstration is the same run."""


def demo_command(
    seconds: Annotated[float, typer.Option(help="Duration of the simulation.")] = 22.0,
    fast: Annotated[bool, typer.Option("--fast", help="As fast as possible, not in real time.")] = False,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Run directory; a previous demo there is replaced.")] = Path(
        "runs/demo"
    ),
    serve: Serve = False,
    port: Port = None,
    as_json: Json = False,
) -> NextCommand:
    """Track a simulated belt axis during its strokes, live; halfway, the belt loses 10 % of its stiffness."""
    from rich.progress import BarColumn, Progress, TextColumn

    from livebode.cli.pictures import draw_titled, show
    from livebode.cli.serving import served
    from livebode.configuration import ServeSection
    from livebode.core import Responses
    from livebode.records import to_json
    from livebode.runtime import (  # with the simulation
        LEARNED_S,
        Destination,
        TrackerResults,
        check_seconds,
        demo,
        demo_baseline,
    )

    check_seconds(seconds)
    console = terminal.console(stderr=True)
    if not as_json:
        print("A simulated tooth-belt axis moves back and forth. Halfway, the belt loses 10 % of its stiffness.")
    with (
        console.status(f"Learning the healthy axis from {LEARNED_S:g} s of its strokes")
        if not as_json
        else nullcontext()
    ):
        baseline = demo_baseline(_SEED + 1)
    columns = (TextColumn("{task.completed:.1f} s"), BarColumn(10), TextColumn("{task.description}"))
    # A first user sees the page without asking for it, on any free port, so that the default port stays free.
    shown = serve or (not fast and find_spec("uvicorn") is not None)
    section = ServeSection() if serve else ServeSection(port=0)
    with served(section, port, {"demo": ()}, stays=serve) if shown else nullcontext(lambda _: ()) as subscribers_of:
        with Progress(*columns, console=console, transient=True, disable=as_json or not console.is_terminal) as bar:
            task = bar.add_task("", total=seconds)

            def show_numbers(document: Document) -> None:
                if isinstance(document, Responses):
                    bar.update(task, description=_numbers(document))
                elif isinstance(document, TrackerResults):
                    total = document.samples_total or document.samples
                    bar.update(task, completed=seconds * document.samples / total)

            draw = partial(draw_titled, title="simulated belt axis", names=("u", "velocity"))
            to = Destination(out, draw, force=True, subscribers=(*subscribers_of("demo"), show_numbers))
            outcome = demo(to, seconds=seconds, seed=_SEED, real_time=not fast, baseline=baseline)
        if as_json:
            print(to_json({"directory": str(outcome.directory)} | outcome.summary), flush=True)
        else:
            show(outcome)
            sys.stdout.flush()
    return NextCommand("view", out)


def _numbers(responses: Responses) -> str:
    """The newest response in a line: position of the cart and magnitude at some of the lines."""
    if not len(responses) or not responses.valid[-1].any():
        return "waiting for the first complete window"
    newest = responses[-1]
    f = newest.lines.frequency_hz
    some = slice(None, None, max(1, len(f) // _SHOWN))
    levels = ", ".join(f"{hz:.0f} Hz {db:+.1f} dB" for hz, db in zip(f[some], newest.magnitude_db[some]))
    return f"cart at {newest.schedule:.2f} m: {levels}"
