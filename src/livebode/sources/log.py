"""Log: a recording file as a source of Blocks."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from livebode.core import Block, Channel, QuantityKind, RecordingError, UsageError
from livebode.core.clock import ClockKind
from livebode.sources.naming import resolve
from livebode.sources.recording import Chunk, Column, Recording, Skipped, guarded, located, stacked
from livebode.sources.timing import Clock, Timing

BLOCK_SAMPLES_MAX = 1 << 24


class Log:
    """A recording: its channels, rate and timing, and its samples as Blocks. Created by `open_log`.

    Nothing but the time column is read before `blocks` is iterated; every call of `blocks` reads from the start.

    Examples
    --------
    >>> import tempfile
    >>> from livebode import open_log
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "log.csv"
    ...     _ = path.write_text("t [s],iq [A]\\n0.000,1.5\\n0.001,1.6\\n0.002,1.7\\n")
    ...     log = open_log(path)
    >>> log.format, log.rate_hz, log.channels[1]
    ('csv', 1000.0, Channel(name='iq', unit='A', kind='current'))
    """

    def __init__(
        self,
        recording: Recording,
        columns: Sequence[Column],
        chosen: Sequence[str],
        clock: Clock,
        block_samples: int,
        kinds: Mapping[str, QuantityKind],
    ) -> None:
        self._recording = recording
        self._columns = tuple(columns)
        self._chosen = tuple(chosen)
        self._clock = clock
        self._block_samples = block_samples
        self._kinds = kinds
        self._listed: tuple[str, ...] = ()

    @property
    def path(self) -> Path:
        return self._recording.path

    @property
    def format(self) -> str:
        """Name of the format: csv, parquet, arrow, mat, …; `docs/reference/readers.md` lists them."""
        return self._recording.format

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Everything that `blocks` can read, in the order of the file; then the other names of `listing`."""
        own = [self._label(column, column.name) for column in self._columns if not column.temporal]
        return (*own, *(self._label(self._column(name), name) for name in self._listed))

    def listing(self, names: Sequence[str]) -> Log:
        """The same log, whose `channels` have these paths and aliases too; RecordingError if one is not in the file."""
        other = copy(self)
        known = {column.name for column in self._columns}
        other._listed = tuple(name for name in dict.fromkeys((*self._listed, *names)) if name not in known)
        with located(self.path):
            for name in other._listed:
                self._column(name)
        return other

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
            Skipped(column.name, f"it has {column.samples} samples, not {self.samples}")
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
        """Samples in the file (without missing ones); None if only reading gives the number."""
        known = [column.samples for column in self._columns if column.samples is not None]
        return known[0] if known else self._clock.samples

    def blocks(self, channels: Sequence[str] | None = None, block_samples: int | None = None) -> Iterator[Block]:
        """The samples of `channels` from the first to the last.

        Parameters
        ----------
        channels
            Names, paths or aliases; the Blocks use the given names. Default: those given to `open_log`, or all
            except the time column.
        block_samples
            Largest length of a Block; they are shorter at gaps and where the file's own pieces end.

        Yields
        ------
        Block
            float64, shape (channels, ≤ block_samples). Empty cells are NaN; NaN and infinities are unchanged.

        Raises
        ------
        RecordingError
            At once for a channel that is not in the file; while iterating for damage later in it.
        UsageError
            For no channel, a duplicated channel, or a length that is out of range.
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
        with located(self.path):
            columns = [self._column(name) for name in names]
        labels = tuple(self._label(column, name) for name, column in zip(names, columns))
        return self._cut(self._read(columns, limit), labels, limit)

    def _column(self, name: str) -> Column:
        return resolve(name, self._columns, self._recording.columns)

    def _label(self, column: Column, name: str) -> Channel:
        kind = self._kinds.get(column.name)
        return Channel(name, column.unit) if kind is None else Channel(name, column.unit, kind)

    def _read(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        return guarded(self._recording.chunks(columns, rows), self._recording.path, self._recording.format)

    def _cut(self, chunks: Iterator[Chunk], labels: tuple[Channel, ...], limit: int) -> Iterator[Block]:
        clock = self._clock
        cuts = np.union1d(clock.gap_rows, np.asarray(self._recording.breaks, dtype=np.int64))
        missing = np.concatenate(([0], np.cumsum(clock.gap_missing)))
        row = 0
        for chunk in chunks:
            length = len(chunk[0])
            for first, last in pieces(row, row + length, cuts, limit):
                yield Block(
                    stacked([values[first - row : last - row] for values in chunk]),
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
