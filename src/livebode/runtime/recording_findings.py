"""Findings on whole recordings: a drift within one, and the scatter between several, in run.json and as an event."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from livebode.core import Event, Lines
from livebode.language import Message

if TYPE_CHECKING:
    from livebode.fitting import Drift, RecordingsMean


def of_drift(drift: Drift, lines: Lines) -> dict[str, Any]:
    """Entries on a drift of the machine within the recording: at the lines where it is significant, or the clearest."""
    if not drift.significant:
        return {"found": False, "lines": []}
    shown = drift.lines.copy()
    if not shown.any():
        shown[np.nanargmax(np.abs(drift.change) / drift.sigma)] = True
    size = np.abs(drift.value)
    rows = [
        {
            "frequency_hz": float(lines.frequency_hz[i]),
            "percent": 100 * float(abs(drift.change[i]) / size[i]),
            "percent_sigma": 100 * float(drift.sigma[i] / size[i]),
        }
        for i in np.flatnonzero(shown)
    ]
    return {"found": True, "lines": rows}


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


def of_recordings(mean: RecordingsMean) -> dict[str, Any]:
    """Entries on the scatter between several recordings; at lines where something is not known it is null."""
    found = mean.result()[1]
    of_line = {"noise_sigma": found.noise, "total_sigma": found.total, "distortion": found.distortion}
    of_all = {"chance": found.chance, "distortion_db": found.distortion_db, "noise_db": found.noise_db}
    return {
        "recordings": found.recordings,
        "realisations": mean.realisations,
        "differs": found.differs,
        **{name: value if np.isfinite(value) else None for name, value in of_all.items()},
        **{name: [v if np.isfinite(v) else None for v in values.tolist()] for name, values in of_line.items()},
    }


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
