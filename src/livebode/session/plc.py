"""From an Axis to the function blocks that excite and follow it on its PLC."""

from __future__ import annotations

from livebode.excitation import multisine
from livebode.nouns import InputError, Lines
from livebode.session.axis import Axis
from livebode.sources.live.settings import named_channels
from livebode.structured_text import Project, check_signals


def plc_project(axis: Axis, rate_hz: float | None, amplitude: float, limit: float, ring_length: int) -> Project:
    """The project of an axis: a flat multisine at its lines, its signals tracked, its channels in the ring.

    Raises
    ------
    InputError
        If the axis names no excitation, no exact lines and window, or no rate; or as `Project.files` does.
    """
    rate = rate_hz or axis.source.rate_hz
    if rate is None:
        raise InputError("the rate of the PLC's task is not said; give --rate HZ, or source.rate_hz")
    signals, excitation = axis.signals, axis.signals.excitation
    if excitation is None:
        raise InputError("signals.excitation is missing; name the channel that the PLC adds to the torque reference")
    frequencies, window = axis.lines.frequencies, axis.lines.window
    if frequencies == "auto" or window == "auto":
        raise InputError("lines or window are 'auto'; give lines.frequencies and lines.window, which the PLC excites")
    lines = Lines.parse(frequencies, rate, window)
    tracked = [name for name in (excitation, signals.input, signals.output) if name is not None]
    named = [channel.name for channel in named_channels(axis.source.channels)]
    recorded = [*tracked, *([] if signals.schedule is None else [signals.schedule])]
    check_signals(recorded)
    return Project(
        period=multisine(lines, amplitude),
        limit=limit,
        lines=lines,
        channels=named or list(dict.fromkeys(recorded)),
        excitation=excitation,
        tracked=list(dict.fromkeys(tracked)),
        ring_length=ring_length,
        note=f"{len(lines)} lines of amplitude {amplitude:g} with Schroeder's phases: "
        f"{', '.join(f'{f:g}' for f in lines.frequency_hz)} Hz",
    )
