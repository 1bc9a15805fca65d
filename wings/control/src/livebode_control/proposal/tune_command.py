"""`livebode tune`: a controller for the loop of a finished run, or an input shaper for its load."""

from __future__ import annotations

from math import exp
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from livebode.cli import Entry, Json, NextCommand, check_use, results_directory
from livebode.core import RecordError, TuneError, UsageError, write_whole, writing
from livebode.locations import location

if TYPE_CHECKING:
    from livebode_control.tuning import ControllerProposal
    from livebode_control.tuning.feedforward import Feedforward
    from livebode_control.tuning.gain_schedule import GainSchedule


def tune_command(
    context: typer.Context,
    directory: Annotated[Path, typer.Argument(metavar="RUN", help="Run directory.", parser=location)],
    axis: Annotated[
        Path | None, typer.Option(metavar="AXIS.toml", help="Read \\[loop] from this file instead of the run.")
    ] = None,
    bandwidth_hz: Annotated[
        float | None, typer.Option(metavar="HZ", help="Required bandwidth. \\[default: as high as possible]")
    ] = None,
    gain_margin_db: Annotated[float, typer.Option(metavar="DB", help="Smallest gain margin.")] = 6.0,
    phase_margin_deg: Annotated[float, typer.Option(metavar="DEG", help="Smallest phase margin.")] = 30.0,
    max_sensitivity: Annotated[float, typer.Option(help="Largest peak sensitivity Ms.")] = 2.0,
    disk_margin: Annotated[float, typer.Option(help="Smallest disk margin; 0: no limit.")] = 0.0,
    noise_gain: Annotated[
        float | None, typer.Option(help="Largest rms of the input for white noise of 1 at the output.")
    ] = None,
    encoder_step: Annotated[
        float | None, typer.Option(metavar="STEP", help="Step of the encoder: rad for rad/s, or the position's unit.")
    ] = None,
    input_noise: Annotated[
        float | None, typer.Option(help="Largest rms of the input, in its unit, due to the rounding of the encoder.")
    ] = None,
    notches: Annotated[int, typer.Option(help="Most notches, 0 … 4.")] = 2,
    low_pass: Annotated[bool, typer.Option(help="Permit a low-pass of second order.")] = True,
    coherence: Annotated[float, typer.Option(help="Do not use lines with a lower coherence.")] = 0.5,
    loop_checked: Annotated[
        bool, typer.Option("--loop-checked", help="The description of the loop was compared with the machine.")
    ] = False,
    schedule: Annotated[
        bool,
        typer.Option("--schedule", help="Also propose gains over the schedule, with the same filters, as gains.csv."),
    ] = False,
    odrive: Annotated[
        bool,
        typer.Option("--odrive", help="Also write odrive.txt, the gains for odrivetool (firmware from 0.5)."),
    ] = False,
    strokes: Annotated[
        str | None,
        typer.Option(
            metavar="RUN|LOG|AXIS.toml",
            help="Usual strokes in both directions, for the feedforward of friction. \\[default: the run's recording]",
        ),
    ] = None,
    entry: Entry = None,
    shaper: Annotated[
        bool, typer.Option("--shaper", help="Propose input shapers for a mode of the fitted model instead.")
    ] = False,
    model: Annotated[
        str | None,
        typer.Option(
            help="For --shaper: two-mass, two-mass-gain, three-mass or modal, as in fit. \\[default: the run's [fit]]"
        ),
    ] = None,
    mode: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="For --shaper: antiresonance (the load swings while a stiff drive holds the motor) or resonance; of "
            "several, with a number: resonance_2; of modal frequency_1, … \\[default: antiresonance; of modal "
            "frequency_1]",
        ),
    ] = None,
    tolerance: Annotated[float, typer.Option(help="For --shaper: share of the vibration that may remain.")] = 0.05,
    klipper_axis: Annotated[
        Literal["x", "y", "z"], typer.Option(help="For --shaper: axis in the text for Klipper.")
    ] = "x",
    as_json: Json = False,
) -> NextCommand:
    """Propose gains and filters for the described cascade, safe for every plant within bounds; or input shapers.

    Writes tune.svg, the gains as gains.toml, the filters as filters.h and filters.st, and for `livebode report` the
    whole as tune.json, to the run directory; nothing to a machine. The exit code is 2 if no controller meets the
    specification. With --entry of a matrix run it is the controller between that output and input, and the plant that
    it sees while the other [[loop.controllers]] are active as described.

    With --shaper, ZV, ZVD, EI and an optimised shaper are computed over the bounds of a mode at every place of the run.
    The shortest with enough effect is written as shaper.h and shaper.st, and the best that Klipper has as shaper.cfg.
    """
    check_use(context, "--shaper", ("--model", "--mode", "--tolerance", "--klipper-axis"))
    if shaper:
        from livebode_control.proposal.shaper_output import propose_shaper

        propose_shaper(directory, model, mode, tolerance, klipper_axis, as_json=as_json)
        return NextCommand("report", directory)
    if entry is not None and (schedule or strokes is not None):
        raise _not_of_an_entry()
    from livebode.configuration import read_loop
    from livebode.records import to_json
    from livebode_control.proposal.stored_proposal import store_proposal
    from livebode_control.proposal.tune_report import feedforward_of, schedule_run, tune_run
    from livebode_control.proposal.tuning_picture import save_tuning_picture
    from livebode_control.tuning import LoopSpecification
    from livebode_control.tuning.code_text import c_header, odrive_text, structured_text
    from livebode_control.tuning.gains_text import gains_toml

    specification = LoopSpecification(
        bandwidth_hz=bandwidth_hz,
        gain_margin_db=gain_margin_db,
        phase_margin_deg=phase_margin_deg,
        max_sensitivity=max_sensitivity,
        disk_margin=disk_margin,
        noise_gain=noise_gain,
        encoder_step=encoder_step,
        input_noise=input_noise,
        notches=notches,
        low_pass=low_pass,
        coherence=coherence,
    )
    other = None if axis is None else read_loop(axis)
    proposal = tune_run(directory, specification, other, loop_checked=loop_checked, entry=entry)
    moves = None if strokes is None else location(strokes)
    # Several motors share the inertia that an entry of a matrix would show.
    forward = feedforward_of(directory, proposal.feedback.controller, moves) if entry is None else None
    gains = schedule_run(directory, specification, other, loop_checked=loop_checked) if schedule else None
    into = results_directory(directory)
    with writing(into, RecordError):
        title = directory.name if entry is None else f"{directory.name}: {entry}"
        save_tuning_picture(proposal, into, gains=gains, feedforward=forward, title=title)
        store_proposal(proposal, into, other, entry)
        write_whole(into / "filters.h", c_header(proposal.feedback.biquads).encode())
        write_whole(into / "gains.toml", gains_toml(proposal.feedback.controller).encode())
        if odrive:
            write_whole(into / "odrive.txt", odrive_text(proposal.feedback).encode())
        if gains is not None:
            write_whole(into / "gains.csv", gains.csv().encode())
        write_whole(into / "filters.st", structured_text(proposal.feedback.biquads).encode())
    if as_json:
        more = {"feedforward": forward, "schedule": gains}
        print(
            to_json(proposal.plain() | {name: None if extra is None else extra.plain() for name, extra in more.items()})
        )
    else:
        show_proposal(proposal)
        if entry is None:
            show_feedforward(forward)
        else:
            print(f"of the controller {entry} alone: the other controllers are active as described, and do not change")
        if gains is not None:
            show_schedule(gains)
        also = {"odrive.txt": odrive, "gains.csv": schedule}
        written = [
            "tune.json",
            "tune.svg",
            "gains.toml",
            "filters.h",
            "filters.st",
            *(name for name, use in also.items() if use),
        ]
        print(f"\n{into}: {', '.join(written)}")
    if not proposal.met:
        raise TuneError(
            "specification-unmet",
            proposal.sentence,
            "require less, or remove what limits it",
            bandwidth_hz=proposal.promised.bandwidth_hz,
            limited_by=list(proposal.limited_by),
        )
    return NextCommand("report", directory, entry=entry)


