"""The recording that a configuration names."""

from __future__ import annotations

from livebode.configuration.axis import Axis
from livebode.sources import Log, open_log


def open_recording(axis: Axis) -> Log:
    """Open the one recording in [source] at the clock of the output; LivebodeError if it cannot be read."""
    source = axis.source
    (path,) = source.logs
    return open_log(
        path,
        rate_hz=source.rate_hz,
        time=source.time,
        kinds=source.kinds,
        clock=source.clock,
        dbc=source.dbc,
        channels=[axis.signals.output],
    )
