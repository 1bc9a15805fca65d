"""UnevenLog: a recording whose channels have clocks of their own, or a clock that jitters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Block, Channel, ClockKind, RecordingError, UsageError, clock_kind_of
from livebode.dataclass import dataclass
from livebode.sources.expressions import Expression
from livebode.sources.log import Log
from livebode.sources.naming import found_channel, resolve, together
from livebode.sources.quantities import DeclaredQuantities, in_si
from livebode.sources.recording import Column, Recording, Skipped, guarded, located, stacked
from livebode.sources.resample import Resampler
from livebode.sources.stamps import Stamps, stamps_of
from livebode.sources.steps import exact_rate_hz
from livebode.sources.timing import Clock, find_time, rate_in_file
from livebode.sources.units import split_unit
from livebode.sources.unwrapping import Unwrapping

_ROWS = 1 << 14


@dataclass(frozen=True, eq=False)
class ClockGroup:
    """Channels in use that share a clock, and its stamps."""

    stamps: Stamps
    channels: tuple[str, ...]

    @property
    def described(self) -> str:
        """The channels, their mean rate and their jitter, for a person."""
        jitter = f"steps ± {100 * self.stamps.jitter:.2g} %"
        return f"{' '.join(map(repr, self.channels))} at {self.stamps.rate_hz:.6g} Hz, {jitter}"


class UnevenLog(Log):
    """A recording whose channels are sampled at times of their own. Created by `uneven_log_of`.

    Its samples are read by `pieces`, at their times. Numbers of samples, the rate and `blocks` are those of a common
    grid that begins with the first sample of the reference: the samples of `blocks` are interpolated, good enough to
    examine the recording, but not to measure with it.
    """

    even = False

    def __init__(
        self,
        recording: Recording,
        chosen: Sequence[str],
        rate_hz: float | None,
        time: str | None,
        block_samples: int,
        quantities: DeclaredQuantities,
        clock_kind: ClockKind | None,
    ) -> None:
        self._time, self._given_hz = time, rate_hz
        self._stamps: dict[str, Stamps] = {}
        self._clocks: dict[str, tuple[Column, str]] = {}
        super().__init__(recording, self._with_clock(recording), chosen, Clock(1.0, ""), block_samples, quantities)
        groups = [self._group_of(name) for name in chosen]
        self._groups = frozenset(groups)
        self._reference = self._stamps_of(groups[0])
        kind = clock_kind or clock_kind_of(self._reference.first_s)
        step_s = self._reference.step_s
        # A rate of few digits is meant where the median of so many jittering steps allows it.
        uncertainty = 3 * self._reference.jitter / np.sqrt(self._reference.samples)
        nominal_hz = rate_hz or exact_rate_hz(step_s, float(uncertainty))
        origin = "given" if rate_hz else f"near the median step of {self._reference.column!r}"
        self._clock = Clock(nominal_hz, origin, None, self._reference.first_s, kind)
        self._span_s = self._common(chosen)
        self.first, self._end = self._limits()

    def _with_clock(self, recording: Recording) -> list[Column]:
        """The columns that a clock dates."""
        groups: dict[str, list[Column]] = {}
        for column in recording.columns:
            groups.setdefault(column.group, []).append(column)
        found: list[Column] = []
        for name, columns in groups.items():
            mine = self._time if self._time and any(self._is_time(column) for column in columns) else None
            clock, unit = find_time(columns, mine)
            if clock is not None:
                self._clocks[name] = clock, unit
                found += [column for column in columns if column.samples == clock.samples]
        return found

    def _is_time(self, column: Column) -> bool:
        return bool({column.name, *column.aliases} & {self._time, split_unit(self._time or "")[0]})

    def _stamps_of(self, group: str) -> Stamps:
        if group not in self._stamps:
            column, unit = self._clocks[group]
            chunks = guarded(self._recording.chunks([column], 1 << 16), self._recording.path, self.format)
            self._stamps[group] = stamps_of(column, unit, chunks, self._given_hz, rate_in_file(self.scalars))
        return self._stamps[group]

    def _group_of(self, name: str) -> str:
        """The group of a channel, or of all channels of an expression."""
        found = self._found([name])[name]
        if isinstance(found, Column):
            return found.group
        groups = {part: column.group for part, column in self._columns_of(found).items()}
        if found.before or len(set(groups.values())) > 1:
            why = "takes differences" if found.before else "computes from channels of different clocks"
            raise RecordingError(
                "clocks-differ",
                f"{name!r} {why}, which needs samples at regular times",
                "name recorded channels",
                channel=name,
                groups=list(groups.values()),
            )
        return next(iter(groups.values()))

    def _common(self, names: Sequence[str]) -> tuple[float, float]:
        """Seconds from the first stamp of the reference in which all of these channels are recorded."""
        of = {name: self._stamps_of(self._group_of(name)) for name in names}
        ends = np.array([one.since(np.array([one.first, one.last]), self._reference) for one in of.values()])
        latest, earliest = int(np.argmax(ends[:, 0])), int(np.argmin(ends[:, 1]))
        begin_s, end_s = float(ends[latest, 0]), float(ends[earliest, 1])
        if begin_s >= end_s:
            late, early = (list(of)[at] for at in (latest, earliest))
            raise RecordingError(
                "clocks-apart",
                f"channel {early!r} ends at {of[early].last_s:.9g} s, before {late!r} begins at "
                f"{of[late].first_s:.9g} s: they have no common time",
                "choose channels that were recorded together, with clocks that count from the same moment",
                channels=[early, late],
            )
        return begin_s, end_s

    def _limits(self) -> tuple[int, int]:
        rate_hz = self.rate_hz
        first, last = (self._span_s[0] * rate_hz, self._span_s[1] * rate_hz)
        return max(0, int(np.ceil(first - 1e-6))), int(np.floor(last + 1e-6)) + 1

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The channels of the clocks in use, in the order of the file; then the names of `naming`."""
        clocks = [column for column, _ in self._clocks.values()]
        own = [one for one in self._columns if one.group in self._groups and one not in clocks and not one.temporal]
        return (*(self._label(column, column.name) for column in own), *self._named)

    @property
    def skipped(self) -> tuple[Skipped, ...]:
        """What else is in the file, and why it is not a channel."""
        listed = {column.name for column in self._columns}
        other = [Skipped(c.name, "no time column dates it") for c in self._recording.columns if c.name not in listed]
        return (*self._recording.skipped, *(one for one in other if one.name not in self.scalars))

    @property
    def other_clocks(self) -> Mapping[str, tuple[str, ...]]:
        """Channels of the file that are sampled by clocks that are not in use, by their time column."""
        return {
            clock.name: tuple(one.name for one in self._columns if one.group == group and one is not clock)
            for group, (clock, _) in self._clocks.items()
            if group not in self._groups
        }

    @property
    def samples(self) -> int:
        """Samples of the common grid."""
        return self.stop - self.first

    @property
    def stop(self) -> int:
        """Number of the sample after the last one in which all channels are recorded."""
        return self._end if self._stop is None else min(self._stop, self._end)

    @property
    def is_part(self) -> bool:
        return (self.first, self.stop) != self._limits()

    def clocks(self, names: Sequence[str]) -> list[ClockGroup]:
        """The clocks of these channels."""
        groups: dict[str, list[str]] = {}
        for name in names:
            groups.setdefault(self._group_of(name), []).append(name)
        return [ClockGroup(self._stamps_of(group), tuple(those)) for group, those in groups.items()]

    def at_rate(self, rate_hz: float) -> UnevenLog:
        """The same recording with a common grid of this rate."""
        other = copy(self)
        other._clock = Clock(rate_hz, self.rate_origin, None, self.origin_s, self.clock_kind)
        other.first, other._end = other._limits()
        other._stop = None
        return other

    def pieces(self, names: Sequence[str]) -> Iterator[tuple[Floats, Floats]]:
        """Times and samples of channels of one clock: seconds since sample 0 of the grid, and (channels, samples)."""
        found = self._found(names)
        group = self._group_of(names[0])
        stamps, (clock, _) = self._stamps_of(group), self._clocks[group]
        parts: dict[str, Column] = {}
        for name, one in found.items():
            parts |= self._columns_of(one) if isinstance(one, Expression) else {name: one}
        labels = [self._label(column, name) for name, column in parts.items()]
        wraps = {name: Unwrapping(self.wraps[c.name].turn) for name, c in parts.items() if c.name in self.wraps}
        turns = {name: dict[int, Unwrapping]() for name in found}
        for time, *values in self._read([clock, *parts.values()], _ROWS):
            data = dict(zip(parts, in_si(stacked(values), labels)))
            data |= {name: one.process(data[name]) for name, one in wraps.items()}
            rows = [
                one.values(data, np.nan, turns[name]) if isinstance(one, Expression) else data[name]
                for name, one in found.items()
            ]
            yield stamps.since(_exact(time), self._reference), np.array(rows)

    def _rows_of(self, columns: Sequence[str]) -> Iterator[dict[str, Floats]]:
        for name in columns:
            for _, (values,) in self.pieces([name]):
                yield {name: values}

    def blocks(self, channels: Sequence[str] | None = None, block_samples: int | None = None) -> Iterator[Block]:
        """Interpolated samples of `channels` on the common grid; see `Log.blocks`."""
        names = list(self._chosen if channels is None else channels)
        if not names:
            raise UsageError("missing", "channels is empty", "name at least one channel", argument="channels")
        labels = self._labels(self._found(names))
        return self._resampled(names, labels, block_samples or self._block_samples)

    def _resampled(self, names: Sequence[str], labels: tuple[Channel, ...], size: int) -> Iterator[Block]:
        clocks = self.clocks(names)
        resamplers = [Resampler(self.pieces(one.channels), one.stamps.step_s) for one in clocks]
        order = [name for one in clocks for name in one.channels]
        rows = [order.index(name) for name in names]
        for first in range(self.first, self.stop, size):
            time_s = np.arange(first, min(first + size, self.stop)) / self.rate_hz
            data = np.concatenate([one.at(time_s) for one in resamplers])[rows]
            yield Block(data, labels, self.rate_hz, start=first, origin_s=self.origin_s)


