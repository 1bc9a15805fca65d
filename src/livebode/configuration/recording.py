"""The recordings that a configuration names."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from livebode.configuration.axis import Axis
from livebode.estimates import RESPONSE
from livebode.locations import Location
from livebode.sources import DeclaredQuantities, Log, even_or_uneven_log, located, log_of, open_file

_NAMES = {
    "signals": ("outputs", "inputs", "excitations", "schedule", "ready"),
    "tracking": ("differenced", "spikes"),
    "monitoring": ("covariates",),
    "output_only": ("others",),
}


def open_recording(axis: Axis) -> Log:
    """Open the one recording in [source] at the clock of the output; LivebodeError if it cannot be read."""
    (path,) = axis.source.logs
    return log_of(open_file(path, axis.source.dbc), **_reading(axis), channels=axis.signals.listed("output"))


def open_recordings(axis: Axis) -> tuple[Axis, list[Log]]:
    """Open the recordings in [source], none of a live source; only the single one of a single response may be uneven.

    Returned with the axis whose channels are named without the name of the file, so that runs on other files have the
    same. LivebodeError if one cannot be read.
    """
    in_use, reading = _in_use(axis) if axis.kind == RESPONSE else [], _reading(axis)
    places = () if axis.source.live else axis.source.logs
    logs: list[Log] = []
    for place in places:
        with located(place):
            recording, outputs = open_file(place, axis.source.dbc), axis.signals.listed("output")
            if in_use and len(places) == 1:
                logs.append(even_or_uneven_log(recording, outputs, in_use, **reading))
            else:
                logs.append(log_of(recording, channels=outputs, **reading))
        if len(logs) == 1:
            sections = {name: section for name in _NAMES if (section := getattr(axis, name)) is not None}
            shared = {name: _renamed(one, _NAMES[name], logs[0].shared_name) for name, one in sections.items()}
            axis = axis.model_copy(update=shared)
    return axis, logs


def _in_use(axis: Axis) -> list[str]:
    """The channels of a single response, that of the reference first."""
    signals = axis.signals
    named = [signals.excitation, signals.input, signals.output, signals.schedule, *axis.monitoring.covariates]
    if axis.tracking.estimator == "direct":
        named = [signals.input, *named]
    return list(dict.fromkeys(name for name in named if name))


def with_log(axis: Axis, place: Location) -> Axis:
    """The axis with one of its recordings."""
    return axis.model_copy(update={"source": axis.source.model_copy(update={"log": place})})


def _renamed(section: Any, keys: tuple[str, ...], shared: Callable[[str], str]) -> Any:
    """The section with other names of its channels."""

    def of(names: Any) -> Any:
        if isinstance(names, str):
            return shared(names)
        return names if names is None else type(names)(map(of, names))

    return section.model_copy(update={key: of(getattr(section, key)) for key in keys})


def _reading(axis: Axis) -> dict[str, Any]:
    source = axis.source
    quantities = DeclaredQuantities(source.kinds, source.units)
    return {"rate_hz": source.rate_hz, "time": source.time, "quantities": quantities, "clock": source.clock}
