"""Log: a recording file as a source of Blocks."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from livebode.core import Block, Channel, ClockKind, LivebodeError, RecordingError, UsageError
from livebode.locations import Location
from livebode.sources.expressions import Expression, computed_blocks
from livebode.sources.held_chunks import HeldChunks
from livebode.sources.naming import explained, found_channel, resolve
from livebode.sources.quantities import DeclaredQuantities, in_si
from livebode.sources.recording import Chunk, Column, Recording, Skipped, guarded, located, stacked
from livebode.sources.timing import Clock, Timing
from livebode.sources.unwrapping import Unwrapping, Wrap, WrapSearch

BLOCK_SAMPLES_MAX = 1 << 24
_NAMES_SHOWN = 8


class Log:
    """A recording: its channels, rate and timing, and its samples as Blocks. Created by `open_log`.

    Nothing but the time column is read before `blocks` is iterated; every call of `blocks` reads from the start.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from livebode import open_log
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "log.csv"
    ...     _ = path.write_text("t [s],iq [A]\\n0.000,1.5\\n0.001,1.6\\n0.002,1.7\\n")
    ...     log = open_log(path)
    >>> log.format, log.rate_hz, log.channels[1]
    ('csv', 1000.0, Channel(name='iq', unit='A', kind='current'))
    >>> print(str(log).replace(str(path), "log.csv"))
    <Log 'log.csv': csv, 3 samples at 1000 Hz; t, iq>
    """

    even: ClassVar[bool] = True
    """Whether all channels have the one clock, whose steps are equal."""

    def __init__(
        self,
        recording: Recording,
        columns: Sequence[Column],
        chosen: Sequence[str],
        clock: Clock,
        block_samples: int,
        quantities: DeclaredQuantities,
    ) -> None:
        self._recording = recording
        self._columns = tuple(columns)
        self._chosen = tuple(chosen)
        self._clock = clock
        self._block_samples = block_samples
        self._quantities: DeclaredQuantities | None = quantities
        self._held = HeldChunks()
        self.first = 0
        """Number of the first sample that `blocks` reads."""
        self._stop: int | None = None
        self._named: tuple[Channel, ...] = ()
        self.wraps: Mapping[str, Wrap] = {}
        """What `unwrapping` unwraps, by column."""

    def __repr__(self) -> str:
        names = ", ".join(channel.name for channel in self.channels[:_NAMES_SHOWN])
        more = ", …" if len(self.channels) > _NAMES_SHOWN else ""
        return f"<Log {str(self.path)!r}: {self.format}, {self.samples} samples at {self.rate_hz:g} Hz; {names}{more}>"

    @property
    def path(self) -> Location:
        """Its path or URL."""
        return self._recording.place

    @property
    def format(self) -> str:
        """Name of the format: csv, parquet, arrow, mat, …; `docs/reference/readers.md` lists them."""
        return self._recording.format

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Everything that `blocks` can read, in the order of the file; then the names of `naming`."""
        own = tuple(self._label(column, column.name) for column in self._columns if not column.temporal)
        return own + self._named

    @property
    def aliases(self) -> Mapping[str, str]:
        """Other names that `blocks` takes, each with the channel that it means."""
        names = {column.name for column in self._columns}
        count = Counter(alias for column in self._columns for alias in set(column.aliases))
        return {
            alias: column.name
            for column in self._columns
            for alias in column.aliases
            if count[alias] == 1 and alias not in names
        }

    @property
    def skipped(self) -> tuple[Skipped, ...]:
        """What else is in the file with this clock, and why it is not a channel."""
        listed = {column.name for column in self._columns}
        other = [
            Skipped(column.name, f"it has {column.samples} samples, not {self._rows}")
            for column in self._recording.columns
            if column.name not in listed and column.name not in self.scalars and column.group == self._group
        ]
        return (*self._recording.skipped, *other)

    @property
    def other_clocks(self) -> Mapping[str, tuple[str, ...]]:
        """Channels of the file that are sampled by other clocks, by the time column that `open_log(time=)` takes."""
        groups: dict[str, list[Column]] = {}
        for column in self._recording.columns:
            if column.group != self._group:
                groups.setdefault(column.group, []).append(column)
        return {
            clock.name: tuple(column.name for column in columns if not column.temporal and column is not clock)
            for columns in groups.values()
            for clock in columns
            if clock.clock
        }

    @property
    def _group(self) -> str:
        return self._columns[0].group

    @property
    def scalars(self) -> Mapping[str, float]:
        """Single numbers in the file by name, such as controller gains."""
        return self._recording.scalars

    @property
    def rate_hz(self) -> float:
        return self._clock.rate_hz

    @property
    def rate_origin(self) -> str:
        """Origin of the rate: "given", "time column 't' in s", "'fs' in the file", "metadata"; and what agrees."""
        return self._clock.rate_origin

    @property
    def clock_kind(self) -> ClockKind:
        """Whether its times are seconds since 1970 ("utc"), or since any other moment ("relative")."""
        return self._clock.kind

    @property
    def timing(self) -> Timing | None:
        """Jitter and gaps of the time column; None without one."""
        return self._clock.timing

    @property
    def samples(self) -> int | None:
        """Samples in the file, or in the `part` (without missing ones); None if only reading gives the number."""
        rows = self._rows
        return None if rows is None else self._row(self._stop, rows) - self._row(self.first, rows)

    @property
    def stop(self) -> int | None:
        """Number of the sample after the last one; None if only reading gives it."""
        if self._stop is not None or self._rows is None:
            return self._stop
        return self._rows + int(self._clock.gap_missing.sum())

    @property
    def is_part(self) -> bool:
        """Whether it is a `part` of the recording."""
        return self.first > 0 or self._stop is not None

    @property
    def origin_s(self) -> float:
        """Time of sample number 0 in seconds, in the clock of the recording."""
        return self._clock.origin_s

    @property
    def _rows(self) -> int | None:
        known = [column.samples for column in self._columns if column.samples is not None]
        return known[0] if known else self._clock.samples

    def _row(self, sample: int | None, rows: int) -> int:
        """Rows before a sample number; all of them for None."""
        if sample is None:
            return rows
        clock = self._clock
        missing = np.cumsum(clock.gap_missing)
        passed = int(np.searchsorted(clock.gap_rows + missing, sample, side="right"))
        before = sample - (int(missing[passed - 1]) if passed else 0)
        # A number in a gap belongs to the row after it.
        return min([before, rows, *map(int, clock.gap_rows[passed : passed + 1])])

    def part(self, first: int, stop: int | None = None) -> Log:
        """The same recording from sample `first` up to `stop`, which is excluded; samples keep numbers and times.

        Parameters
        ----------
        first
            Number of the first sample, ≥ 0.
        stop
            Number of the sample after the last one. Default: the whole rest.

        Examples
        --------
        >>> import tempfile
        >>> from pathlib import Path
        >>> from livebode import open_log
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = Path(folder) / "log.csv"
        ...     _ = path.write_text("t [s],iq [A]\\n0.000,1.5\\n0.001,1.6\\n0.002,1.7\\n")
        ...     part = open_log(path).part(1)
        ...     [(block.start, block["iq"]) for block in part.blocks()]
        [(1, array([1.6, 1.7]))]
        """
        chosen = copy(self)
        chosen.first, chosen._stop = first, self._stop if stop is None else stop
        return chosen

    def blocks(self, channels: Sequence[str] | None = None, block_samples: int | None = None) -> Iterator[Block]:
        """The samples of `channels` from the first to the last.

        Parameters
        ----------
        channels
            Names, paths, aliases or expressions such as "pos + 0.35*angle"; the Blocks use the given names. Default:
            those given to `open_log`, or all except the time column.
        block_samples
            Largest length of a Block; they are shorter at gaps and where the file's own pieces end.

        Yields
        ------
        Block
            float64, shape (channels, ≤ block_samples), in SI units where the unit is recognised. Empty cells are NaN;
            NaN and infinities are unchanged.

        Raises
        ------
        RecordingError
            At once for a channel that is not in the file; while iterating for damage later in it.
        UsageError
            For an expression that adds different units, no channel, a duplicated channel, or a length that is out of
            range.
        """
        limit = checked_block_samples(self._block_samples if block_samples is None else block_samples)
        names = list(self._chosen if channels is None else channels)
        if isinstance(channels, str):
            raise TypeError(f"channels={channels!r} is not a list of channel names")
        if not names:
            raise UsageError("missing", "channels is empty", "name at least one channel", argument="channels")
        if repeated := [name for name, count in Counter(names).items() if count > 1]:
            raise UsageError(
                "duplicate",
                f"channel {repeated[0]!r} is duplicated in channels",
                "name it once",
                argument="channels",
                value=repeated[0],
            )
        found = self._found(names)
        if any(isinstance(one, Expression) for one in found.values()):
            return self._computed(found, limit)
        columns = [one for one in found.values() if isinstance(one, Column)]
        labels = tuple(self._label(column, name) for name, column in zip(names, columns))
        turns = [self.wraps[column.name].turn if column.name in self.wraps else None for column in columns]
        return self._within(_unwrapped(self._cut(self._read(columns, limit), labels, limit), turns))

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        """All samples of one channel in memory, shape (samples,), with NaN where some are missing; errors as `blocks`.

        Sample n is at index n − `first`.
        """
        parts: list[NDArray[np.float64]] = []
        stop = self.first
        for block in self.blocks([name]):
            parts += [np.full(block.start - stop, np.nan), block[name]]
            stop = block.stop
        return np.concatenate(parts) if parts else np.zeros(0)

    def has(self, name: str) -> bool:
        """Whether `blocks` can read or compute a channel of this name."""
        try:
            return bool(self._found([name]))
        except RecordingError:
            return False

    def shared_name(self, name: str) -> str:
        """The name without that of the file, if it still means the same: recordings of a series have it in common."""
        short = self._recording.without_file(name)
        return short if short == name or (self.has(short) and self._means(short) == self._means(name)) else name

    def _means(self, name: str) -> set[str]:
        found = self._found([name])[name]
        return {column.name for column in ([found] if isinstance(found, Column) else self._columns_of(found).values())}

    def naming(self, names: Sequence[str]) -> Log:
        """The same recording, whose `channels` also list these names: paths, aliases and expressions."""
        known = {column.name for column in self._columns}
        chosen = copy(self)
        chosen._named = self._labels(self._found([name for name in names if name not in known]))
        return chosen

    def unwrapping(self, wraps: Mapping[str, Wrap]) -> Log:
        """The same recording, in which these columns are unwrapped, also where channels are computed from them."""
        chosen = copy(self)
        chosen.wraps = wraps
        return chosen

    def search_wraps(self, names: Sequence[str]) -> dict[str, Wrap]:
        """The columns that wrap (`WrapSearch`) of those that these channels are, or are computed from, in all samples.

        Not of a channel that unwraps itself, and not of one that is not in the file.
        """
        found = [one for name in names if self.has(name) for one in self._found([name]).values()]
        columns = {one.name: one for one in found if isinstance(one, Column)}
        for one in found:
            if isinstance(one, Expression) and not one.unwraps:
                columns |= {column.name: column for column in self._columns_of(one).values()}
        if not columns:
            return {}
        labels = {name: self._label(column, name) for name, column in columns.items()}
        searches = {name: WrapSearch() for name in columns}
        for rows in self._rows_of(list(columns)):
            for name, x in rows.items():
                searches[name].process(x / labels[name].factor)
        wraps = {name: search.finish(labels[name]) for name, search in searches.items()}
        return {name: wrap for name, wrap in wraps.items() if wrap is not None}

    def _rows_of(self, columns: Sequence[str]) -> Iterator[dict[str, NDArray[np.float64]]]:
        """The samples of these columns as they are recorded, in parts."""
        for block in self.blocks(columns):
            yield {name: block[name] for name in columns}

    def as_written(self) -> Log:
        """The same recording in the units of the file, for a reader that converts them itself."""
        other = copy(self)
        other._quantities = None
        return other

    def check_clocks(self, names: Sequence[str]) -> None:
        """RecordingError if a channel has another clock; other errors are left to the reading."""
        for name in names:
            try:
                self._found([name])
            except LivebodeError as error:
                if error.code == "recording.clocks-differ":
                    raise

    def _found(self, names: Sequence[str]) -> dict[str, Column | Expression]:
        with located(self.path), explained(self._recording.skipped):
            return {name: found_channel(name, self._columns, self._recording.columns) for name in names}

    def _labels(self, found: Mapping[str, Column | Expression]) -> tuple[Channel, ...]:
        """Name, unit and kind of each."""
        with located(self.path):
            return tuple(
                one.channel({part: self._label(column, part) for part, column in self._columns_of(one).items()})
                if isinstance(one, Expression)
                else self._label(one, name)
                for name, one in found.items()
            )

    def _columns_of(self, expression: Expression) -> dict[str, Column]:
        return {name: resolve(name, self._columns, self._recording.columns) for name in expression.names}

    def _computed(self, found: Mapping[str, Column | Expression], limit: int) -> Iterator[Block]:
        """Blocks with computed channels; a part is computed with the samples before it."""
        expressions = {name: one for name, one in found.items() if isinstance(one, Expression)}
        needed = [
            part for name, one in found.items() for part in (one.names if isinstance(one, Expression) else [name])
        ]
        before = max(expression.before for expression in expressions.values())
        whole = self.part(max(self.first - before, 0), self._stop)
        blocks = whole.blocks(list(dict.fromkeys(needed)), limit)
        return self._within(computed_blocks(blocks, list(found), expressions, self._labels(found)))

    def _within(self, blocks: Iterator[Block]) -> Iterator[Block]:
        """The blocks of the part."""
        for block in blocks:
            if self._stop is not None and block.start >= self._stop:
                return
            first = max(self.first - block.start, 0)
            stop = len(block) if self._stop is None else min(self._stop - block.start, len(block))
            if first < stop:
                yield block.cut(first, stop)

    def _label(self, column: Column, name: str) -> Channel:
        if self._quantities is None:
            return Channel(name, column.unit)
        return self._quantities.channel(name, column.unit, column.name)

    def _read(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        recording = self._recording
        return self._held.chunks(
            columns, lambda: guarded(recording.chunks(columns, rows), recording.path, recording.format)
        )

    def _cut(self, chunks: Iterator[Chunk], labels: tuple[Channel, ...], limit: int) -> Iterator[Block]:
        clock = self._clock
        cuts = np.union1d(clock.gap_rows, np.asarray(self._recording.breaks, dtype=np.int64))
        missing = np.concatenate(([0], np.cumsum(clock.gap_missing)))
        row = 0
        for chunk in chunks:
            length = len(chunk[0])
            for first, last in pieces(row, row + length, cuts, limit):
                yield Block(
                    in_si(stacked([values[first - row : last - row] for values in chunk]), labels),
                    labels,
                    clock.rate_hz,
                    start=first + int(missing[np.searchsorted(clock.gap_rows, first, side="right")]),
                    origin_s=clock.origin_s,
                    gap=bool(holds(cuts, first)),
                )
            row += length
        if row == 0:
            path = str(self.path)
            raise RecordingError("empty", f"{path} has no samples", "check that the recording is complete", path=path)


def _unwrapped(blocks: Iterator[Block], turns: Sequence[float | None]) -> Iterator[Block]:
    """The blocks with some rows unwrapped, by their turns; the others have None."""
    if not any(turns):
        yield from blocks
        return
    each = [None if turn is None else Unwrapping(turn) for turn in turns]
    for block in blocks:
        rows = [x if one is None else one.process(x) for one, x in zip(each, block.data)]
        yield replace(block, data=np.array(rows))


def pieces(first: int, last: int, cuts: NDArray[np.int64], limit: int) -> Iterator[tuple[int, int]]:
    """Rows `first` … `last` − 1 as ranges that are split at the cuts and at most `limit` long.

    >>> list(pieces(0, 10, np.array([4]), 5))
    [(0, 4), (4, 9), (9, 10)]
    """
    inside = cuts[(cuts > first) & (cuts < last)].tolist()
    for begin, end in zip([first, *inside], [*inside, last]):
        for start in range(begin, end, limit):
            yield start, min(start + limit, end)


def holds(cuts: NDArray[np.int64], row: int) -> bool:
    at = int(np.searchsorted(cuts, row))
    return at < len(cuts) and int(cuts[at]) == row


def checked_block_samples(block_samples: int) -> int:
    if not (isinstance(block_samples, int) and 1 <= block_samples <= BLOCK_SAMPLES_MAX):
        raise UsageError(
            "out-of-range",
            f"{block_samples=} is out of range",
            f"give a whole number from 1 to {BLOCK_SAMPLES_MAX}",
            argument="block_samples",
            value=block_samples,
            minimum=1,
            maximum=BLOCK_SAMPLES_MAX,
        )
    return block_samples
