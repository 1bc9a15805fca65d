"""The part of a recording that a person chose, in seconds, samples or periods of the excitation."""

from __future__ import annotations

from collections.abc import Callable

from livebode.configuration import Axis
from livebode.core import UsageError
from livebode.preparation.plan import beginning, make_lines, reference_of
from livebode.preparation.wraps import unwrapped
from livebode.sources import Log, PartLimit, part_limit

FindPeriods = Callable[[Log], tuple[int, int]]
"""Number of the sample at which the excitation of a recording begins, and its period in samples."""


def configured_part(axis: Axis, log: Log) -> Log:
    """The part in [source], unwrapped; the recording itself without these keys."""
    log = unwrapped(axis, log)

    def periods_in(part: Log) -> tuple[int, int]:
        from livebode.excitation import checked, clipped, extent, filled

        window, name = make_lines(axis, part).window, reference_of(axis)
        if name is None:
            return part.first, window
        start, _ = extent(clipped(filled(checked(beginning(part, name), repr(name)))), window)
        return part.first + start, window

    source = axis.source
    return chosen_part(log, source.from_, source.to, source.skip_periods, periods_in)


def motion_part(begin: str | None, end: str | None) -> Callable[[Axis | None, Log], Log]:
    """Chooses the part from `begin` to `end` of strokes, which have no periods; without limits that of [source]."""

    def no_periods(_: Log) -> tuple[int, int]:
        raise UsageError(
            "conflict",
            "strokes have no periods of an excitation",
            "give the part in seconds or samples",
            argument="from" if begin else "to",
        )

    def chosen(axis: Axis | None, log: Log) -> Log:
        if begin or end:
            return chosen_part(log, begin, end, 0, no_periods)
        return log if axis is None else configured_part(axis, log)

    return chosen


def chosen_part(
    log: Log, begin: float | str | None, end: float | str | None, skip_periods: int, periods_in: FindPeriods
) -> Log:
    """The part of a recording from `begin` to `end`; the recording itself if none is chosen.

    Limits in periods count from the beginning of the excitation behind a `begin` in seconds or samples.

    Raises
    ------
    UsageError
        If no sample would remain, or the number of skipped periods is negative.
    """
    if skip_periods < 0:
        raise UsageError(
            "out-of-range", f"{skip_periods=} is less than 0", "choose 0 or more", argument="skip_periods",
            value=skip_periods,
        )  # fmt: skip
    limits = [None if given is None else part_limit(given) for given in (begin, end)]
    first, stop = (_fixed(limit, log) for limit in limits)
    part = log if first is None and stop is None else _checked(log, log.first if first is None else first, stop)
    if not skip_periods and not any(limit and limit.unit == "periods" for limit in limits):
        return part
    start, period = periods_in(part)
    before, last = (_periods(limit) for limit in limits)
    begins = start + round(((before or 0) + skip_periods) * period)
    stop = part.stop if last is None else start + round(last * period)
    return _checked(log, begins, stop if part.stop is None or stop is None else min(stop, part.stop))


def _fixed(limit: PartLimit | None, log: Log) -> int | None:
    return None if limit is None or limit.unit == "periods" else limit.sample(log.rate_hz, log.origin_s)


def _periods(limit: PartLimit | None) -> float | None:
    return limit.value if limit is not None and limit.unit == "periods" else None


def _checked(log: Log, first: int, stop: int | None) -> Log:
    end = log.stop
    if stop is not None and end is not None:
        stop = min(stop, end)
    if (stop is not None and first >= stop) or (end is not None and first >= end):
        last_s = "" if end is None else f" and {log.origin_s + end / log.rate_hz:.9g} s"
        many = "" if end is None else f" (samples 0 to {end})"
        raise UsageError(
            "out-of-range",
            f"the chosen part from sample {first} to {end if stop is None else stop} has no samples; the recording is "
            f"between {log.origin_s:.9g} s{last_s}{many}",
            "choose other limits",
            first=first,
            stop=stop,
        )
    return log.part(first, stop)
