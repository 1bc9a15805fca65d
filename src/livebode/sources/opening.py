"""Open a recording: its format, the series that belong together, and its clock."""

from __future__ import annotations

import logging
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from livebode.core import ClockKind, QuantityKind, RecordingError, UsageError
from livebode.locations import Url, location
from livebode.sources.formats import open_file
from livebode.sources.log import Log, checked_block_samples
from livebode.sources.naming import explained, reasons, resolve, together
from livebode.sources.quantities import DeclaredQuantities
from livebode.sources.recording import Column, Recording, guarded, located
from livebode.sources.timing import (
    JITTER_MAX,
    Clock,
    clock_from_time,
    find_time,
    rate_column,
    rate_in_column,
    rate_in_file,
)

UNEVEN = "recording.clocks-differ", "recording.time-jitter", "recording.time-irregular"
"""Codes of the errors of `log_of` on a recording of which `uneven_log_of` makes a log."""
_logger = logging.getLogger(__name__)

_FREQUENCY = re.compile(r"f|freq\w*|frequenz|hz|hertz", re.IGNORECASE)
_HERTZ = ("", "hz", "khz", "mhz", "rad/s")
_UNNAMED = re.compile(r"c\d+")  # of a table without a header
_COLUMNS_TRIED = 8
_STEP_S_MAX = 0.1  # of a time in seconds; larger steps are rather milliseconds


def open_log(
    path: str | os.PathLike[str] | Url,
    *,
    rate_hz: float | None = None,
    time: str | None = None,
    channels: Sequence[str] | None = None,
    dbc: str | os.PathLike[str] | None = None,
    block_samples: int = 65536,
    kinds: Mapping[str, QuantityKind] | None = None,
    units: Mapping[str, str] | None = None,
    clock: ClockKind | None = None,
) -> Log:
    """Open a recording of any format that `docs/reference/readers.md` lists.

    Parameters
    ----------
    path
        The file, or its URL (docs/how-to/remote.md); its content, not its ending, determines the format.
    rate_hz
        Samples per second, treated as exact. Default: from a time column or from the file's metadata.
    time
        Name of the time column, with its unit if the file does not contain it: "clock [us]". Default: found by
        name; "none" ignores the time column. A column of a group selects its channels.
    channels
        Channels to read; selects the series that belong together if the file has series of several lengths or clocks.
    dbc
        File that defines the signals in CAN frames, for BLF, ASC and MDF.
    block_samples
        Largest length of a Block.
    kinds
        Kind of quantity of some channels, by name. Default: the one that the unit shows, otherwise the name.
    units
        Quantity of one unit of some channels, by name: "rpm", or "0.024 N m" for 1 % of a rated torque of 2.4 N m.
        Default: the unit in the file, otherwise the one at the end of the name (`speed_rpm`). What is read is in SI
        units where they are recognised (`Channel.written` has the unit in the file).
    clock
        Whether the time column is in seconds since 1970 ("utc") or since any other moment ("relative"). Default: from
        its first value; "relative" without a time column.

    Raises
    ------
    RecordingError
        Where the file cannot be read, lacks a channel, has no usable time or rate, or needs a `dbc` or has no use
        for it.
    UsageError
        Where `rate_hz` or `block_samples` is out of range.
    LocationError
        Where the file at a URL cannot be downloaded.
    ExtraError
        Where the package that reads the format or the storage is not installed.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "log.csv"
    ...     _ = path.write_text("t [s],iq [A]\\n0.000,1.5\\n0.001,1.6\\n0.002,1.7\\n")
    ...     log = open_log(path)
    ...     [block["iq"] for block in log.blocks(["iq"])]
    [array([1.5, 1.6, 1.7])]
    >>> log.rate_hz, log.channels[1]
    (1000.0, Channel(name='iq', unit='A', kind='current'))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "log.csv"
    ...     _ = path.write_text("t_ms;Istdrehzahl [1/min];load_pct\\n0;0;50\\n1;60;50\\n2;120;25\\n")
    ...     log = open_log(path, units={"load_pct": "0.024 N m"})
    ...     [block.data.round(4).tolist() for block in log.blocks()], [channel.unit for channel in log.channels[1:]]
    ([[[0.0, 6.2832, 12.5664], [1.2, 1.2, 0.6]]], ['rad/s', 'N m'])
    """
    return log_of(
        open_file(location(path), None if dbc is None else Path(dbc)),
        rate_hz=rate_hz,
        time=time,
        channels=channels,
        block_samples=block_samples,
        quantities=DeclaredQuantities(kinds or {}, units or {}),
        clock=clock,
    )


def log_of(
    recording: Recording,
    *,
    rate_hz: float | None = None,
    time: str | None = None,
    channels: Sequence[str] | None = None,
    block_samples: int = 65536,
    quantities: DeclaredQuantities | None = None,
    clock: ClockKind | None = None,
) -> Log:
    """The log of a recording that `open_file` opened; parameters and errors as of `open_log`.

    `quantities` has the kinds and the units.
    """
    if rate_hz is not None and not (np.isfinite(rate_hz) and rate_hz > 0):
        raise UsageError(
            "out-of-range",
            f"{rate_hz=} is not a positive finite number",
            "give the samples per second",
            argument="rate_hz",
            value=rate_hz,
        )
    checked_block_samples(block_samples)
    with located(recording.place), explained(recording.skipped):
        log = _log_of(recording, rate_hz, time, channels, block_samples, quantities or DeclaredQuantities(), clock)
    _logger.info("%s: %s, %d channels at %.9g Hz", log.path, log.format, len(log.channels), log.rate_hz)
    return log


