"""From an Axis to the function blocks that excite and follow it on its PLC."""

from __future__ import annotations

from math import inf

import numpy as np
from numpy.typing import NDArray

from livebode.core import ConfigError, Lines, UsageError, counted
from livebode.design import Waveform
from livebode.design.files.facts import as_lines
from livebode.excitation import multisine
from livebode.session.axis import SAME_RATE, Axis
from livebode.sources.live.settings import named_channels
from livebode.structured_text import SMALLEST, Project, check_rate, check_signals

Floats = NDArray[np.float64]
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
        Names the signals, lines and window; its rate and its controllers' are held against the task's.
    limit
        What the excitation never exceeds.
    ring_length
        Samples that the ring keeps.
    rate_hz
        Of the task, if neither the axis nor the design has it.
    amplitude
        Of a flat multisine at the axis's lines, with Schroeder's phases.
    designed
        Instead (see `read_designed`): its period is played as it is, and brought in over its `ramp_s`.

    Raises
    ------
    UsageError, ConfigError, GridError
        If not just one of `amplitude` and `designed` is given, rates or lines contradict each other, the axis names no
        excitation, no exact lines and window, or no rate; or as `read_designed` and `Project.files` do.
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
            "missing", "the rate of the PLC's task is missing", "specify it, or set source.rate_hz", argument="rate_hz"
        )
    first, rate = known[0]
    check_rate(rate)
    for other, rate_hz in known[1:]:
        if abs(rate - rate_hz) > SAME_RATE * rate_hz:
            raise ConfigError(
                "rate-mismatch",
                f"{first} is {rate:g} Hz, but {other} {rate_hz:g} Hz, and the PLC's task has one rate",
                "correct one of them",
                key="source.rate_hz" if other == "source.rate_hz" else "rate_hz",
                rates_hz=[rate, rate_hz],
            )
    return rate


def _lines(axis: Axis, rate_hz: float, whole: Lines | None) -> Lines:
    """The axis's lines; a design must excite them all, and its own stand for "auto"."""
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
            f"leave that out, or {_TAKE}",
            key="lines.frequencies",
            frequency_hz=min(silent) * lines.resolution_hz,
        )
    return lines


def _flat(lines: Lines, amplitude: float | None) -> tuple[Floats, int, str]:
    """A multisine with all lines alike: period, periods of its ramp, and what it is."""
    if amplitude is None or not SMALLEST <= amplitude < inf:
        raise UsageError(
            "out-of-range",
            f"{amplitude=} is not a finite number from {SMALLEST} up",
            "specify the amplitude of each line",
            argument="amplitude",
            value=amplitude,
        )
    frequencies = ", ".join(f"{f:g}" for f in lines.frequency_hz)
    note = f"{counted(len(lines), 'line')} of amplitude {amplitude:g} with Schroeder's phases: {frequencies} Hz"
    return multisine(lines, amplitude), 1, note


def _designed(waveform: Waveform) -> tuple[Floats, int, str]:
    """The same of a design."""
    return waveform.samples, waveform.ramp_periods, "\n".join(as_lines(waveform.about))
