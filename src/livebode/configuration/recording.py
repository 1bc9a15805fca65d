"""The recording that a configuration names."""

from __future__ import annotations

from typing import Any

from livebode.configuration.axis import Axis
from livebode.core import LivebodeError, RecordingError
from livebode.locations import local_copy
from livebode.sources import Log, open_log
from livebode.sources.uneven import UNEVEN, UnevenLog, open_uneven


def open_recording(axis: Axis) -> Log:
    """Open the one recording in [source] at the clock of the output; LivebodeError if it cannot be read."""
    (path,) = axis.source.logs
    return open_log(path, **_reading(axis), channels=axis.signals.listed("output"))


def open_even_or_uneven(axis: Axis) -> Log | UnevenLog:
    """The same; an UnevenLog if the clock of the output jitters, or if the other channels have other clocks."""
    source, signals = axis.source, axis.signals
    (path,) = source.logs
    named = [signals.excitation, signals.input, signals.output, signals.schedule, *axis.monitoring.covariates]
    if axis.tracking.estimator == "direct":
        named = [signals.input, *named]
    names = list(dict.fromkeys(name for name in named if name))
    with local_copy(path):
        try:
            log = open_recording(axis)
            for name in names:
                _check_clock(log, name)
            return log
        except RecordingError as error:
            if error.code not in UNEVEN or source.time == "none":
                raise
        return open_uneven(path, names, **_reading(axis))


def _reading(axis: Axis) -> dict[str, Any]:
    source = axis.source
    return {
        "rate_hz": source.rate_hz,
        "time": source.time,
        "kinds": source.kinds,
        "clock": source.clock,
        "dbc": source.dbc,
    }


def _check_clock(log: Log, name: str) -> None:
    """RecordingError if the channel has another clock; other errors are left to the reading."""
    try:
        log.naming([name])
    except LivebodeError as error:
        if error.code in UNEVEN:
            raise
