"""Times of a run as text: seconds of its clock, or date and time of day with the zone."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import field
from datetime import UTC, datetime
from math import isfinite, nan
from typing import Any, Literal

from livebode.dataclass import dataclass
from livebode.language import Moment, date

ClockKind = Literal["utc", "relative"]
"""Whether times are seconds since 1970 in UTC, or seconds since any other moment."""
_SINCE_1970_S = 1e8  # 1973, and three years: no recording since 1970 begins before, and no machine runs that long
_DATES_TO_S = 1e11  # year 5138: `datetime` ends in 9999


def clock_kind_of(time_s: float) -> ClockKind:
    """The kind of a clock that nobody stated, from one of its times: the only place that guesses.

    >>> clock_kind_of(86400.0), clock_kind_of(1_700_000_000.0), clock_kind_of(float("nan"))
    ('relative', 'utc', 'relative')
    """
    return "utc" if _SINCE_1970_S < time_s < _DATES_TO_S else "relative"


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
    def of(cls, summary: dict[str, Any], time_s: float = nan) -> RunClock:
        """The clock that run.json records; where an older version did not record its kind, `time_s` of the run counts.

        >>> RunClock.of({"found": {"clock": "utc"}}).unix_s(1e9), RunClock.of({}, 12.0).unix_s(12.0)
        (1000000000.0, None)
        """
        if pieces := summary.get("clock"):
            return cls([(float(from_s), float(unix_s)) for from_s, unix_s in pieces])
        return cls.of_kind(summary.get("found", {}).get("clock") or clock_kind_of(time_s))

    @classmethod
    def of_kind(cls, kind: ClockKind) -> RunClock:
        """The clock of a recording: its times are since 1970, or their relation to the time of day is not known."""
        return cls([(0.0, 0.0)] if kind == "utc" else [])

    @property
    def utc(self) -> bool:
        """Whether the times of the run are seconds since 1970."""
        return self.pieces == [(0.0, 0.0)]

    def unix_s(self, time_s: float) -> float | None:
        """Seconds since 1970; None where nothing is known."""
        if not self.pieces:
            return None
        index = bisect_right(self.pieces, time_s, key=lambda piece: piece[0])
        return time_s + self.pieces[max(0, index - 1)][1]


_CLOCK: ContextVar[RunClock | None] = ContextVar("clock of the run that messages refer to", default=None)


@contextmanager
def moments_by(clock: RunClock) -> Iterator[None]:
    """Within, and in this thread only, `moment` gives the time of day by this clock."""
    before = _CLOCK.set(clock)
    try:
        yield
    finally:
        _CLOCK.reset(before)


def moment(time_s: float, digits: int = 1) -> Moment:
    """A time of a run as text for a message.

    Parameters
    ----------
    time_s
        Seconds of the run's clock.
    digits
        Of the seconds of the run's own clock. The time of day has whole seconds.

    Returns
    -------
    Moment
        As `date_and_time` where the run has a clock (`moments_by`); else seconds.

    >>> moment(12.345), moment(12.345, 2), moment(float("nan"))
    ('12.3 s', '12.35 s', '—')
    """
    clock = _CLOCK.get()
    unix_s = None if clock is None or not isfinite(time_s) else clock.unix_s(time_s)
    return Moment(float(time_s), unix_s if unix_s is not None and 0 <= unix_s < _DATES_TO_S else None, digits)


def date_and_time(unix_s: float) -> str:
    """Local date and time of seconds since 1970, with the abbreviation of the zone.

    The zone is that of the environment's TZ, daylight saving included.
    """
    return date(datetime.fromtimestamp(unix_s).astimezone())


def iso_utc(unix_s: float) -> str | None:
    """Seconds since 1970 as ISO 8601 in UTC, with milliseconds; None outside of the years 1970 to 5138.

    >>> iso_utc(1_700_000_000.25), iso_utc(-1.0)
    ('2023-11-14T22:13:20.250Z', None)
    """
    if not 0 <= unix_s < _DATES_TO_S:
        return None
    return datetime.fromtimestamp(unix_s, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def moment_of_start() -> str:
    """When second 0 of the run was, where one clock is valid for all of it, and the run began then; else nothing."""
    clock = _CLOCK.get()
    return moment(0.0) if clock is not None and len(clock.pieces) == 1 and not clock.utc else ""
