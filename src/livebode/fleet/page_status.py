"""PageStatus: what the owner of a partition sends to the page of the fleet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from livebode.fleet.axis_stream import AxisStream
from livebode.fleet.main_quantity import MainQuantity
from livebode.fleet.status_message import (
    ACTIVE,
    AXIS_STATUS,
    BEHIND,
    GAPS,
    PRIORITIES,
    SILENT,
    STATES,
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
KINDS = ("", "loss", "change", "failure")


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
        self._named: tuple[AxisName, ...] = ()
        self._names, self._table, self._named_s = b"", 0, float("-inf")

    def messages(
        self, streams: Mapping[str, AxisStream], now_s: float, waiting: int, lag_s: float
    ) -> list[tuple[str, bytes]]:
        """Subjects and messages of this moment, seconds since 1970; `waiting` of the log's messages are `lag_s` old."""
        found = []
        self._known |= {key: _Losses(one.lost) for key, one in streams.items() if key not in self._known}
        names = tuple(_named(key, streams[key].main) for key in self._known)
        if names != self._named:
            self._named = names
            about = PartitionNames(self._partition, self._worker, names, KINDS)
            self._names, self._table = encode_names(about, now_s)
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


def _named(key: str, main: MainQuantity | None) -> AxisName:
    return AxisName(axis_path(key)) if main is None else AxisName(axis_path(key), main.name, main.unit)


def _fill(row: np.void, stream: AxisStream, losses: _Losses, now_s: float, waits: bool, lag_s: float) -> None:
    if stream.lost > losses.lost:
        losses.lost, losses.gaps = stream.lost, losses.gaps + 1
        losses.raised, losses.raised_s = losses.raised + 1, now_s
    if stream.failure != losses.failure:
        losses.failure = stream.failure
        if stream.failure:
            losses.raised, losses.raised_s = losses.raised + 1, now_s
    detection = None if stream.failure else stream.detection
    changed = detection is not None and detection.active
    row["lost"], row["gaps"] = stream.lost, losses.gaps
    row["raised"] = losses.raised + stream.changes  # the changes are in the state: a takeover raises none again
    row["raised_s"] = int(max(losses.raised_s, stream.changed_s))
    row["effective_s"], row["lag_s"] = stream.log_s, max(0.0, now_s - stream.log_s)
    row["flags"] = GAPS * (stream.lost > 0) | BEHIND * (waits and lag_s > BEHIND_S)
    row["flags"] |= ACTIVE * (bool(stream.failure) or changed)
    if not waits and row["lag_s"] > SILENT_S:
        row["flags"] |= SILENT
    if detection is not None and detection.judges:
        row["state"] = STATES.index("alarm" if changed else "ok")
    if stream.main is not None:
        row["value"], row["bound"] = stream.main.value, stream.main.bound
        row["change_percent"] = stream.main.change_percent
    if row["raised"]:
        kind, priority = _alarm(stream, losses, changed)
        row["kind"], row["priority"] = KINDS.index(kind), PRIORITIES.index(priority)


def _alarm(stream: AxisStream, losses: _Losses, changed: bool) -> tuple[str, str]:
    """Kind and priority of the alarm to show: what is active, else what was raised last."""
    if stream.failure:
        return "failure", "high"
    if changed or stream.changed_s > losses.raised_s:
        return "change", "high"
    return "loss", "medium"
