"""`livebode inspect`: the contents of a recording, and its configuration."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from livebode.cli import terminal
from livebode.cli.configuration_dialog import write_configuration
from livebode.cli.live_survey import is_live, show_survey
from livebode.cli.next_step import NextCommand
from livebode.cli.options import Excitation, Json, Output, check_use
from livebode.cli.recording_options import Dbc, From, Rate, SkipPeriods, Time, To
from livebode.core import UsageError, counted
from livebode.locations import location

if TYPE_CHECKING:
    from rich.console import Console

    from livebode.preparation import Inspection, Quiet

_SUITS = {
    "joint": "the excitation repeats; name the plant input by --input, and in an open loop take --estimator direct",
    "lpm": "for an excitation that does not repeat, in open and closed loop",
}
_OF_CONFIGURATION = ("--schedule", "--estimator", "--average", "--fit", "--yes", "--force")
_OF_BOTH = ("--excitation", "--input", "--output", "--rate", "--time", "--dbc")
_LINES_SHOWN = 24
_STRETCHES_SHOWN = 16
_WIDTH_MAX = 4096


def inspect_command(
    context: typer.Context,
    log: Annotated[
        str, typer.Argument(metavar="LOG|URL", help="A recording, or the address of a live source: udp://0.0.0.0:5000.")
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Write the configuration, such as axis.toml: propose the role of each channel, and ask.",
        ),
    ] = None,
    excitation: Excitation = None,
    input_: Annotated[
        str | None, typer.Option("--input", metavar="CHANNEL", help="Channel of the plant input u.")
    ] = None,
    output: Output = None,
    schedule: Annotated[
        str | None, typer.Option(metavar="CHANNEL", help="Channel that the responses depend on, such as the position.")
    ] = None,
    estimator: Annotated[
        str | None, typer.Option(help="For --out: joint, direct, lpm or welch. \\[default: by the excitation]")
    ] = None,
    average: Annotated[
        bool | None,
        typer.Option(help="For --out: average over the previous periods. \\[default: without a schedule]"),
    ] = None,
    fit: Annotated[
        str | None,
        typer.Option(
            metavar="MODEL",
            help="For --out: model to fit: auto, two-mass, …; or none. \\[default: auto for a velocity or position "
            "with a periodic excitation]",
        ),
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", help="For --out: accept every proposal without asking.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing file.")] = False,
    lines: Annotated[
        str | None,
        typer.Option(metavar="HZ", help="Lines that you plan to measure, as in run: search for mains hum near them."),
    ] = None,
    window: Annotated[
        int | None, typer.Option(metavar="SAMPLES", help="Window that you plan for these lines.", min=3)
    ] = None,
    rate: Rate = None,
    time: Time = None,
    from_: From = None,
    to: To = None,
    skip_periods: SkipPeriods = None,
    dbc: Dbc = None,
    as_json: Json = False,
) -> NextCommand | None:
    """List channels, rate, gaps and samples that are not finite; with --out propose and write axis.toml.

    With --excitation, also print period, lines and SNR. With --lines, search for mains hum in a recording without
    excitation, or in its longest pause. With --out, propose the role of each channel by its unit, its name and its
    values, ask, find lines and window, and write the configuration. What an option gives is not asked for; "-" means no
    channel. A live source is listened to for 3 s, and its channels, or the fields of another program's messages, are
    listed.
    """
    check_use(context, "--out axis.toml", _OF_CONFIGURATION, _OF_BOTH)
    if out is not None:
        given = {"excitation": excitation, "input": input_, "output": output, "schedule": schedule}
        return write_configuration(
            log, out, given, estimator=estimator, average=average, fit=fit, rate=rate, time=time, dbc=dbc,
            yes=yes, force=force, as_json=as_json,
        )  # fmt: skip
    if is_live(log):
        show_survey(log, as_json=as_json)
        return NextCommand("inspect", log, "--out", "axis.toml")
    _check(excitation, output, input_, lines, window)
    from livebode.preparation import inspect  # with its statistics half a second to import
    from livebode.records import to_json

    of_lines = None if lines is None or window is None else (lines, window)
    found = inspect(
        location(log),
        rate_hz=rate,
        time=time,
        dbc=dbc,
        excitation=excitation,
        output=output,
        input=input_,
        lines=of_lines,
        begin=from_,
        end=to,
        skip_periods=skip_periods or 0,
    )
    if as_json:
        print(to_json(found.plain()))
        return None
    console = terminal.console(markup=False)  # names and units may contain brackets
    _show_recording(found, console)
    if found.quiet is not None:
        _show_hum(found.quiet, console)
    if found.excitation is not None:
        _show_excitation(found, console)
    _show_slow(found, console)
    if found.unrecognised:
        console.print(f"The excitation is not recognised: {found.unrecognised}", soft_wrap=True)
    if found.estimator:
        console.print(f"estimator of a run: --estimator {found.estimator} ({_SUITS[found.estimator]})", soft_wrap=True)
    return NextCommand("inspect", log, "--out", "axis.toml", rate=rate, time=time, dbc=dbc)


def _check(
    excitation: str | None, output: str | None, input_: str | None, lines: str | None, window: int | None
) -> None:
    if (lines is None) != (window is None):
        raise UsageError(
            "missing",
            "--lines and --window need each other: the window determines how near to a line hum disturbs it",
            "give both",
            options=["--lines", "--window"],
        )
    if lines is not None:
        if output is None:
            raise UsageError(
                "missing",
                "--lines finds hum in a recording without excitation, and needs a channel",
                "give --output (and --input) too",
                options=["--lines", "--output"],
            )
    elif input_ is not None:
        raise UsageError(
            "missing",
            "--input is for hum in a recording without excitation, and needs lines",
            "give --output, --lines and --window too",
            options=["--input", "--output", "--lines", "--window"],
        )
    elif output is not None and excitation is None:
        raise UsageError(
            "missing",
            "--output is for the signal-to-noise ratio of an excitation, or for hum without one",
            "give --excitation, or --lines and --window, too",
            options=["--output", "--excitation", "--lines"],
        )


def _show_recording(found: Inspection, console: Console) -> None:
    from rich.measure import Measurement
    from rich.table import Table

    log, contents = found.log, found.contents
    rate = "at an unknown rate" if found.without_rate else f"at {log.rate_hz:.9g} Hz ({log.rate_origin})"
    console.print(f"{log.path}: {log.format}, {contents.samples} samples {rate}", soft_wrap=True)
    gaps = f"{counted(contents.gaps, 'gap')} ({contents.missing} samples missing)" if contents.gaps else "no gaps"
    gaps = "interpolated" if found.clocks else gaps
    jitter = ""
    if log.timing is not None:
        jitter = f", period {log.timing.period_s_mean * 1e6:.6g} µs ± {log.timing.period_s_std * 1e6:.3g} µs"
    if found.without_rate:
        console.print(f"no rate: {found.without_rate} (options --rate and --time)", soft_wrap=True)
    else:
        console.print(f"{contents.samples / log.rate_hz:.6g} s{jitter}, {gaps}")
    _show_clocks(found, console)
    if log.is_part:
        stop = log.first + contents.samples + contents.missing
        span = " … ".join(f"{log.origin_s + sample / log.rate_hz:.6g}" for sample in (log.first, stop))
        console.print(f"part: samples {log.first} to {stop - 1} of the recording ({span} s)", soft_wrap=True)
    table = Table(box=None, header_style="bold")
    for heading in ("channel", "unit", "kind", "from", "to", "not finite"):
        table.add_column(heading, justify="left" if heading in ("channel", "unit", "kind") else "right")
    for channel in contents.channels:
        extent = [f"{x:.6g}" for x in (channel.minimum, channel.maximum)]
        if channel.minimum > channel.maximum:
            extent = ["empty", ""]
        elif channel.minimum == channel.maximum:
            extent[1] = "constant"
        unit = f"{channel.unit} (from {channel.source_unit})" if channel.source_unit else channel.unit
        table.add_row(channel.name, unit, channel.kind, *extent, str(channel.not_finite or ""))
    # A name that is shortened to the width of the terminal cannot be given to a run.
    console.width = max(
        console.width, Measurement.get(console, console.options.update(max_width=_WIDTH_MAX), table).maximum
    )
    console.print(table)
    for skipped in found.skipped:
        console.print(f"  not a channel: {skipped.name} ({skipped.reason})", style="dim")
    for clock, names in log.other_clocks.items():
        console.print(f"  on the clock --time '{clock}': {', '.join(names)}", style="dim", soft_wrap=True)


def _show_slow(found: Inspection, console: Console) -> None:
    """Channels that wrap, and those that drift so that it matters at a line."""
    from livebode.preparation import trend_text, wrap_text

    channels = {channel.name: channel for channel in found.log.channels}
    for name, wrap in found.wraps.items():
        console.print(f"{wrap_text(channels[name], wrap)}: a run unwraps an output or schedule", soft_wrap=True)
    if found.drifting:
        about = trend_text(found.drifting, list(channels.values()))
        console.print(f"{about}: a run subtracts this trend", soft_wrap=True)


def _show_clocks(found: Inspection, console: Console) -> None:
    """Clocks that are not those of the common grid."""
    for clock in found.clocks:
        step = f"longest step {clock.stamps.longest_s * 1e3:.4g} ms"
        console.print(f"at times of their own: {clock.described}, {step}", soft_wrap=True)
    if found.clocks:
        console.print(
            "a run fits spectra to the samples at these times; the excitation is examined in interpolated samples",
            soft_wrap=True,
        )
        console.print(
            "--output-only, friction and orders need even steps: where only the stamps are late, give them "
            f"--rate {found.clocks[0].stamps.rate_hz:.6g} --time none; otherwise resample",
            soft_wrap=True,
        )


def _show_hum(quiet: Quiet, console: Console) -> None:
    from rich.table import Table

    seconds, lines = quiet.samples / quiet.lines.rate_hz, quiet.lines
    where = f"{seconds:.4g} s without excitation, from sample {quiet.first} on"
    if not quiet.found:
        console.print(f"no hum of the mains is visible in {where}", soft_wrap=True)
        return
    console.print(f"hum of the mains in {where}:", soft_wrap=True)
    table = Table(box=None, header_style="bold")
    table.add_column("Hz", justify="right")
    for name, unit in quiet.units.items():
        table.add_column(f"{name} {unit}".strip(), justify="right")
    table.add_column("disturbs the lines Hz")
    for hum, disturbed in quiet.found:
        amplitude = [f"{hum.amplitude[name]:.3g}" if name in hum.amplitude else "" for name in quiet.units]
        table.add_row(f"{hum.frequency_hz:.5g}", *amplitude, ", ".join(f"{f:g}" for f in disturbed) or "none")
    console.print(table)
    lost = sorted({f for _, disturbed in quiet.found for f in disturbed})
    if lost:
        console.print(
            f"a response at {', '.join(f'{f:g}' for f in lost)} Hz would contain the hum, which no average removes; "
            f"choose lines more than half a bin ({lines.resolution_hz / 2:g} Hz) from it",
            soft_wrap=True,
        )


def _show_stretches(found: Inspection, console: Console) -> None:
    """What a run takes of the recording, if that is not all of it."""
    from rich.table import Table

    shown, log = found.stretches, found.log
    if all(stretch.taken for stretch in shown):
        return
    table = Table(box=None, header_style="bold")
    for heading in ("stretch", "samples", "s", "periods", "a run"):
        table.add_column(heading, justify="left" if heading in ("stretch", "a run") else "right")
    for stretch in shown[:_STRETCHES_SHOWN]:
        first, stop = (f"{log.origin_s + sample / log.rate_hz:.6g}" for sample in (stretch.first, stretch.stop))
        periods = "" if stretch.periods is None else " … ".join(map(str, sorted(set(stretch.periods))))
        samples = f"{stretch.first} … {stretch.stop - 1}"
        taken = "uses it" if stretch.taken else "excludes it"
        table.add_row(stretch.kind, samples, f"{first} … {stop}", periods, taken)
    console.print(table)
    if (more := len(shown) - _STRETCHES_SHOWN) > 0:
        console.print(f"({counted(more, 'row')} more; --json has all)", style="dim")


def _show_excitation(found: Inspection, console: Console) -> None:
    from rich.table import Table

    from livebode.estimation import default_hop, quarter_hop
    from livebode.excitation import pattern

    excitation = found.excitation
    assert excitation is not None
    lines, first = excitation.lines, found.log.first
    console.print(
        f"excitation repeats every {excitation.period} samples "
        f"({excitation.period / lines.rate_hz:.6g} s), "
        f"{excitation.periods} periods from sample {first + excitation.start} on; "
        f"crest factor {excitation.crest_factor:.2f}, rms {excitation.rms:.4g}, peak {excitation.peak:.4g}"
    )
    if excitation.transient:
        many = "period differs" if len(excitation.transient) == 1 else f"{len(excitation.transient)} periods differ"
        console.print(f"transient: the first {many} from the steady state")
    if excitation.outlying:
        console.print(f"outlying (spikes, pauses): periods {', '.join(map(str, excitation.outlying))}")
    _show_stretches(found, console)
    if slips := excitation.slips:
        missing = sum(slip.missing for slip in slips)
        console.print(
            f"phase slips: {len(slips)}, first at sample {first + slips[0].sample}; {abs(missing)} samples "
            f"{'missing' if missing >= 0 else 'repeated'} in all without a gap; realigned here, and by a run",
            soft_wrap=True,
        )
    console.print(
        f"{counted(len(lines), 'line')} ({pattern(lines.bins)}), "
        f"{lines.frequency_hz[0]:.6g} … {lines.frequency_hz[-1]:.6g} Hz"
    )
    hops = [f"{lines.rate_hz / hop:.4g} (hop {hop})" for hop in (
        quarter_hop(excitation.period), default_hop(excitation.period), found.live_hop
    )]  # fmt: skip
    console.print(
        f"with this period as window, a run has by default {hops[0]} responses per second, of a machine that moves "
        f"{hops[1]}, a live run {hops[2]}",
        soft_wrap=True,
    )
    table = Table(box=None, header_style="bold")
    for heading in ("line Hz", "amplitude", "SNR at output dB"):
        table.add_column(heading, justify="right")
    step = -(-len(lines) // _LINES_SHOWN)
    for i in range(0, len(lines), step):
        snr = "" if excitation.snr_db is None else f"{excitation.snr_db[i]:.1f}"
        table.add_row(f"{lines.frequency_hz[i]:.6g}", f"{excitation.amplitude[i]:.4g}", snr)
    console.print(table)
    if step > 1:
        console.print(f"(one line in {step} is shown; --json has all)", style="dim")
