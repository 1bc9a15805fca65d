"""livebode: the Responses of a way to track a recording, as Estimates."""

from __future__ import annotations

from collections.abc import Callable

from livebode import Lines, Responses, Settings, Tracker
from studies.peers.estimates import Estimates
from studies.peers.recording import HOP, LINES, Recording

CENTRE = (LINES.window - 1) / 2


def track(recording: Recording, *, hann: bool = False, window: int = LINES.window) -> Responses:
    """The tracker as it is: sliding DFT, joint."""
    lines = Lines(tuple(k * window // LINES.window for k in LINES.bins), window, LINES.rate_hz)
    settings = Settings(lines=lines, output="velocity", input="u", excitation="w", hop=HOP, hann=hann)
    return Tracker(settings).process(recording.block)


def by(responses: Callable[[Recording], Responses], delay: float = CENTRE) -> Callable[[Recording], Estimates]:
    """The entry of the table for any function that returns livebode's Responses for a recording."""

    def estimate(recording: Recording) -> Estimates:
        found = responses(recording)
        return Estimates(found.sample, delay, found.value)

    return estimate