def even_or_uneven_log(
    recording: Recording, channels: Sequence[str], in_use: Sequence[str], *, time: str | None, **given: Any
) -> Log:
    """The same; a Log that is not `even` if the clock of `channels` jitters, or others `in_use` have other clocks."""
    try:
        log = log_of(recording, channels=channels, time=time, **given)
        log.check_clocks(in_use)
        return log
    except RecordingError as error:
        if error.code not in UNEVEN or time == "none":
            raise
    from livebode.sources.uneven import uneven_log_of

    return uneven_log_of(recording, in_use, time=time, **given)


def _log_of(
    recording: Recording,
    rate_hz: float | None,
    time: str | None,
    channels: Sequence[str] | None,
    block_samples: int,
    quantities: DeclaredQuantities,
    clock_kind: ClockKind | None,
) -> Log:
    columns = together(recording, channels, time)
    time_column, unit = find_time(columns, time)
    chosen = channels or [c.name for c in columns if c is not time_column and not c.temporal]
    if not chosen:
        raise RecordingError(
            "channel-missing",
            f"{recording.path} has no channel except the time{reasons(recording)}",
            "check that the recording is complete",
            path=str(recording.path),
        )
    declared = quantities.renamed({name: resolve(name, columns, recording.columns).name for name in quantities.names})
    if clock_kind == "utc" and time_column is None:
        raise UsageError(
            "conflict",
            "clock='utc' is the kind of a time column, and the recording has none",
            "name its time column, or omit clock",
            argument="clock",
            value=clock_kind,
        )
    clock = find_clock(recording, time_column, unit, rate_hz, clock_kind)
    return Log(recording, columns, chosen, clock, block_samples, declared)


def find_clock(
    recording: Recording, column: Column | None, unit: str, rate_hz: float | None, kind: ClockKind | None = None
) -> Clock:
    """Rate and gaps: from the time column, from the format or a number in the file, or as given."""
    stated = rate_in_file(recording.scalars)
    if recording.rate_hz is not None:
        stated = recording.rate_hz, "metadata"
    if column is not None:
        chunks = guarded(recording.chunks([column], 1 << 16), recording.path, recording.format)
        return clock_from_time(column, unit, chunks, rate_hz, stated, kind)
    if rate_hz is not None:
        if recording.rate_hz is not None and abs(recording.rate_hz / rate_hz - 1) > 1e-3:
            raise RecordingError(
                "rate-conflict",
                f"{recording.path} states {recording.rate_hz:.8g} Hz, but rate_hz is {rate_hz:.8g} Hz",
                "correct rate_hz, or omit it",
                path=str(recording.path),
                argument="rate_hz",
                rate_hz=recording.rate_hz,
                given_hz=rate_hz,
            )
        return Clock(rate_hz, "given")
    stated = stated or rate_by_column(recording)
    if stated is None:
        raise without_rate(recording)
    return Clock(*stated)


def without_rate(recording: Recording) -> RecordingError:
    """The error of a recording without a rate: it may be a spectrum, or have a time whose name does not say so."""
    path = str(recording.path)
    starts = _starts(recording, recording.columns[:_COLUMNS_TRIED])
    first = recording.columns[0]
    if _FREQUENCY.fullmatch(first.name) and first.unit.casefold() in _HERTZ and _rises(starts[0]):
        return RecordingError(
            "spectrum",
            f"{path} is a spectrum over {first.name!r} ({first.unit or 'no unit'}), not a recording of samples",
            "record or export the samples over time",
            path=path,
            channel=first.name,
        )
    remedy, offered = "give rate_hz, or name the time column", None
    for column, values in zip(recording.columns, starts):
        steps = np.diff(values)
        if _UNNAMED.fullmatch(column.name) and _rises(values) and np.ptp(steps) <= 2 * JITTER_MAX * steps.mean():
            offered = f"{column.name} [{'ms' if steps.mean() >= _STEP_S_MAX else 's'}]"
            remedy = f"give rate_hz; or name the time column: {column.name!r} rises evenly (time = {offered!r})"
            break
    message = f"{path} has neither a time column nor a rate"
    return RecordingError("rate-missing", message, remedy, path=path, argument="rate_hz", time=offered)


def _starts(recording: Recording, columns: Sequence[Column]) -> list[np.ndarray]:
    """The first values of each column; none where it cannot be read."""
    found = []
    for column in columns:
        try:
            (values,) = next(guarded(recording.chunks([column], 1 << 10), recording.path, recording.format), [()])
        except RecordingError:
            values = ()
        found.append(np.asarray(values[: 1 << 10], dtype=np.float64))
    return found


def _rises(values: np.ndarray) -> bool:
    return values.size > 2 and bool(np.all(np.diff(values) > 0))


def rate_by_column(recording: Recording) -> tuple[float, str] | None:
    column = rate_column(recording.columns)
    if column is None:
        return None
    return rate_in_column(column, guarded(recording.chunks([column], 1 << 16), recording.path, recording.format))
