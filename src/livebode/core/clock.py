"""Times of a run as text: seconds of its clock, or date and time of day with the zone."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from datetime import datetime
from math import isfinite
from typing import Any

from livebode.language import date, number

_EPOCH_FROM_S, _EPOCH_TO_S = 1e8, 1e11  # years 1973 … 5138; a run's own clock stays below three years


@dataclass
class RunClock:
    """The relation between the seconds of a run and the time of day, as far as it is known.

    Attributes
    ----------
    pieces
        First second of the run for which each piece is valid, ascending, and its seconds since 1970 at second 0.
        One piece, unless the sender paused for an unknown time or its rate is not exact. Empty where nothing is known.

    Examples
    --------
    >>> RunClock([(0.0, 1e9), (50.0, 1e9 + 3600)]).unix_s(60.0) - 1e9
    3660.0
    """

    pieces: list[tuple[float, float]] = field(default_factory=list)

    @classmethod
    def of(cls, summary: dict[str, Any]) -> RunClock:
        """The clock that run.json records."""
        return cls([(float(from_s), float(unix_s)) for from_s, unix_s in summary.get("clock") or ()])

    def unix_s(self, time_s: float) -> float | None:
        """Seconds since 1970; None where nothing is known."""
        if not self.pieces:
            return None
        at = bisect_right(self.pieces, time_s, key=lambda piece: piece[0])
        return time_s + self.pieces[max(0, at - 1)][1]


_CLOCK: ContextVar[RunClock | None] = ContextVar("clock of the run that messages refer to", default=None)


@contextmanager
def moments_by(clock: RunClock) -> Iterator[None]:
    """Within, and in this thread only, `moment` gives the time of day by this clock."""
    before = _CLOCK.set(clock)
    try:
        yield
    finally:
        _CLOCK.reset(before)


def moment(time_s: float, digits: int = 1) -> str:
    """A time of a run as text for a message.

    Parameters
    ----------
    time_s
        Seconds of the run's clock: since 1970, or since its start.
    digits
        Of the seconds of the run's own clock. The time of day has whole seconds.

    Returns
    -------
    str
        Local date and time with the abbreviation of the zone (the environment's TZ, daylight saving included), where
        the time is since 1970 or the run has a clock (`moments_by`); else seconds.

    >>> moment(12.345), moment(12.345, 2), moment(float("nan"))
    ('12.3 s', '12.35 s', '—')
    """
    if not isfinite(time_s):
        return "—"
    clock = _CLOCK.get()
    unix_s: float | None = time_s
    if clock is not None and not _EPOCH_FROM_S < time_s < _EPOCH_TO_S:
        unix_s = clock.unix_s(time_s)
    if unix_s is None or not _EPOCH_FROM_S < unix_s < _EPOCH_TO_S:
        return f"{number(time_s, f'.{digits}f')} s"
    return date(datetime.fromtimestamp(unix_s).astimezone())


def moment_of_start() -> str:
    """When second 0 of the run was, where one clock is valid for all of it; else nothing."""
    clock = _CLOCK.get()
    return moment(0.0) if clock is not None and len(clock.pieces) == 1 else ""
