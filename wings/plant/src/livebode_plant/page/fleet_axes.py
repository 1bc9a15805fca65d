"""The axes of a fleet in arrays: one row each, from the status messages of all partitions."""

from __future__ import annotations

import re
import zlib
from collections.abc import Sequence
from dataclasses import field
from typing import Any

import numpy as np

from livebode.dataclass import dataclass
from livebode_plant.fleet.status_message import (
    AXIS_STATUS,
    AxisName,
    PartitionNames,
    PartitionStatus,
    StatusError,
    decode,
    names_table,
    usable,
)

AXES_MAX = 200_000
"""Axes of one page; names of more are dropped and counted."""
KINDS_MAX = 255
NOWHERE = -1
"""Partition of an axis that its partition no longer has."""
_DIGITS = re.compile(r"([0-9]{1,15})")
_BYTES = np.dtype((np.void, AXIS_STATUS.itemsize))
Array = np.ndarray[Any, Any]


@dataclass
class Partition:
    """What is known of a partition.

    Attributes
    ----------
    rows, kinds
        Row of each of its axes, and number in `FleetAxes.kinds` of each of its kinds of alarm, by their numbers in its
        messages.
    heard_s
        When its newest message arrived, by the page's clock; NaN if none has.
    """

    names: PartitionNames | None = None
    rows: Array = field(default_factory=lambda: np.zeros(0, np.int64))
    kinds: Array = field(default_factory=lambda: np.zeros(KINDS_MAX + 1, np.uint8))
    heard_s: float = float("nan")
    waiting: int = 0
    lag_s: float = 0.0


