"""Function blocks for the PLC of an axis: excitation and tracking."""

from __future__ import annotations

import json
from math import inf

from livebode import multisine
from livebode.arrays import Floats
from livebode.configuration import Axis
from livebode.core import ConfigError, Lines, UsageError, counted
from livebode.excitation import Waveform
from livebode.sources.live import named_channels
from livebode.structured_text import SMALLEST, check_rate
from livebode_drives.source_settings import DriveKeys
from livebode_drives.structured_text.project import Project, check_signals

_SAME_RATE = 1e-6
_TAKE = "use the axis.toml that `livebode design` wrote with it"


def plc_project(
    axis: Axis,
    *,
    limit: float,
    ring_length: int,
    rate_hz: float | None = None,
    amplitude: float | None = None,
    designed: Waveform | None = None,
) -> Project:
    """The project of an axis: its excitation, its signals tracked, its channels in the ring.

    Parameters
    ----------
    axis
        Signals, lines and window; its rate and its controllers' rates are compared with that of the task.
    limit
        Largest magnitude of the excitation.
    ring_length
        Number of samples in the ring.
    rate_hz
        Rate of the task, if neither the axis nor the design has it.
    amplitude
        Amplitude of each line of a flat multisine with Schroeder's phases.
    designed
        Instead of `amplitude` (see `read_designed`): its period is used unchanged, and ramped up over its `ramp_s`.

    Raises
    ------
    UsageError, ConfigError, GridError
        If both or neither of `amplitude` and `designed` are given, rates or lines contradict each other, the axis has
        no excitation, no exact lines and window, or no rate; also those of `read_designed` and `Project.files`.
    """
    if (amplitude is None) == (designed is None):
        raise UsageError(
            "conflict",
            "the excitation is specified by both or neither of amplitude and designed",
            "specify either the amplitude of each line, or a file of `livebode design`",
            argument="amplitude",
        )
    whole = None if designed is None else designed.lines
    rate = _rate_hz(
        {
            "the argument rate_hz": rate_hz,
            "the designed excitation": None if whole is None else whole.rate_hz,
            "source.rate_hz": axis.source.rate_hz,
        }
    )
    signals, excitation = axis.signals, axis.signals.excitation
    if excitation is None:
        raise ConfigError(
            "key-missing",
            "signals.excitation is missing",
            "name the channel that the PLC adds to the torque reference",
            key="signals.excitation",
        )
    axis.loop.build(rate)
    lines = _lines(axis, rate, whole)
    tracked = [name for name in (excitation, signals.input, signals.output) if name is not None]
    assert isinstance(axis.source, DriveKeys)
    named = [channel.name for channel in named_channels(axis.source.channels)]
    recorded = [*tracked, *([] if signals.schedule is None else [signals.schedule])]
    check_signals(recorded)
    period, periods, note = _flat(lines, amplitude) if designed is None else _designed(designed)
    return Project(
        period=period,
        limit=limit,
        lines=lines,
        channels=named or list(dict.fromkeys(recorded)),
        excitation=excitation,
        tracked=list(dict.fromkeys(tracked)),
        ring_length=ring_length,
        ramp_periods=periods,
        note=note,
    )


def _rate_hz(specified: dict[str, float | None]) -> float:
    """The rate of the task, on which all that specify it agree."""
    known = [(who, rate_hz) for who, rate_hz in specified.items() if rate_hz is not None]
    if not known:
        raise UsageError(
            "missing", "the rate of the PLC task is missing", "give rate_hz, or set source.rate_hz", argument="rate_hz"
        )
    first, rate = known[0]
    check_rate(rate)
    for other, rate_hz in known[1:]:
        if abs(rate - rate_hz) > _SAME_RATE * rate_hz:
            raise ConfigError(
                "rate-mismatch",
                f"{first} is {rate:g} Hz, but {other} is {rate_hz:g} Hz; the PLC task has only one rate",
                "correct one of them",
                key="source.rate_hz" if other == "source.rate_hz" else "rate_hz",
                rates_hz=[rate, rate_hz],
            )
    return rate


def _lines(axis: Axis, rate_hz: float, whole: Lines | None) -> Lines:
    """The axis's lines; a design must excite all of them; "auto" means those of the design."""
    frequencies, window = axis.lines.frequencies, axis.lines.window
    if whole is not None:
        if window not in ("auto", whole.window):
            raise ConfigError(
                "value-mismatch",
                f"lines.window is {window}, but the design's period has {whole.window} samples",
                _TAKE,
                key="lines.window",
                value=window,
                allowed=whole.window,
            )
        window = whole.window
        if frequencies == "auto":
            return whole
    if frequencies == "auto" or window == "auto":
        raise ConfigError(
            "auto-needs-recording",
            "lines or window are 'auto'",
            "set lines.frequencies and lines.window, which the PLC excites",
            key="lines",
        )
    lines = Lines.parse(frequencies, rate_hz, window)
    if whole is not None and (silent := set(lines.bins) - set(whole.bins)):
        raise ConfigError(
            "value-mismatch",
            f"the design does not excite {min(silent) * lines.resolution_hz:g} Hz",
            f"remove that line, or {_TAKE}",
            key="lines.frequencies",
            frequency_hz=min(silent) * lines.resolution_hz,
        )
    return lines


def _flat(lines: Lines, amplitude: float | None) -> tuple[Floats, int, str]:
    """A multisine with equal lines: period, periods of its ramp, and description."""
    if amplitude is None or not SMALLEST <= amplitude < inf:
        raise UsageError(
            "out-of-range",
            f"{amplitude=} is not a finite number of at least {SMALLEST}",
            "specify the amplitude of each line",
            argument="amplitude",
            value=amplitude,
        )
    frequencies = ", ".join(f"{f:g}" for f in lines.frequency_hz)
    note = f"{counted(len(lines), 'line')} of amplitude {amplitude:g} with Schroeder's phases: {frequencies} Hz"
    return multisine(lines, amplitude), 1, note


def _designed(waveform: Waveform) -> tuple[Floats, int, str]:
    """The period of a designed excitation, the periods of its ramp, and its description."""
    note = "\n".join(f"{key}: {json.dumps(value)}" for key, value in waveform.about.items())
    return waveform.samples, waveform.ramp_periods, note
