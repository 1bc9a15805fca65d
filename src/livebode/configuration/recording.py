"""The recording that a configuration names."""

from __future__ import annotations

from typing import Any

from livebode import sources
from livebode.configuration.axis import Axis
from livebode.core import RecordingError
from livebode.locations import local_copy
from livebode.sources import UNEVEN, Log, open_log

_NAMES = {
    "signals": ("outputs", "inputs", "excitations", "schedule", "ready"),
    "tracking": ("differenced", "spikes"),
    "monitoring": ("covariates",),
    "output_only": ("others",),
}


def open_recording(axis: Axis) -> Log:
    """Open the one recording in [source] at the clock of the output; LivebodeError if it cannot be read."""
    (path,) = axis.source.logs
    return open_log(path, **_reading(axis), channels=axis.signals.listed("output"))


def open_even_or_uneven(axis: Axis) -> Log:
    """The same; a Log that is not `even` if the clock of the output jitters, or other channels have other clocks."""
    signals, reading = axis.signals, _reading(axis)
    (path,) = axis.source.logs
    named = [signals.excitation, signals.input, signals.output, signals.schedule, *axis.monitoring.covariates]
    if axis.tracking.estimator == "direct":
        named = [signals.input, *named]
    names = list(dict.fromkeys(name for name in named if name))
    with local_copy(path):
        try:
            log = open_log(path, channels=signals.listed("output"), **reading)
            log.check_clocks(names)
            return log
        except RecordingError as error:
            if error.code not in UNEVEN or reading["time"] == "none":
                raise
        return sources.open_uneven(path, names, **reading)


def with_shared_names(axis: Axis, log: Log) -> Axis:
    """The axis whose channels are named without the name of the file, so that runs on other files have the same."""

    def shared(names: Any) -> Any:
        if isinstance(names, str):
            return log.shared_name(names)
        return names if names is None else type(names)(map(shared, names))

    changed = {}
    for section, keys in _NAMES.items():
        if (one := getattr(axis, section)) is not None:
            changed[section] = one.model_copy(update={key: shared(getattr(one, key)) for key in keys})
    return axis.model_copy(update=changed)


def _reading(axis: Axis) -> dict[str, Any]:
    source = axis.source
    return {
        "rate_hz": source.rate_hz,
        "time": source.time,
        "kinds": source.kinds,
        "clock": source.clock,
        "dbc": source.dbc,
    }
