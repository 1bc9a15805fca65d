"""Select one response of many."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from livebode.core import Response, Responses, SignalError, UsageError


def nearest_response(parts: Iterable[Responses], time_s: float) -> Response:
    """The response with a valid line that is nearest to a time.

    Its effective time is its own `time_s`, the centre of its window; nothing is interpolated.

    Parameters
    ----------
    parts
        Responses in order, such as `Run.batches()`; they are read once and not stored.
    time_s
        The time in the recording's clock.

    Raises
    ------
    UsageError
        If the time is not finite.
    SignalError
        If no line of any response is valid, or the nearest response is farther away than half a window: its window
        then does not contain the time.
    """
    if not np.isfinite(time_s):
        raise UsageError(
            "not-finite", f"{time_s=} is not finite", "give seconds in the recording's clock", argument="time_s"
        )
    nearest: Response | None = None
    for part in parts:
        usable = np.flatnonzero(part.valid.any(axis=1))
        if not usable.size:
            continue
        candidate = part[int(usable[np.argmin(np.abs(part.time_s[usable] - time_s))])]
        if nearest is None or abs(candidate.time_s - time_s) < abs(nearest.time_s - time_s):
            nearest = candidate
    if nearest is None:
        raise SignalError("no-valid-response", "no response has a valid line", "see the run's events for the reason")
    reach_s = nearest.lines.window / nearest.lines.rate_hz / 2
    if abs(nearest.time_s - time_s) > reach_s:
        raise SignalError(
            "no-response-there",
            f"no valid response is within half a window ({reach_s:g} s) of {time_s:g} s",
            f"use the nearest, at {nearest.time_s:.9g} s",
            argument="time_s",
            time_s=time_s,
            nearest_s=nearest.time_s,
        )
    return nearest
