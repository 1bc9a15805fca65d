"""PageStatus: what the owner of a partition sends to the page of the fleet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from livebode.fleet.axis_stream import AxisStream
from livebode.fleet.status_message import (
    ACTIVE,
    AXIS_STATUS,
    BEHIND,
    GAPS,
    PRIORITIES,
    SILENT,
    AxisName,
    PartitionNames,
    encode_names,
    encode_status,
)
from livebode.fleet.subjects import axis_path

VIEW, NAMES = "view", "names"
"""First tokens of the subjects; the second is the partition. They are not stored: a page asks for nothing older."""
NAMES_EVERY_S = 5.0
SILENT_S, BEHIND_S = 5.0, 2.0
KINDS = ("", "loss", "failure")


@dataclass
class _Losses:
    """Gaps of an axis since this process owns it, and when the newest alarm of it was raised."""

    lost: int
    gaps: int = 0
    raised: int = 0
    raised_s: float = 0.0
    failure: str = ""


class PageStatus:
    """Encodes the state of the axes of a partition, and their names when they change and every few seconds.

    Parameters
    ----------
    partition
        Its number.
    worker
        Name of its owner.
    """

    def __init__(self, partition: int, worker: str) -> None:
        self._partition, self._worker = partition, worker
        self._known: dict[str, _Losses] = {}
        self._names, self._table, self._named_s = b"", 0, float("-inf")

    def messages(
        self, streams: Mapping[str, AxisStream], now_s: float, waiting: int, lag_s: float
    ) -> list[tuple[str, bytes]]:
        """Subjects and messages of this moment, seconds since 1970; `waiting` of the log's messages are `lag_s` old."""
        found = []
        if new := [key for key in streams if key not in self._known]:
            self._known |= {key: _Losses(streams[key].lost) for key in new}
            axes = tuple(AxisName(axis_path(key)) for key in self._known)
            names = PartitionNames(self._partition, self._worker, axes, KINDS)
            self._names, self._table = encode_names(names, now_s)
            self._named_s = float("-inf")
        if self._names and now_s - self._named_s >= NAMES_EVERY_S:
            self._named_s = now_s
            found.append((f"{NAMES}.{self._partition}", self._names))
        rows = np.zeros(len(self._known), AXIS_STATUS)
        rows["axis"] = np.arange(len(rows))
        rows["value"] = rows["bound"] = rows["change_percent"] = np.nan
        for row, (key, losses) in zip(rows, self._known.items()):
            _fill(row, streams[key], losses, now_s, waiting > 0, lag_s)
        status = encode_status(self._partition, self._table, rows, now_s, waiting, lag_s)
        return [*found, (f"{VIEW}.{self._partition}", status)] if self._names else found


def _fill(row: np.void, stream: AxisStream, losses: _Losses, now_s: float, waits: bool, lag_s: float) -> None:
    if stream.lost > losses.lost:
        losses.lost, losses.gaps = stream.lost, losses.gaps + 1
        losses.raised, losses.raised_s = losses.raised + 1, now_s
    if stream.failure != losses.failure:
        losses.failure = stream.failure
        if stream.failure:
            losses.raised, losses.raised_s = losses.raised + 1, now_s
    row["lost"], row["gaps"] = stream.lost, losses.gaps
    row["raised"], row["raised_s"] = losses.raised, int(losses.raised_s)
    row["effective_s"], row["lag_s"] = stream.log_s, max(0.0, now_s - stream.log_s)
    row["flags"] = GAPS * (stream.lost > 0) | BEHIND * (waits and lag_s > BEHIND_S) | ACTIVE * bool(stream.failure)
    if not waits and row["lag_s"] > SILENT_S:
        row["flags"] |= SILENT
    if losses.raised:
        row["kind"] = KINDS.index("failure" if stream.failure else "loss")
        row["priority"] = PRIORITIES.index("high" if stream.failure else "medium")
