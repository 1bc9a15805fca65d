"""`livebode run`: track a recording or live sources."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from livebode.cli.next_step import NextCommand
from livebode.cli.options import Band, Json, Port, Serve
from livebode.cli.section_options import with_keys
from livebode.core import UsageError
from livebode.locations import location


@with_keys(
    source={
        "rate_hz": ("--rate", "HZ"),
        "time": ("--time", "COLUMN"),
        "from": ("--from", "MOMENT"),
        "to": ("--to", "MOMENT"),
        "skip_periods": ("--skip-periods", "N"),
        "dbc": ("--dbc", "FILE"),
    },
    signals={"schedule": ("--schedule", "CHANNEL")},
    lines={"frequencies": ("--lines", "HZ"), "window": ("--window", "SAMPLES")},
    tracking={
        "estimator": ("--estimator", ""),
        "quantity": ("--quantity", ""),
        "hop": ("--hop", "SAMPLES"),
        "average": ("--average", ""),
        "forgetting": ("--forgetting", ""),
        "noise": ("--noise", ""),
        "differenced": ("--difference", "CHANNEL"),
        "trend": ("--trend", ""),
        "spikes": ("--spikes", "CHANNEL"),
        "accept_roles": ("--accept-roles", ""),
        "all_periods": ("--all-periods", ""),
    },
    monitoring={
        "baseline": ("--baseline", "BASELINE"),
        "false_alarm_interval_days": ("--false-alarm-interval", "DAYS"),
        "covariates": ("--covariate", "CHANNEL"),
    },
)
def run_command(
    targets: Annotated[
        list[str],
        typer.Argument(metavar="LOG|AXIS.toml", help="A recording, or several that are averaged, or a configuration."),
    ],
    *,
    excitation: Annotated[
        list[str] | None,
        typer.Option(metavar="CHANNEL", help="Channel of the excitation w, or an expression; repeat for a matrix."),
    ] = None,
    output: Annotated[
        list[str] | None,
        typer.Option(
            metavar="CHANNEL",
            help="Channel of the measured output y, or an expression: -y, pos + 0.35*angle, diff(pos); repeat for "
            "several.",
        ),
    ] = None,
    input: Annotated[
        list[str] | None,
        typer.Option(metavar="CHANNEL", help="Channel of the plant input u; repeat for a matrix of responses."),
    ] = None,
    matrix: Annotated[
        bool,
        typer.Option("--matrix", help="One run with the responses of all --output, instead of a run for each."),
    ] = False,
    sections: dict[str, dict[str, Any]],
    output_only: Annotated[
        bool,
        typer.Option("--output-only", help="Track frequencies and dampings of the modes from the output alone."),
    ] = False,
    band: Band = None,
    out: Annotated[
        str | None,
        typer.Option(
            metavar="DIR", help="Run directory, or its URL. \\[default: runs/<name>, or the next free runs/<name>-2]"
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing run in that directory.")] = False,
    go_on: Annotated[
        bool,
        typer.Option("--continue", help="Record in segments that survive a kill; continue an existing run in --out."),
    ] = False,
    serve: Serve = False,
    port: Port = None,
    as_json: Json = False,
) -> NextCommand:
    """Track the frequency response of a machine in a recording, or live until the source ends or Ctrl-C.

    Writes a run directory with responses.parquet, run.json, events.jsonl, bode.svg and tracking.svg; with several
    --output one for each in --out, which livebode fit takes together. With several --input, or with --matrix, the run
    has a matrix of responses from all inputs to all outputs, and singular-values.svg instead of tracking.svg.
    """
    as_matrix = matrix or any(len(names or []) > 1 for names in (input, excitation))
    named = {
        "output": (output if as_matrix else output[0]) if output else None,
        "input": input or None,
        "excitation": excitation or None,
    }
    signals = {role: channels for role, channels in named.items() if channels} | sections.get("signals", {})
    over = sections | ({"signals": signals} if signals else {}) | ({"record": {}} if go_on else {})
    if "window" in over.get("lines", {}):
        over["lines"]["window"] = _window(over["lines"]["window"])
    if "baseline" in over.get("monitoring", {}):
        over["monitoring"]["baseline"] = over["monitoring"]["baseline"].absolute()
    from livebode.cli.running import run_targets  # with all that measures

    return run_targets(
        [location(target) for target in targets], over, [] if as_matrix else output or [],
        output_only=output_only, band=band, out=out, force=force, serve=serve, port=port, as_json=as_json,
    )  # fmt: skip


def _window(text: str) -> int | str:
    if text == "auto":
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
