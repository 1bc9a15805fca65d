"""One response of many."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from livebode.core import InputError, Response, Responses


def at(parts: Iterable[Responses], time_s: float) -> Response:
    """The response nearest to a moment that has a valid line.

    It speaks for its own `time_s`, the centre of its window; nothing is interpolated.

    Parameters
    ----------
    parts
        Responses in order, such as `Run.batches()`; they are read once and not kept.
    time_s
        The moment in the recording's clock.

    Raises
    ------
    InputError
        If the time is not finite, no line of any response is valid, or the nearest response stands farther off than
        half a window: its window then does not hold the moment.
    """
    if not np.isfinite(time_s):
        raise InputError(f"time {time_s} is not a moment; give seconds in the recording's clock")
    nearest: Response | None = None
    for part in parts:
        usable = np.flatnonzero(part.valid.any(axis=1))
        if not usable.size:
            continue
        found = part[int(usable[np.argmin(np.abs(part.time_s[usable] - time_s))])]
        if nearest is None or abs(found.time_s - time_s) < abs(nearest.time_s - time_s):
            nearest = found
    if nearest is None:
        raise InputError("no response has a valid line; the run's events say why")
    reach_s = nearest.lines.window / nearest.lines.rate_hz / 2
    if abs(nearest.time_s - time_s) > reach_s:
        raise InputError(
            f"no valid response stands within half a window ({reach_s:g} s) of {time_s:g} s; the nearest is at "
            f"{nearest.time_s:.9g} s"
        )
    return nearest
