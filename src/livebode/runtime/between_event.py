"""The event on several recordings of one run: their distortion, or that they differ."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from livebode.core import Event
from livebode.language import Message


def between_events(between: Mapping[str, Any], sample: int, time_s: float) -> list[Event]:
    """None, or one event, at the end of the run; `between` as in run.json."""
    count, noise_db = between["recordings"], between["noise_db"]
    noise = Message("not known") if noise_db is None else Message("{level_db:.1f} dB", level_db=noise_db)
    details = {name: between[name] for name in ("recordings", "chance", "distortion_db", "noise_db")}
    found = between["differs"] and between["distortion_db"] is not None
    if between["realisations"]:
        level = Message("not significant")
        if found:
            level = Message("{level_db:.1f} dB", level_db=between["distortion_db"])
        message = Message(
            "best linear approximation of {realisations} realisations: stochastic distortion, relative to the output "
            "at a line, {level}; noise of the mean {noise}",
            realisations=count,
            level=level,
            noise=noise,
        )
        return [Event("best-linear-approximation", sample, time_s, message, details)]
    if not found:
        return []
    message = Message(
        "the {recordings} recordings differ by more than their noise: by {distortion_db:.1f} dB relative to the "
        "output at a line; noise of the mean {noise}; the bound of the mean contains the difference",
        recordings=count,
        distortion_db=between["distortion_db"],
        noise=noise,
    )
    return [Event("recordings-differ", sample, time_s, message, details)]
