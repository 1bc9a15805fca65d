"""`livebode run`: track a recording or live sources."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from livebode.cli.band import Band
from livebode.cli.options import Dbc, From, Json, Outputs, Port, Rate, Serve, SkipPeriods, Time, To
from livebode.core import UsageError
from livebode.locations import location


def run_command(
    targets: Annotated[
        list[str],
        typer.Argument(metavar="LOG|AXIS.toml", help="A recording, or several that are averaged, or a configuration."),
    ],
    excitation: Annotated[
        list[str] | None,
        typer.Option(metavar="CHANNEL", help="Channel of the excitation w, or an expression; repeat for a matrix."),
    ] = None,
    output: Outputs = None,
    input: Annotated[
        list[str] | None,
        typer.Option(metavar="CHANNEL", help="Channel of the plant input u; repeat for a matrix of responses."),
    ] = None,
    matrix: Annotated[
        bool,
        typer.Option("--matrix", help="One run with the responses of all --output, instead of a run for each."),
    ] = False,
    schedule: Annotated[
        str | None, typer.Option(metavar="CHANNEL", help="Channel that the responses depend on, such as the position.")
    ] = None,
    rate: Rate = None,
    time: Time = None,
    from_: From = None,
    to: To = None,
    skip_periods: SkipPeriods = None,
    dbc: Dbc = None,
    lines: Annotated[
        str | None,
        typer.Option(
            metavar="HZ", help="Lines as start:stop:step or single frequencies, separated by commas; or auto."
        ),
    ] = None,
    window: Annotated[str | None, typer.Option(metavar="SAMPLES", help="Window in samples, or auto.")] = None,
    hop: Annotated[int | None, typer.Option(metavar="SAMPLES", help="Samples between responses.")] = None,
    estimator: Annotated[
        str | None,
        typer.Option(help="direct, joint or indirect; for noise and chirps lpm or welch. \\[default: joint]"),
    ] = None,
    quantity: Annotated[
        str | None, typer.Option(help="plant, 'open loop', 'closed loop' or sensitivity. \\[default: plant]")
    ] = None,
    average: Annotated[bool | None, typer.Option(help="Average over the previous periods.")] = None,
    forgetting: Annotated[
        float | None, typer.Option(help="Weight of a period relative to the next one, 0 … 1. \\[default: 0.8]")
    ] = None,
    noise: Annotated[
        str | None,
        typer.Option(
            help="Noise of the bounds: auto, periods (scatter between periods) or quiet (bins). \\[default: auto]"
        ),
    ] = None,
    difference: Annotated[
        list[str] | None,
        typer.Option(metavar="CHANNEL", help="Use differences of this channel, such as a position that drifts."),
    ] = None,
    spikes: Annotated[
        list[str] | None, typer.Option(metavar="CHANNEL", help="Exclude windows in which this channel has a spike.")
    ] = None,
    hann: Annotated[
        bool | None, typer.Option(help="Use a Hann window, from three bins; for an axis in motion.")
    ] = None,
    output_only: Annotated[
        bool,
        typer.Option("--output-only", help="Track frequencies and dampings of the modes from the output alone."),
    ] = False,
    band: Band = None,
    baseline: Annotated[
        Path | None,
        typer.Option(
            metavar="BASELINE",
            help="Detect changes from this baseline, a file of `livebode learn`; of matrices a healthy run.",
        ),
    ] = None,
    false_alarm_interval: Annotated[
        float | None,
        typer.Option(metavar="DAYS", help="Mean time between false alarms, in days of judged motion. \\[default: 30]"),
    ] = None,
    covariate: Annotated[
        list[str] | None,
        typer.Option(metavar="CHANNEL", help="Channel that a baseline may depend on, such as a temperature."),
    ] = None,
    out: Annotated[
        str | None, typer.Option(metavar="DIR", help="Run directory, or its URL. \\[default: runs/<name>]")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing run in that directory.")] = False,
    accept_roles: Annotated[
        bool,
        typer.Option("--accept-roles", help="Use the channels as specified, even if the recording contradicts."),
    ] = False,
    all_periods: Annotated[
        bool,
        typer.Option("--all-periods", help="Use all periods, also a transient at the beginning and outlying ones."),
    ] = False,
    go_on: Annotated[
        bool,
        typer.Option("--continue", help="Record in segments that survive a kill; continue an existing run in --out."),
    ] = False,
    serve: Serve = False,
    port: Port = None,
    as_json: Json = False,
) -> None:
    """Track the frequency response of a machine in a recording, or live until the source ends or Ctrl-C.

    Writes a run directory with responses.parquet, run.json, events.jsonl, bode.png and tracking.png; with several
    --output one for each in --out, which livebode fit takes together. With several --input, or with --matrix, the run
    has a matrix of responses from all inputs to all outputs, and singular-values.png instead of tracking.png.
    """
    as_matrix = matrix or any(len(names or []) > 1 for names in (input, excitation))
    given: dict[str, dict[str, Any]] = {
        "source": {
            "rate_hz": rate,
            "time": time,
            "from": from_,
            "to": to,
            "skip_periods": skip_periods,
            "dbc": dbc,
        },
        "signals": {
            "output": (output if as_matrix else output[0]) if output else None,
            "input": input or None,
            "excitation": excitation or None,
            "schedule": schedule,
        },
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
            "accept_roles": accept_roles or None,
            "all_periods": all_periods or None,
        },
        "monitoring": {
            "baseline": None if baseline is None else baseline.absolute(),
            "false_alarm_interval_days": false_alarm_interval,
            "covariates": covariate or None,
        },
    }
    specified = {section: {k: v for k, v in values.items() if v is not None} for section, values in given.items()}
    over = {section: values for section, values in specified.items() if values} | ({"record": {}} if go_on else {})
    from livebode.cli.running import run_targets  # with all that measures

    run_targets(
        [location(target) for target in targets], over, [] if as_matrix else output or [],
        output_only=output_only, band=band, out=out, force=force, serve=serve, port=port, as_json=as_json,
    )  # fmt: skip


def _window(text: str | None) -> int | str | None:
    if text is None or text == "auto":
        return text
    try:
        return int(text)
    except ValueError:
        raise UsageError(
            "unreadable",
            f"the window {text!r} is neither a whole number of samples nor auto",
            "write for example 4000, or auto",
            argument="window",
            value=text,
        ) from None