def _not_of_an_entry() -> UsageError:
    return UsageError(
        "conflict",
        "--entry has no --schedule and no --strokes: a matrix has one place, and several motors share the inertia",
        "leave them out",
        options=["--entry", "--schedule", "--strokes"],
    )


def show_proposal(proposal: ControllerProposal) -> None:
    """Print controller, filters and margins before and after."""
    print("proposal (nothing is written to a machine)")
    _show_parameters(proposal)
    for frequency_hz, depth_db, damping in proposal.feedback.notches:
        print(f"  notch at {frequency_hz:.4g} Hz, {depth_db:.3g} dB deep, damping {damping:.3g}")
    for corner_hz in proposal.feedback.low_passes:
        print(f"  low-pass of second order at {corner_hz:.4g} Hz")
    for biquad in proposal.feedback.biquads:
        b, a = (", ".join(f"{x:.12g}" for x in part) for part in (biquad.b, biquad.a))
        print(f"    at {biquad.rate_hz:g} Hz: b = {b}   a = 1, {a}")
    _show_margins(proposal)
    print(proposal.sentence)
    print(proposal.reach.sentence)


def show_schedule(schedule: GainSchedule) -> None:
    """Print the gains of each place, and the promised bandwidth with these and with one controller."""
    print("gains over the schedule, with the filters above; bandwidth also with one controller for all places")
    print("  " + "".join(f"{name:>16}" for name in ("place", *schedule.names, "bandwidth, Hz", "one controller")))
    for place, row, promised, common in zip(
        schedule.position, schedule.logarithms, schedule.promised, schedule.common_promised
    ):
        numbers = (place, *(exp(x) for x in row), promised.bandwidth_hz, common.bandwidth_hz)
        print("  " + "".join(f"{x:>16.5g}" for x in numbers))
    print(f"  {schedule.reach.sentence}")
    if not schedule.share:
        print("  no other gains keep the limits between the places")


