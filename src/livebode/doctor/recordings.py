"""Whether a recording can be read, and whether its channels carry signals."""

from __future__ import annotations

import os
from pathlib import Path

from livebode.configuration import Axis, open_even_or_uneven, open_recording
from livebode.core import LivebodeError
from livebode.doctor.check import Check
from livebode.locations import Location
from livebode.preparation import ChannelSummary, contents_of


def check_recording(name: str, axis: Axis, path: Location) -> Check:
    """A recording that does not grow is read to its end."""
    facts = {"path": str(path)}
    if isinstance(path, Path):
        if not path.exists():
            return Check(name, "failed", f"there is no recording {path}", "check source.log", facts)
        if not os.access(path, os.R_OK):
            return Check(name, "failed", f"{path} cannot be read", "check its permissions", facts)
    if axis.source.follow:
        return Check(name, "ok", f"{path} can be read", facts=facts)
    own = axis.model_copy(update={"source": axis.source.model_copy(update={"log": path})})
    signals = axis.signals
    roles = [name for role in ("excitation", "input", "output") for name in signals.listed(role)]
    names = [*roles, signals.schedule, *axis.monitoring.covariates]
    opened = open_recording if signals.is_matrix else open_even_or_uneven  # matrices need one clock
    try:
        channels = contents_of(opened(own), list(dict.fromkeys(filter(None, names)))).channels
    except LivebodeError as error:
        return Check.of_error(name, error)
    silent = [_silence(channel) for channel in channels if not channel.minimum < channel.maximum]
    if silent:
        remedy = "check the wiring and the trace of the drive, or name another channel under [signals]"
        return Check(name, "warning", f"{path} can be read, but {' and '.join(silent)}", remedy, facts)
    return Check(name, "ok", f"{path} can be read", facts=facts)


def _silence(channel: ChannelSummary) -> str:
    if channel.minimum > channel.maximum:
        return f"channel {channel.name!r} is empty: none of its samples is a finite number"
    return f"channel {channel.name!r} is constant at {channel.minimum:g}"
