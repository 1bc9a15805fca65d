"""`livebode run`: the online job on a recording."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from livebode.cli.options import Excitation, Json, Output, Port, Rate, Serve, Time
from livebode.cli.pictures import drawing, show
from livebode.cli.serving import served
from livebode.nouns import Event, InputError
from livebode.records import to_json
from livebode.session import Audience, Axis, Outcome, run, run_live


def run_command(
    target: Annotated[Path, typer.Argument(metavar="LOG|AXIS.toml", help="A recording, or a configuration.")],
    excitation: Excitation = None,
    output: Output = None,
    input: Annotated[str | None, typer.Option(metavar="CHANNEL", help="Channel of the plant input u.")] = None,
    schedule: Annotated[
        str | None, typer.Option(metavar="CHANNEL", help="Channel to show the responses over, such as position.")
    ] = None,
    rate: Rate = None,
    time: Time = None,
    lines: Annotated[
        str | None,
        typer.Option(metavar="HZ", help="Lines as start:stop:step or single ones, joined by commas; or auto."),
    ] = None,
    window: Annotated[str | None, typer.Option(metavar="SAMPLES", help="Window in samples, or auto.")] = None,
    hop: Annotated[int | None, typer.Option(metavar="SAMPLES", help="Samples between responses.")] = None,
    estimator: Annotated[str | None, typer.Option(help="direct, joint or indirect; joint unless said.")] = None,
    quantity: Annotated[
        str | None, typer.Option(help="plant, 'open loop', 'closed loop' or sensitivity; plant unless said.")
    ] = None,
    average: Annotated[bool | None, typer.Option(help="Average over the periods before.")] = None,
    forgetting: Annotated[
        float | None, typer.Option(help="Weight of a period against the one after it, 0 … 1; 0.8 unless said.")
    ] = None,
    noise: Annotated[str | None, typer.Option(help="Bounds from the scatter between periods, or quiet bins.")] = None,
    difference: Annotated[
        list[str] | None, typer.Option(metavar="CHANNEL", help="Difference this channel first: a position that drifts.")
    ] = None,
    spikes: Annotated[
        list[str] | None, typer.Option(metavar="CHANNEL", help="Leave out windows in which this channel has a spike.")
    ] = None,
    hann: Annotated[bool | None, typer.Option(help="Hann window from three bins, for an axis in motion.")] = None,
    baseline: Annotated[
        Path | None, typer.Option(metavar="BASELINE", help="Tell changes against what `livebode learn` wrote.")
    ] = None,
    false_alarms: Annotated[
        str | None,
        typer.Option(metavar="WORDS", help="How often one may come, such as 'one in 30 days of motion' (unless said)."),
    ] = None,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Run directory; runs/<name> unless said.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an earlier run in that directory.")] = False,
    go_on: Annotated[
        bool,
        typer.Option("--continue", help="Record in segments that outlast a kill, and go on with a run in --out."),
    ] = False,
    serve: Serve = False,
    port: Port = None,
    as_json: Json = False,
) -> None:
    """Track the frequency response of a machine through a recording, or live until it ends or Ctrl-C.

    Leaves a run directory with responses.parquet, run.json, events.jsonl, bode.png and tracking.png.
    """
    given: dict[str, dict[str, Any]] = {
        "source": {"rate_hz": rate, "time": time},
        "signals": {"output": output, "input": input, "excitation": excitation, "schedule": schedule},
        "lines": {"frequencies": lines, "window": _window(window)},
        "tracking": {
            "estimator": estimator,
            "quantity": quantity,
            "hop": hop,
            "average": average,
            "forgetting": forgetting,
            "noise": noise,
            "differenced": difference or None,
            "spikes": spikes or None,
            "hann": hann,
        },
        "monitoring": {"baseline": baseline, "false_alarms": false_alarms},
    }
    axis = _axis(target, given, go_on)
    with served(serve, axis.serve, port, target.stem, stays=not axis.source.live) as audience:
        outcome = _run(axis, out or Path("runs") / target.stem, force, quiet=as_json, audience=audience)
        if as_json:
            print(to_json({"directory": str(outcome.directory)} | outcome.summary), flush=True)
        else:
            show(outcome)


def _axis(target: Path, given: dict[str, dict[str, Any]], go_on: bool) -> Axis:
    """The configuration in the file, or of the recording, with the options given over it."""
    said = {section: {k: v for k, v in values.items() if v is not None} for section, values in given.items()}
    if go_on:
        said["record"] = {}
    if target.suffix.lower() == ".toml":
        base = Axis.read(target).model_dump(exclude_unset=True)
        data = {section: base.get(section, {}) | said.get(section, {}) for section in base.keys() | said.keys()}
        return Axis.of(data, str(target))
    if "output" not in said["signals"]:
        raise InputError("no output is named; give --output CHANNEL (livebode inspect lists the channels)")
    said["source"]["log"] = target
    return Axis.of(said, "the options")


def _window(text: str | None) -> int | str | None:
    if text is None or text == "auto":
        return text
    try:
        return int(text)
    except ValueError:
        raise InputError(f"--window {text!r} is neither a whole number of samples nor auto") from None


def _run(axis: Axis, directory: Path, force: bool, quiet: bool, audience: Audience | None) -> Outcome:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    names = (axis.signals.input or axis.signals.excitation or "", axis.signals.output)
    draw = drawing(f"{axis.source.title}: {axis.signals.output}", names)
    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, transient=True, disable=quiet or not console.is_terminal) as bar:
        task = bar.add_task("tracking", total=None)

        def progress(done: int, total: int | None) -> None:
            bar.update(task, completed=done, total=total)

        def tell(event: Event) -> None:
            bar.console.print(f"livebode: {event.message}", highlight=False, markup=False)

        job = run_live if axis.source.live else run
        return job(axis, directory, force=force, progress=progress, draw=draw, tell=tell, audience=audience)
