"""Moments of a run in words: seconds of its clock, or date and time of day with the zone."""

from __future__ import annotations

from datetime import datetime
from math import isfinite

_EPOCH_FROM_S, _EPOCH_TO_S = 1e8, 1e11  # 1973 … 5138; a run's own clock does not reach three years


def moment(time_s: float, digits: int = 1) -> str:
    """A moment of a run for a sentence.

    Parameters
    ----------
    time_s
        Seconds of the run's clock: since 1970, or since its start.
    digits
        Of a run's own seconds. The time of day has whole seconds.

    Returns
    -------
    str
        Local date and time with the abbreviation of the zone (the environment's TZ, daylight saving included), or
        seconds.

    >>> moment(12.345), moment(12.345, 2), moment(float("nan"))
    ('12.3 s', '12.35 s', '—')
    """
    if not isfinite(time_s):
        return "—"
    if not _EPOCH_FROM_S < time_s < _EPOCH_TO_S:
        return f"{time_s:.{digits}f} s"
    return f"{datetime.fromtimestamp(time_s).astimezone():%Y-%m-%d %H:%M:%S %Z}"
