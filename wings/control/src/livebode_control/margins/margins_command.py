"""`livebode margins`: stability margins of the loop of a finished run, and filters that improve them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from livebode.cli import Entry, Json, NextCommand, results_directory
from livebode.core import RecordError, writing
from livebode.locations import location

if TYPE_CHECKING:
    from livebode.analysis import Margins
    from livebode_control.margins.loop_margins import LoopMargins
    from livebode_control.tuning.filter_proposal import Proposal, Tuning


def margins_command(
    directory: Annotated[Path, typer.Argument(metavar="RUN", help="Run directory.", parser=location)],
    axis: Annotated[
        Path | None,
        typer.Option(metavar="AXIS.toml", help="Read \\[loop] and \\[fit] from this file instead of the run."),
    ] = None,
    model: Annotated[str | None, typer.Option(help="rigid, two-mass, … \\[default: the run's \\[fit]]")] = None,
    entry: Entry = None,
    max_sensitivity: Annotated[float, typer.Option(help="Largest permitted peak sensitivity Ms.")] = 2.0,
    as_json: Json = False,
) -> NextCommand | None:
    """Compute gain, phase and delay margin, Ms and bandwidth of the loop, with bounds; propose a filter if needed.

    Writes margins.svg to the run directory.
    """
    from livebode.configuration import Axis, FitSection
    from livebode.records import to_json
    from livebode_control.margins.loop_margins import margins_of_run
    from livebode_control.margins.loop_picture import save_loop_picture

    section = None if model is None else FitSection(model=model)
    loop = margins_of_run(directory, section, None if axis is None else Axis.read(axis), max_sensitivity, entry)
    into = results_directory(directory)
    with writing(into, RecordError):
        picture = save_loop_picture(loop.report, into, title=directory.name)
    if as_json:
        print(to_json(loop.plain()))
        return None
    show_loop(loop)
    print(f"\n{picture}")
    return NextCommand("tune" if loop.tuning.proposals else "report", directory, entry=entry)


def show_loop(of: LoopMargins) -> None:
    """Print the margins with bounds and marks, and the proposals."""
    report = of.report
    low, high = report.fit.band_hz
    print(f"loop around the {report.fit.model.name} model, {report.of}; lines {low:g} … {high:g} Hz")
    print(f"  {report.checked.sentence}")
    if not report.margins.ok[0]:
        print(f"  no margins: {report.message}")
    else:
        _show_margins(report.margins)
        if report.fit.taken or not report.fit.complete:
            print(f"  {report.fit.about_bounds}")
    size, bound, at_hz = report.at_lines
    print(f"  above {high:g} Hz nothing is promised: a mode that the model does not have can reduce the margins")
    print(f"  lines alone, without the model: Ms is at least {size:.3g} ± {bound:.2g} (at {at_hz:g} Hz)")
    if len(report.places) > 1:
        print(f"worst of {len(report.places)} fits, at 12 places and of the whole run: {_in_short(of.tuning.before)}")
    _show_tuning(of.tuning)


def _show_margins(margins: Margins) -> None:
    import numpy as np

    from livebode.analysis import MARGIN_WORDS

    bound = margins.bound()[0]
    for i, (name, unit) in enumerate(zip(margins.names, margins.units)):
        value, f = margins.value[0, i], margins.frequency_hz[0, i]
        if np.isnan(f):
            print(f"  {MARGIN_WORDS[name]:22}{'any amount' if np.isinf(value) else 'none':>16}   (no crossing)")
            continue
        mark = "by the model, between the lines" if margins.place[0, i] == "interpolated" else "EXTRAPOLATED"
        known = "" if bound[i] < abs(value) else ", not known"
        print(f"  {MARGIN_WORDS[name]:22}{value:>10.4g} ± {bound[i]:<9.2g}{unit:4} at {f:<7.4g} Hz, {mark}{known}")
    print("  ± covers 95 %, from the covariance of the fit; no line checks the model where it is EXTRAPOLATED")


def _show_tuning(tuning: Tuning) -> None:
    print(f"{tuning.verdict}: {tuning.sentence}")
    for proposal in tuning.proposals:
        _show_proposal(proposal)


def _show_proposal(proposal: Proposal) -> None:
    about = proposal.about
    if proposal.kind == "notch":
        words = f"notch at {about['frequency_hz']:.4g} Hz, {about['depth_db']:g} dB deep, "
        words += f"half of that from {about['from_hz']:.4g} to {about['to_hz']:.4g} Hz"
    else:
        words = f"low-pass of second order at {about['frequency_hz']:.4g} Hz"
    print(f"  {words}; behind the controller, at {proposal.biquad.rate_hz:g} Hz:")
    b, a = proposal.biquad.b, proposal.biquad.a
    print("    b = " + ", ".join(f"{x:.12g}" for x in b) + "   a = 1, " + ", ".join(f"{x:.12g}" for x in a))
    print(f"    would give: {_in_short(proposal.after)}")


def _in_short(margins: Margins) -> str:
    from livebode.analysis import worst
    from livebode.cli import margins_in_short

    least = worst(margins)
    return margins_in_short(least) if least else "no margins"
