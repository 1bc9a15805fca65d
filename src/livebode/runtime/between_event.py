"""The event on several recordings of one run: their distortion, or that they differ."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from livebode.core import Event


def between_events(between: Mapping[str, Any], sample: int, time_s: float) -> list[Event]:
    """None, or one event, at the end of the run; `between` as in run.json."""
    count, noise_db = between["recordings"], between["noise_db"]
    noise = "not known" if noise_db is None else f"{noise_db:.1f} dB"
    details = {name: between[name] for name in ("recordings", "chance", "distortion_db", "noise_db")}
    found = between["differs"] and between["distortion_db"] is not None
    if between["realisations"]:
        distortion = f"{between['distortion_db']:.1f} dB" if found else "not significant"
        message = (
            f"best linear approximation of {count} realisations: stochastic distortion, relative to the output at a "
            f"line, {distortion}; noise of the mean {noise}"
        )
        return [Event("best-linear-approximation", sample, time_s, message, details)]
    if not found:
        return []
    message = (
        f"the {count} recordings differ by more than their noise: by {between['distortion_db']:.1f} dB relative to the "
        f"output at a line; noise of the mean {noise}; the bound of the mean contains the difference"
    )
    return [Event("recordings-differ", sample, time_s, message, details)]
