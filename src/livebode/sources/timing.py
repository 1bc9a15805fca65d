"""When the samples were taken: the time column, its unit, the exact rate, jitter and gaps."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from livebode.core import ClockKind, RecordingError, clock_kind_of, nearest_name
from livebode.dataclass import dataclass
from livebode.sources.recording import Chunk, Column
from livebode.sources.steps import Gap, Steps, exact_rate_hz
from livebode.sources.units import SECONDS, UNIT_IN_FRONT, split_unit, time_unit

RATE_TOLERANCE = 1e-3
"""Relative difference above which a time column contradicts a given rate."""
JITTER_MAX = 0.1
"""Largest standard deviation of the step in periods: 0.07 periods of a sample cost 0.1 % at a tenth of the rate,
2.4 % at the Nyquist frequency, and cause noise 27 dB below a line at a tenth of the rate."""
GAPS_SHARE_MAX = 0.05
GAPS_LISTED = 1000
RATE_NAMES = (
    "fs", "f_s", "fs_hz", "rate", "rate_hz", "sample_rate", "samplerate", "sampling_rate", "sample_rate_hz",
    "abtastrate",
)  # fmt: skip
PERIOD_NAMES = (
    "ts", "t_s", "dt", "dt_s", "sample_time", "sampletime", "sampling_time", "sample_period", "period_s", "tvz",
    "abtastzeit",
)  # fmt: skip
TIME_NAMES = "t", "time", "zeit", "timestamp", "time_stamp", "zeitstempel", "seconds", "sekunden", "x_value"
DSPACE_TIME = re.compile(r"(?:^|[./])X(?:\(\d+\))?[./]Data$")


@dataclass(frozen=True)
class Timing:
    """Properties of the time column.

    Parameters
    ----------
    column, unit
        Its name and the unit that it was read in.
    period_s_mean, period_s_std, period_s_min, period_s_max
        The regular steps (without gaps), in seconds.
    gaps, missing
        Number of gaps, and of samples missing in all of them.
    first_gaps
        The first thousand gaps.
    """

    column: str
    unit: str
    period_s_mean: float
    period_s_std: float
    period_s_min: float
    period_s_max: float
    gaps: int
    missing: int
    first_gaps: tuple[Gap, ...]


@dataclass(frozen=True)
class Clock:
    """Rate, origin and gaps of a recording, from its time column or without one."""

    rate_hz: float
    rate_origin: str
    samples: int | None = None
    origin_s: float = 0.0
    kind: ClockKind = "relative"
    timing: Timing | None = None
    gap_rows: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    gap_missing: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))


def find_time(columns: Sequence[Column], time: str | None) -> tuple[Column | None, str]:
    """The time column among `columns` and the unit that the user gave for it.

    `time` None takes the clock of the group, else finds one by name; "none" uses none; anything else is the name of
    one, "name [unit]" with its unit.

    >>> find_time([Column("u"), Column("Zeit", "ms")], None)[0].name
    'Zeit'
    >>> find_time([Column("u"), Column("clock")], "clock [us]")[1]
    'us'
    """
    if time is None:
        if clock := next((column for column in columns if column.clock), None):
            return clock, ""
        ranked = sorted((rank, at) for at, column in enumerate(columns) if (rank := time_rank(column)) is not None)
        return (columns[ranked[0][1]] if ranked else None), ""
    if time.casefold() == "none":
        return None, ""
    bare, unit = split_unit(time)
    for required, given in ((time, ""), (bare, unit)):
        for column in columns:
            if required == column.name or required in column.aliases:
                return column, given
    names = [column.name for column in columns]
    raise RecordingError(
        "channel-unknown",
        f"there is no time column {bare!r}",
        nearest_name(bare, names),
        argument="time",
        channel=bare,
        channels=names,
    )


def time_rank(column: Column) -> int | None:
    """How well the name of a column matches a time, 0 best; None if it does not."""
    if column.temporal:
        return len(TIME_NAMES) + 1
    if DSPACE_TIME.search(column.name):
        return len(TIME_NAMES)
    unit = time_unit(column.name, column.unit)
    if unit and unit.casefold() not in SECONDS:
        return None
    last = re.split(r"[./]", column.name)[-1].casefold()
    head, _, tail = last.rpartition("_")
    name = head if tail in SECONDS and head else last
    if UNIT_IN_FRONT.fullmatch(last):
        return len(TIME_NAMES) - 1
    return TIME_NAMES.index(name) if name in TIME_NAMES else None


def rate_in_file(scalars: Mapping[str, float]) -> tuple[float, str] | None:
    """Rate in Hz from a single number in the file, and the text of its origin.

    >>> rate_in_file({"kp": 3.0, "Fs": 2500.0})
    (2500.0, "'Fs' in the file")
    """
    for name, value in sorted(scalars.items(), key=lambda item: len(re.split(r"[./]", item[0]))):
        bare = re.split(r"[./]", split_unit(name)[0])[-1].casefold()
        if not (np.isfinite(value) and value > 0):
            continue
        if bare in RATE_NAMES:
            return value, f"{name!r} in the file"
        if bare in PERIOD_NAMES:
            return exact_rate_hz(value, 0.0), f"{name!r} in the file"
    return None


def rate_column(columns: Sequence[Column]) -> Column | None:
    """The first column whose name is that of a rate or period; "rate" alone may be a feed rate."""
    names = {*RATE_NAMES, *PERIOD_NAMES} - {"rate"}
    return next((c for c in columns if re.split(r"[./]", c.name)[-1].casefold() in names and not c.temporal), None)


def rate_in_column(column: Column, chunks: Iterator[Chunk]) -> tuple[float, str] | None:
    """Rate in Hz from a column that has one value and is empty otherwise, and the text of its origin; else None.

    >>> rate_in_column(Column("Tvz", "ms"), iter([[np.array([0.25, np.nan, 0.25])]]))
    (4000.0, "column 'Tvz' in ms, which has one value")
    """
    known: float | None = None
    for (values,) in chunks:
        found = np.unique(values[np.isfinite(values)])
        if found.size > 1 or (found.size and known is not None and found[0] != known):
            return None
        known = float(found[0]) if found.size else known
    scale = {**SECONDS, "hz": 1.0, "khz": 1e3, "": 1.0}.get(column.unit.casefold())
    if known is None or known <= 0 or scale is None:
        return None
    is_period = re.split(r"[./]", column.name)[-1].casefold() in PERIOD_NAMES
    unit = column.unit or {True: "s", False: "Hz"}[is_period]
    rate_hz = exact_rate_hz(known * scale, 0.0) if is_period else known * scale
    return rate_hz, f"column {column.name!r} in {unit}, which has one value"


def clock_from_time(
    column: Column,
    unit: str,
    chunks: Iterator[Chunk],
    rate_hz: float | None,
    stated: tuple[float, str] | None,
    kind: ClockKind | None = None,
) -> Clock:
    """The clock from a time column, in one pass over it.

    Parameters
    ----------
    column, unit
        The column, and the unit that the user gave for it (else empty).
    chunks
        The column's values.
    rate_hz
        Rate from the user; treated as exact, and rejected if the column contradicts it.
    stated
        Rate stated elsewhere in the file; used only if the unit of time is missing.
    kind
        Kind of the clock from the user.
    """
    unit = stated_unit(column, unit)
    steps = Steps(column.name)
    for (time,) in chunks:
        steps.add(time)
    if not steps.regular:
        if rate_hz is None:
            raise RecordingError(
                "rate-missing",
                f"time column {column.name!r} has {steps.rows} samples, too few to measure the rate",
                "give rate_hz",
                argument="rate_hz",
                channel=column.name,
                samples=steps.rows,
            )
        return Clock(rate_hz, "given", steps.rows)
    known_rate = (rate_hz, "the given rate") if rate_hz is not None else stated
    unit, scale, guessed = (unit, SECONDS[unit.casefold()], "") if unit else guess_unit(column, steps.mean, known_rate)
    refuse_jitter(column.name, steps)
    measured_hz = exact_rate_hz(steps.mean * scale, uncertainty(steps))
    check_rate(column.name, measured_hz, rate_hz)
    origin = f"time column {column.name!r} in {unit}{guessed}"
    return Clock(
        rate_hz if rate_hz is not None else measured_hz,
        f"given; {origin} agrees" if rate_hz is not None else origin,
        steps.rows,
        float(steps.first) * scale,
        kind or clock_kind_of(float(steps.first) * scale),
        summary(column.name, unit, scale, steps),
        np.array(steps.gap_rows, dtype=np.int64),
        np.array(steps.gap_missing, dtype=np.int64),
    )


def check_rate(name: str, measured_hz: float, rate_hz: float | None) -> None:
    """RecordingError if the measured rate is implausible or contradicts the given one."""
    if not 1e-9 < measured_hz < 1e12:
        raise RecordingError(
            "rate-implausible",
            f"time column {name!r} gives a rate of {measured_hz:.6g} Hz",
            "check that this is the time",
            channel=name,
            rate_hz=measured_hz,
        )
    if rate_hz is not None and abs(measured_hz / rate_hz - 1.0) > RATE_TOLERANCE:
        raise RecordingError(
            "rate-conflict",
            f"time column {name!r} gives {measured_hz:.8g} Hz, but rate_hz is {rate_hz:.8g} Hz",
            'correct rate_hz, or ignore the column (time = "none")',
            argument="rate_hz",
            channel=name,
            rate_hz=measured_hz,
            given_hz=rate_hz,
        )


def stated_unit(column: Column, given: str) -> str:
    """Unit of a time column from the user, the file or its name; empty if none gives it."""
    unit = given or time_unit(column.name, column.unit)
    if unit and unit.casefold() not in SECONDS:
        raise RecordingError(
            "time-unit",
            f"time column {column.name!r} is in {unit!r}, which is not a unit of time",
            "use s, ms, us or ns",
            channel=column.name,
            unit=unit,
        )
    return unit


def guess_unit(
    column: Column, mean: float, known_rate: tuple[float, str] | None, tolerance: float = RATE_TOLERANCE
) -> tuple[str, float, str]:
    """Unit of a time column that states none, its length in seconds, and its origin (empty for seconds).

    The unit is seconds, except if a rate from elsewhere differs by a power of 1000. Seconds that give 1 Hz or less
    are not accepted without such a rate.
    """
    if known_rate is None:
        if mean < 1.0:
            return "s", 1.0, ""
        raise RecordingError(
            "time-unit",
            f"time column {column.name!r} has no unit and steps of {mean:.6g}, in seconds {1 / mean:.4g} Hz",
            f"give rate_hz, or its unit (time = '{column.name} [us]')",
            channel=column.name,
            step=mean,
        )
    rate_hz, where = known_rate
    for unit in ("s", "ms", "us", "ns"):
        if abs(mean * SECONDS[unit] * rate_hz - 1.0) <= tolerance:
            return unit, SECONDS[unit], "" if unit == "s" else f" (unit from {where})"
    raise RecordingError(
        "rate-conflict",
        f"time column {column.name!r} has no unit and steps of {mean:.8g}, in seconds {1 / mean:.8g} Hz, "
        f"but {where} is {rate_hz:.8g} Hz",
        'correct rate_hz, or ignore the column (time = "none")',
        argument="rate_hz",
        channel=column.name,
        rate_hz=1 / mean,
        given_hz=rate_hz,
    )


def refuse_jitter(name: str, steps: Steps) -> None:
    gaps = len(steps.gap_rows)
    if gaps > 3 and gaps > GAPS_SHARE_MAX * steps.regular:
        raise RecordingError(
            "time-irregular",
            f"time column {name!r} has {gaps} gaps in {steps.rows} samples",
            "resample the recording, or, where time has too few digits, give rate_hz and ignore the column "
            '(time = "none")',
            channel=name,
            gaps=gaps,
            samples=steps.rows,
        )
    if steps.std > JITTER_MAX * steps.mean and not steps.printed:
        raise RecordingError(
            "time-jitter",
            f"time column {name!r} jitters by {steps.std / steps.mean:.1%} of its period (standard deviation; at most "
            f"{JITTER_MAX:.0%}), which biases every spectrum",
            "resample the recording, or, where the samples are regular and only their stamps are late, give rate_hz "
            'and ignore the column (time = "none")',
            channel=name,
            jitter=steps.std / steps.mean,
            maximum=JITTER_MAX,
        )


def uncertainty(steps: Steps) -> float:
    """Relative uncertainty of the mean period: the stamps' own error over the length, once for each stretch."""
    stamps = max(3.0 * steps.std, steps.spread if steps.printed else 0.0, steps.largest * 2.0**-51)
    return stamps * (len(steps.gap_rows) + 1) / (steps.regular * steps.mean)


def summary(name: str, unit: str, scale: float, steps: Steps) -> Timing:
    missing = np.array(steps.gap_missing, dtype=np.int64)
    numbers = np.array(steps.gap_rows, dtype=np.int64) + np.cumsum(missing)
    listed = tuple(Gap(int(n), int(m)) for n, m in zip(numbers[:GAPS_LISTED], missing[:GAPS_LISTED]))
    low, high, mean = steps.low * scale, steps.high * scale, steps.mean * scale
    return Timing(name, unit, mean, steps.std * scale, low, high, len(missing), int(missing.sum()), listed)