def _most(recording: Recording, time: str | None) -> list[str]:
    """The channels of the clock that has the most values, or of this one."""
    columns = together(recording, None, time)
    clock, _ = find_time(columns, time)
    return [column.name for column in columns if column is not clock and not column.temporal]


def _exact(time: NDArray[Any]) -> NDArray[Any]:
    return time.astype(np.int64, copy=False) if time.dtype.kind in "iub" else time


def uneven_log_of(
    recording: Recording,
    channels: Sequence[str],
    *,
    rate_hz: float | None = None,
    time: str | None = None,
    block_samples: int = 65536,
    quantities: DeclaredQuantities | None = None,
    clock: ClockKind | None = None,
) -> UnevenLog:
    """The log of a recording whose channels have clocks of their own, or a clock that jitters.

    Parameters
    ----------
    recording
        As `open_file` returns it.
    time, block_samples, quantities, clock
        As for `log_of`.
    channels
        Channels in use, the reference first; their common time is what is read. If none is named, those that `open_log`
        chooses.
    rate_hz
        Rate of the common grid. Default: that of the median step of the reference's clock.

    Raises
    ------
    RecordingError
        Where `open_log` does so, except that a clock may have any increasing times; or if the channels have no common
        time.
    """
    with located(recording.place):
        everything = recording.columns
        for name in channels:
            found_channel(name, everything, everything)
        declared = quantities or DeclaredQuantities()
        declared = declared.renamed({name: resolve(name, everything, everything).name for name in declared.names})
        chosen = list(channels) or _most(recording, time)
        return UnevenLog(recording, chosen, rate_hz, time, block_samples, declared, clock)