def show_feedforward(forward: Feedforward | None) -> None:
    """Print inertia and friction with their bounds, in SI units."""
    if forward is None:
        print("feedforward: the lines do not show the inertia")
        return
    print("feedforward (95 %, SI units)")
    for name in ("inertia", "viscous", "coulomb", "offset"):
        if (value := getattr(forward, name)) is not None:
            print(f"  {name:32}{value:>12.5g} ± {getattr(forward, f'{name}_bound'):.2g}")
    if forward.coulomb is None:
        print("  friction: the recording has no strokes in both directions; name some: --strokes")


def _show_parameters(proposal: ControllerProposal) -> None:
    from dataclasses import asdict

    old, new = asdict(proposal.loop.feedback), asdict(proposal.feedback.controller)  # type: ignore[call-overload]
    for name, value in _numbers(new).items():
        before = _numbers(old)[name]
        if before != value:
            print(f"  {name:32}{before:>12.5g}  →  {value:.5g}")


def _numbers(values: dict[str, object], prefix: str = "") -> dict[str, float]:
    numbers: dict[str, float] = {}
    for name, value in values.items():
        if isinstance(value, dict):
            numbers |= _numbers(value, f"{prefix}{name}.")
        elif isinstance(value, float):
            numbers[f"{prefix}{name}"] = value
    return numbers


def _show_margins(proposal: ControllerProposal) -> None:
    """Before and after, each as measured and, in brackets, for the worst plant within the bounds."""
    words = {
        "gain_margin_db": "gain margin, dB",
        "phase_margin_deg": "phase margin, °",
        "max_sensitivity": "Ms",
        "disk_margin": "disk margin",
        "bandwidth_hz": "bandwidth, Hz",
    }
    rows = len(proposal.plant.value)
    print(f"  {'':18}{'before (worst plant)':>24}{'after (promised)':>24}")
    for name, word in words.items():
        cells = [
            "unstable"
            if measured is None or promised is None
            else f"{getattr(measured, name):.4g} ({getattr(promised, name):.4g})"
            for measured, promised in ((proposal.before, proposal.before_worst), (proposal.after, proposal.promised))
        ]
        print(f"  {word:18}{cells[0]:>24}{cells[1]:>24}")
    word = "noise gain" if proposal.specification.encoder_step is None else "input noise, rms"
    print(f"  {word:18}{proposal.noise[0]:>24.4g}{proposal.noise[1]:>24.4g}")
    places, lines_hz = f"{rows} places, " if rows > 1 else "", proposal.plant.lines_hz
    print(
        f"  {places}{lines_hz.size} lines, {lines_hz[0]:g} … {lines_hz[-1]:g} Hz; "
        f"the true plant is within the bounds with {100 * proposal.specification.confidence:g} %, all lines together"
    )
