"""What run.json and the events have on a change of the machine within a recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from livebode.core import INTERVAL_FACTOR, Event, decibels
from livebode.fitting import Component, Drift
from livebode.language import Message


def of_drift(drift: Drift, places: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Entries on a change: its form, and its size at the lines where it is significant, or at the clearest.

    `places` has of each value of the test its line as `frequency_hz`, and in a matrix its `output` and `input`.
    """
    if not drift.significant:
        return {"found": False, "lines": []}
    shown = drift.lines.copy()
    if not shown.any():
        shown[np.nanargmax(np.abs(drift.change) / drift.sigma)] = True
    components = [_of_component(component, drift) for component in drift.components]
    rows = [dict(places[i]) | _of_line(drift, i) for i in np.flatnonzero(shown).tolist()]
    return {"found": True, "components": components, "lines": rows}


def _of_component(component: Component, drift: Drift) -> dict[str, Any]:
    long_s = component.place * drift.length_s
    if component.kind == "settling":
        return {"kind": component.kind, "time_constant_s": long_s}
    if component.kind == "step":
        return {"kind": component.kind, "since_s": drift.begin_s + long_s}
    if component.kind == "periodic":
        return {"kind": component.kind, "period_s": long_s, "frequency_hz": 1 / long_s}
    return {"kind": component.kind, "degree": int(component.place)}


def _of_line(drift: Drift, i: int) -> dict[str, Any]:
    size = abs(drift.value[i])
    row: dict[str, Any] = {
        "percent": 100 * float(abs(drift.change[i]) / size),
        "percent_sigma": 100 * float(drift.sigma[i] / size),
        "rms_percent": 100 * float(drift.rms[i] / size),
    }
    moments = {
        "mean": (drift.value[i], drift.mean_sigma[i]),
        "begin": (drift.begin[i], drift.begin_sigma[i]),
        "end": (drift.end[i], drift.end_sigma[i]),
    }
    for name, (value, sigma) in moments.items():
        row |= {name: [float(value.real), float(value.imag)], f"{name}_sigma": float(sigma)}
    return row


def drift_events(drift: Mapping[str, Any], sample: int, time_s: float) -> list[Event]:
    """None, or one event, at the end of the recording; `drift` as in run.json."""
    if not drift["found"]:
        return []
    most = max(drift["lines"], key=lambda line: line["percent"])
    message = Message(
        "{change}; the average is that over the recording, {begin_db:.2f} dB at its beginning, {mean_db:.2f} dB in the "
        "mean and {end_db:.2f} dB at its end, and its bound contains the change; for the machine at one time, run a "
        "part of the recording (--from, --to)",
        change=_change(drift["components"][0], most),
        begin_db=_decibels(most["begin"]),
        mean_db=_decibels(most["mean"]),
        end_db=_decibels(most["end"]),
    )
    if "output" in most:
        message = Message("{entry}: {change}", entry=f"{most['output']}/{most['input']}", change=message)
    details = {"components": drift["components"], "lines": drift["lines"]}
    return [Event("drift", sample, time_s, message, details)]


def _change(component: Mapping[str, Any], most: Mapping[str, Any]) -> Message:
    """What changes, from when on, most at which line, and by how much."""
    size = {
        "line_hz": most["frequency_hz"],
        "percent": most["percent"],
        "bound_percent": INTERVAL_FACTOR * most["percent_sigma"],
    }
    if component["kind"] == "step":
        return Message(
            "the response drifts during the recording, most at {line_hz:g} Hz: by {percent:.2g} % ± "
            "{bound_percent:.2g} %, with a step at {since_s:.4g} s",
            **size,
            since_s=component["since_s"],
        )
    if component["kind"] == "periodic":
        return Message(
            "the response drifts during the recording, most at {line_hz:g} Hz: periodically with {change_hz:.4g} Hz "
            "(every {period_s:.3g} s), by {percent:.2g} % ± {bound_percent:.2g} % from peak to peak",
            **size,
            change_hz=component["frequency_hz"],
            period_s=component["period_s"],
        )
    if component["kind"] == "settling":
        return Message(
            "the response drifts during the recording, most at {line_hz:g} Hz: by {percent:.2g} % ± "
            "{bound_percent:.2g} % from the beginning on, settling with a time constant of {settling_s:.3g} s",
            **size,
            settling_s=component["time_constant_s"],
        )
    return Message(
        "the response drifts during the recording, most at {line_hz:g} Hz: by {percent:.2g} % ± "
        "{bound_percent:.2g} % from the beginning to the end",
        **size,
    )


def _decibels(value: list[float]) -> float:
    return float(decibels(np.array(complex(*value))))
