"""`livebode fit`: fit a model to a finished run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from livebode.cli.band import parsed_band
from livebode.cli.options import Json
from livebode.cli.pictures import show_fit
from livebode.configuration import Axis
from livebode.core import UsageError
from livebode.records import RunRecord, to_json


def fit_command(
    directory: Annotated[Path, typer.Argument(metavar="RUN", help="Run directory.")],
    model: Annotated[
        str | None,
        typer.Option(
            help="rigid, two-mass, three-mass, two-mass-gain or auto (two-mass if the input is a torque in N m)."
        ),
    ] = None,
    output: Annotated[
        str | None,
        typer.Option(help="Quantity of y: velocity, position or auto (by its kind; without a unit, the better fit)."),
    ] = None,
    side: Annotated[str | None, typer.Option(help="Where y is measured: motor or load. \\[default: motor]")] = None,
    radius: Annotated[
        float | None, typer.Option(metavar="M", help="Radius of the pulley, for a load in linear motion.")
    ] = None,
    ratio: Annotated[float | None, typer.Option(help="Ratio of the load's inertia to the motor's, if known.")] = None,
    fix: Annotated[list[str] | None, typer.Option(metavar="NAME=VALUE", help="Fix a parameter at this value.")] = None,
    free: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Fit a parameter that is fixed by default: delay, B, BL.")
    ] = None,
    band: Annotated[
        str | None, typer.Option(metavar="LOW:HIGH", help="Use only the lines from LOW to HIGH Hz.")
    ] = None,
    hold: Annotated[
        str | None, typer.Option(help="zero-order (the input is constant between samples) or none.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Fit a model to the response of a run, and print its parameters with bounds.

    Defaults are from the run's \\[fit] section. Exit code 3 if no model fits.
    """
    from livebode.analysis.averaged import averaged
    from livebode.analysis.fits import fit_averaged, fit_remarks, plain_fit
    from livebode.configuration.recorded import recorded_configuration

    given: dict[str, Any] = {
        "model": model,
        "output": output,
        "side": side,
        "radius_m": radius,
        "inertia_ratio": ratio,
        "fixed": dict(_pair(text) for text in fix) if fix else None,
        "free": free or None,
        "band_hz": parsed_band(band),
        "hold": hold,
    }
    data = {"source": {"log": str(directory)}, "signals": {"output": "y"}}
    run = RunRecord.open(directory)
    configuration = recorded_configuration(run.summary)
    own = configuration.get("fit", {})
    section = Axis.of(data | {"fit": own | {k: v for k, v in given.items() if v is not None}}, "the options").fit
    assert section is not None
    average = averaged(run)
    found, words = fit_averaged(average, section)
    source, signals = (configuration.get(name, {}) for name in ("source", "signals"))
    live = "url" in source or bool(source.get("follow"))
    remarks = fit_remarks(average, section, found, str(signals.get("output", "y")), live=live)
    if as_json:
        print(to_json({"fitted_to": words} | plain_fit(found) | {"remarks": remarks}))
    else:
        show_fit(found, words)
        for remark in remarks:
            print(f"  {remark}")
    if found.status != "ok":
        raise typer.Exit(3)


def _pair(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        return name.strip(), float(value)
    except ValueError:
        raise UsageError(
            "unreadable",
            f"{text!r} is not NAME=VALUE with a number",
            "write for example Js=0.0028",
            argument="fix",
            value=text,
        ) from None
