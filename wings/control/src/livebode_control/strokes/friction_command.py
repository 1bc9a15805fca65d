"""`livebode friction`: the friction curve of an axis from usual strokes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from livebode.cli import From, Json, NextCommand, Rate, Time, To, console, results_directory
from livebode.core import OutputError, SignalError, writing
from livebode.locations import location

if TYPE_CHECKING:
    from livebode_control.strokes.friction import FrictionReport

_WIDTH_MAX = 4096
_PLACES = 8
"""Positions along the travel in the command that is proposed next."""
_WORDS = {
    "inertia": "inertia",
    "coulomb": "Coulomb",
    "viscous": "viscous",
    "stribeck": "Stribeck",
    "stribeck_speed": "Stribeck speed",
    "offset": "constant force",
}


def friction_command(
    target: Annotated[str, typer.Argument(metavar="RUN|LOG|AXIS.toml", help="A run, recording or configuration.")],
    input: Annotated[
        str | None, typer.Option(metavar="CHANNEL", help="Torque, force or current, or an expression: 35.15*vir.")
    ] = None,
    position: Annotated[str | None, typer.Option(metavar="CHANNEL", help="Position of the axis.")] = None,
    velocity: Annotated[str | None, typer.Option(metavar="CHANNEL", help="Velocity of the axis.")] = None,
    from_: From = None,
    to: To = None,
    rate: Rate = None,
    time: Time = None,
    places: Annotated[
        int, typer.Option(metavar="N", help="Find the Coulomb friction at N positions along the travel.")
    ] = 0,
    band: Annotated[
        float, typer.Option(metavar="HZ", help="Band of the filter; below excitation and resonances.")
    ] = 5.0,
    slowest: Annotated[
        float | None,
        typer.Option(metavar="SPEED", help="Speed of standstill. \\[default: 1 % of the highest speed]"),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(metavar="SVG", help="Picture to write. \\[default: friction.svg in RUN]")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing picture.")] = False,
    as_json: Json = False,
) -> NextCommand | None:
    """Find Coulomb, viscous and Stribeck friction from usual strokes, by direction and position, with bounds.

    The channels default to those of the run or configuration. The strokes need no excitation; it does not disturb
    if its lines are above the band, and --slowest is above the speed to which it shakes the axis at standstill.
    """
    from livebode.export import check_free
    from livebode.preparation import motion_part
    from livebode.records import to_json
    from livebode_control.strokes.friction import friction_of
    from livebode_control.strokes.motion_samples import read_strokes

    if picture is not None:
        check_free(picture, force=force)
    strokes = read_strokes(
        location(target), input=input, position=position, velocity=velocity, rate_hz=rate, time=time,
        part=motion_part(from_, to),
    )  # fmt: skip
    try:
        report = friction_of(strokes, places=places, band_hz=band, slowest=slowest)
    except SignalError as error:
        error.remedy = error.remedy.replace("give the input ", "give --input ")
        raise
    into = picture or (None if strokes.run is None else results_directory(strokes.run) / "friction.svg")
    if into is not None:
        from livebode_control.strokes.friction_picture import save_friction_picture

        with writing(into, OutputError):
            save_friction_picture(report, into, title=Path(target).name)
    if as_json:
        print(to_json(report.plain()))
        return None
    show_friction(report)
    if into is not None:
        print(f"\n{into}")
    if not places and picture is None:
        return NextCommand.again(places=_PLACES)
    return None if strokes.run is None else NextCommand("report", strokes.run)


def show_friction(report: FrictionReport) -> None:
    """Print the parameters with bounds, those of each direction, and those of each place."""
    from rich.measure import Measurement
    from rich.table import Table

    curve, strokes = report.curve, report.strokes
    screen = console(markup=False)
    seconds = len(strokes.block) / strokes.block.rate_hz
    left = strokes.recorded - len(strokes.block)
    screen.print(
        f"friction from {seconds:.4g} s, speeds {curve.speed[0]:.3g} … {curve.speed[1]:.3g}"
        + (f"; {left} samples outside the longest stretch without gaps" if left else ""),
        soft_wrap=True,
    )
    table = Table(box=None, header_style="bold")
    for heading in ("", "both", "± 95 %", "forward", "± 95 %", "backward", "± 95 %", "unit"):
        table.add_column(heading, justify="right" if heading not in ("", "unit") else "left", no_wrap=True)
    bound, each = curve.bound(), report.each_way()
    for i, name in sorted(enumerate(curve.names), key=lambda pair: list(_WORDS).index(pair[1])):
        row = [_WORDS[name], f"{curve.value[i]:.4g}", f"{bound[i]:.2g}"]
        for way in ("forward", "backward"):
            index = {"coulomb": 0, "viscous": 1}.get(name)
            row += ["", ""] if index is None else [f"{each[way][0][index]:.4g}", f"{each[way][1][index]:.2g}"]
        table.add_row(*row, curve.units[i])
    screen.width = max(
        screen.width, Measurement.get(screen, screen.options.update(max_width=_WIDTH_MAX), table).maximum
    )
    screen.print(table)
    if "stribeck" not in curve.names:
        screen.print("no Stribeck friction is visible (99.9 %)")
    if report.differing:
        screen.print("the viscous friction differs between the directions (99 %); 'both' is its mean", soft_wrap=True)
    for note in report.notes:
        screen.print(note, soft_wrap=True)
    if report.places is not None:
        _show_places(report)


def _show_places(report: FrictionReport) -> None:
    from rich.table import Table

    curve = report.places
    assert curve is not None
    table = Table(box=None, header_style="bold")
    for heading in ("position", "Coulomb", "± 95 %"):
        table.add_column(heading, justify="right")
    bound = curve.bound()
    for j, place in enumerate(curve.places):
        i = curve.index(f"coulomb_{j + 1}")
        table.add_row(f"{place:.4g}", f"{curve.value[i]:.4g}", f"{bound[i]:.2g}")
    console(markup=False).print(table)
