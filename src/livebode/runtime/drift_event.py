"""The event on a machine that drifts within a recording."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from livebode.core import Event
from livebode.language import Message


def drift_events(drift: Mapping[str, Any], sample: int, time_s: float) -> list[Event]:
    """None, or one event, at the end of the recording; `drift` as in run.json."""
    if not drift["found"]:
        return []
    most = max(drift["lines"], key=lambda line: line["percent"])
    message = Message(
        "the response drifts during the recording, most at {line_hz:g} Hz: by {percent:.2g} % ± "
        "{bound_percent:.1g} % from the beginning to the end; the bound of a mean contains the drift",
        line_hz=most["frequency_hz"],
        percent=most["percent"],
        bound_percent=1.96 * most["percent_sigma"],
    )
    return [Event("drift", sample, time_s, message, {"lines": drift["lines"]})]