class FleetAxes:
    """Rows of axes, in the order of their first appearance; `order` is that in which they are shown.

    Attributes
    ----------
    status
        `AXIS_STATUS` of each row; `kind` is a number in `kinds`.
    partition
        Number of the partition of each row.
    dropped
        Messages that were not valid.
    version
        Changes with each new axis.
    """

    def __init__(self) -> None:
        self.names: list[AxisName] = []
        self.kinds: list[str] = [""]
        self.partitions: dict[int, Partition] = {}
        self.dropped = 0
        self.version = 0
        self._rows: dict[str, int] = {}
        self._keys: list[Any] = []
        self._status = np.zeros(0, AXIS_STATUS)
        self._partition = np.zeros(0, np.int64)
        self._ordered: tuple[int, Array, Array] = -1, np.zeros(0, np.int64), np.zeros(0, np.int64)

    def __len__(self) -> int:
        return len(self.names)

    @property
    def status(self) -> Array:
        return self._status[: len(self)]

    @property
    def partition(self) -> Array:
        return self._partition[: len(self)]

    @property
    def order(self) -> Array:
        """Rows in the order of the page: by site, line, machine and axis, numbers in names by their value."""
        return self._sorted()[1]

    @property
    def place(self) -> Array:
        """Place of each row in `order`."""
        return self._sorted()[2]

    def row(self, path: str) -> int | None:
        """Row of an axis; None if it is not known."""
        return self._rows.get(path)

    def process(self, messages: Sequence[bytes], now_s: float) -> None:
        """Process the newest status of each partition from messages; those that are not valid are counted."""
        newest: dict[int, PartitionStatus] = {}
        for message in messages:
            if self._repeated(message):
                continue
            try:
                content = decode(message)
            except StatusError:
                self.dropped += 1
                continue
            if isinstance(content, PartitionNames):
                self._name(content)
            else:
                newest[content.partition] = content
        known = [status for status in newest.values() if self._known(status)]
        if known:
            self._store(known, now_s)

    def _repeated(self, message: bytes) -> bool:
        """Whether a message has the names that are known: they come every few seconds, and cost more than a status."""
        partition, table = names_table(message)
        known = self.partitions.get(partition)
        return known is not None and known.names is not None and known.names.table == table

    def _known(self, status: PartitionStatus) -> bool:
        """Whether the names of a status are known; else they come within some seconds."""
        partition = self.partitions.setdefault(status.partition, Partition())
        if partition.names is not None and partition.names.table != status.table:
            partition.names = None
        return partition.names is not None

    def _store(self, messages: list[PartitionStatus], now_s: float) -> None:
        """All messages in one pass: a page has hundreds of partitions a second."""
        partitions = [self.partitions[message.partition] for message in messages]
        counts = np.array([message.count for message in messages])
        of = np.repeat(np.arange(len(messages)), counts)
        axes = np.frombuffer(b"".join(message.body for message in messages), AXIS_STATUS).copy()
        sizes = np.array([len(partition.rows) for partition in partitions])
        good = usable(axes) & (axes["axis"] < sizes[of])
        good[1:] &= (of[1:] != of[:-1]) | (axes["axis"][1:] > axes["axis"][:-1])
        wrong = np.bincount(of[~good], minlength=len(messages)) > 0
        self.dropped += int(np.count_nonzero(wrong))
        for message, partition, bad in zip(messages, partitions, wrong):
            if not bad:
                partition.heard_s, partition.waiting, partition.lag_s = now_s, message.waiting, message.lag_s
        if wrong.any():
            use = ~wrong[of]
            axes, of = axes[use], of[use]
        starts = np.concatenate([[0], np.cumsum(sizes)[:-1]])
        rows = np.concatenate([partition.rows for partition in partitions])[starts[of] + axes["axis"]]
        axes["kind"] = np.stack([partition.kinds for partition in partitions])[of, axes["kind"]]
        # As bytes: NumPy would copy a record field by field.
        self._status.view(_BYTES)[rows] = axes.view(_BYTES)

    def _name(self, names: PartitionNames) -> None:
        partition = self.partitions.setdefault(names.partition, Partition())
        new = [axis.path for axis in names.axes if axis.path not in self._rows]
        if len(self) + len(new) > AXES_MAX or len({axis.path for axis in names.axes}) < len(names.axes):
            self.dropped += 1
            return
        if partition.names is not None and partition.names == names:
            return
        partition.names = names
        self._partition[partition.rows[self._partition[partition.rows] == names.partition]] = NOWHERE
        partition.rows = np.array([self._row_of(axis) for axis in names.axes], np.int64)
        self._partition[partition.rows] = names.partition
        partition.kinds[: len(names.kinds)] = [self._kind(kind) for kind in names.kinds]
        if new:
            self.version = zlib.crc32("\n".join(new).encode(), self.version)

    def _row_of(self, axis: AxisName) -> int:
        row = self._rows.setdefault(axis.path, len(self.names))
        if row < len(self.names):
            self.names[row] = axis
            return row
        self.names.append(axis)
        self._keys.append(_sort_key(axis.path))
        if row >= len(self._status):
            more = max(1024, len(self._status))
            empty = np.zeros(more, AXIS_STATUS)
            for name in ("effective_s", "value", "bound", "change_percent"):
                empty[name] = np.nan
            self._status = np.concatenate([self._status, empty])
            self._partition = np.concatenate([self._partition, np.zeros(more, np.int64)])
        return row

    def _kind(self, kind: str) -> int:
        if kind not in self.kinds and len(self.kinds) < KINDS_MAX:
            self.kinds.append(kind)
        return self.kinds.index(kind) if kind in self.kinds else 0

    def _sorted(self) -> tuple[int, Array, Array]:
        if self._ordered[0] != self.version:
            order = np.array(sorted(range(len(self)), key=self._keys.__getitem__), np.int64)
            place = np.empty_like(order)
            place[order] = np.arange(len(order))
            self._ordered = self.version, order, place
        return self._ordered


def _sort_key(path: str) -> tuple[Any, ...]:
    """Numbers in names by their value: m9 before m10."""
    levels = (_DIGITS.split(level.casefold()) for level in path.split("/"))
    return tuple(tuple((0, int(p), "") if p.isdigit() else (1, 0, p) for p in parts) for parts in levels), path
