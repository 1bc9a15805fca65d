"""`livebode inspect`: what a recording holds."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

from livebode.cli import terminal
from livebode.cli.options import Excitation, Json, Output, Rate, Time
from livebode.estimation.settings import default_hop
from livebode.nouns import InputError
from livebode.records import to_json

if TYPE_CHECKING:
    from livebode.session.inspection import Inspection

_LINES_SHOWN = 24


def inspect_command(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A recording.")],
    excitation: Excitation = None,
    output: Output = None,
    rate: Rate = None,
    time: Time = None,
    as_json: Json = False,
) -> None:
    """List channels, rate, gaps and samples that are not finite; for an excitation its period, lines and SNR."""
    from livebode.session.inspection import inspect  # with its statistics half a second to import

    if output is not None and excitation is None:
        raise InputError("--output is for the signal-to-noise ratio of an excitation; name it with --excitation too")
    found = inspect(log, rate_hz=rate, time=time, excitation=excitation, output=output)
    if as_json:
        print(to_json(found.plain()))
        return
    console = terminal.console(markup=False)  # names and units may hold brackets
    _show_recording(found, console)
    if found.excitation is not None:
        _show_excitation(found, console)


def _show_recording(found: Inspection, console: Console) -> None:
    log = found.log
    console.print(
        f"{log.path}: {log.format}, {found.samples} samples at {log.rate_hz:.9g} Hz ({log.rate_origin})", soft_wrap=True
    )
    gaps = f"{found.gaps} gap{'s' * (found.gaps > 1)} ({found.missing} samples missing)" if found.gaps else "no gaps"
    jitter = ""
    if log.timing is not None:
        jitter = f", period {log.timing.period_s_mean * 1e6:.6g} µs ± {log.timing.period_s_std * 1e6:.3g} µs"
    console.print(f"{found.samples / log.rate_hz:.6g} s{jitter}, {gaps}")
    table = Table(box=None, header_style="bold")
    for heading in ("channel", "unit", "from", "to", "not finite"):
        table.add_column(heading, justify="left" if heading in ("channel", "unit") else "right")
    for channel in found.channels:
        extent = [f"{x:.6g}" for x in (channel.minimum, channel.maximum)]
        if channel.minimum > channel.maximum:
            extent = ["empty", ""]
        elif channel.minimum == channel.maximum:
            extent[1] = "constant"
        table.add_row(channel.name, channel.unit, *extent, str(channel.not_finite or ""))
    console.print(table)
    for skipped in log.skipped:
        console.print(f"  no channel: {skipped.name} ({skipped.reason})", style="dim")


def _show_excitation(found: Inspection, console: Console) -> None:
    excitation = found.excitation
    assert excitation is not None
    lines = excitation.lines
    console.print(
        f"excitation repeats every {excitation.period} samples "
        f"({excitation.period / lines.rate_hz:.6g} s), {excitation.periods} periods from sample {excitation.start} on; "
        f"crest factor {excitation.crest_factor:.2f}, "
        f"rms {excitation.rms:.4g}, peak {excitation.peak:.4g}"
    )
    if excitation.transient:
        first = "period differs" if len(excitation.transient) == 1 else f"{len(excitation.transient)} periods differ"
        console.print(f"transient: the first {first} from the steady state")
    if excitation.outlying:
        console.print(f"outlying (spikes, pauses): periods {', '.join(map(str, excitation.outlying))}")
    if slips := excitation.slips:
        missing = sum(slip.missing for slip in slips)
        console.print(
            f"phase slips: {len(slips)}, first at sample {slips[0].sample}; {abs(missing)} samples "
            f"{'missing' if missing >= 0 else 'repeated'} in all without a gap; realigned here, and by a run",
            soft_wrap=True,
        )
    console.print(f"{len(lines)} lines, {lines.frequency_hz[0]:.6g} … {lines.frequency_hz[-1]:.6g} Hz")
    hops = ((default_hop(excitation.period), "a run"), (found.live_hop, "live"))
    each = "; ".join(f"{who} {lines.rate_hz / hop:.4g} (hop {hop})" for hop, who in hops)
    console.print(f"responses/s by default, with this period as window: {each}", soft_wrap=True)
    table = Table(box=None, header_style="bold")
    for heading in ("line Hz", "amplitude", "SNR at output dB"):
        table.add_column(heading, justify="right")
    step = -(-len(lines) // _LINES_SHOWN)
    for i in range(0, len(lines), step):
        snr = "" if excitation.snr_db is None else f"{excitation.snr_db[i]:.1f}"
        table.add_row(f"{lines.frequency_hz[i]:.6g}", f"{excitation.amplitude[i]:.4g}", snr)
    console.print(table)
    if step > 1:
        console.print(f"(every {step}th line is shown; --json has all)", style="dim")
