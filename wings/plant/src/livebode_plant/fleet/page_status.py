"""PageStatus: what the owner of a partition sends to the page of the fleet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import nan

import numpy as np

from livebode_plant.fleet.axis_stream import AxisStream
from livebode_plant.fleet.main_quantity import MainQuantity
from livebode_plant.fleet.status_message import (
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
from livebode_plant.fleet.subjects import axis_path

VIEW, NAMES = "view", "names"
"""First tokens of the subjects; the second is the partition. They are not stored: a page asks for nothing older."""
NAMES_EVERY_S = 5.0
SILENT_S, BEHIND_S = 5.0, 2.0
KINDS = ("", "loss", "change", "failure")


@dataclass
class _Losses:
    """Name of an axis, its gaps since this process owns it, and when the newest alarm of it was raised."""

    name: AxisName
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
        for key, stream in streams.items():
            if key not in self._known:
                self._known[key] = _Losses(AxisName(axis_path(key)), stream.lost)
            if stream.main is not None:
                losses = self._known[key]
                losses.name = _named(losses.name, stream.main)
        names = tuple(losses.name for losses in self._known.values())
        if names != self._named:
            self._named = names
            about = PartitionNames(self._partition, self._worker, names, KINDS)
            self._names, self._table = encode_names(about, now_s)
            self._named_s = float("-inf")
        if self._names and now_s - self._named_s >= NAMES_EVERY_S:
            self._named_s = now_s
            found.append((f"{NAMES}.{self._partition}", self._names))
        each = enumerate(self._known.items())
        rows = [_row(i, streams[key], losses, now_s, waiting > 0, lag_s) for i, (key, losses) in each]
        status = encode_status(self._partition, self._table, np.array(rows, AXIS_STATUS), now_s, waiting, lag_s)
        return [*found, (f"{VIEW}.{self._partition}", status)] if self._names else found


def _named(name: AxisName, main: MainQuantity) -> AxisName:
    return name if (name.parameter, name.unit) == (main.name, main.unit) else AxisName(name.path, main.name, main.unit)


def _row(
    number: int, stream: AxisStream, losses: _Losses, now_s: float, waits: bool, lag_s: float
) -> tuple[float, ...]:
    """An axis as `AXIS_STATUS`: one tuple, since each field of an array that is set alone costs as much."""
    if stream.lost > losses.lost:
        losses.lost, losses.gaps = stream.lost, losses.gaps + 1
        losses.raised, losses.raised_s = losses.raised + 1, now_s
    if stream.failure != losses.failure:
        losses.failure = stream.failure
        if stream.failure:
            losses.raised, losses.raised_s = losses.raised + 1, now_s
    detection = None if stream.failure else stream.detection
    changed = detection is not None and detection.active
    raised = losses.raised + stream.changes  # the changes are in the state: a takeover raises none again
    age_s = max(0.0, now_s - stream.log_s)
    flags = GAPS * (stream.lost > 0) | BEHIND * (waits and lag_s > BEHIND_S)
    flags |= ACTIVE * (bool(stream.failure) or changed)
    if not waits and age_s > SILENT_S:
        flags |= SILENT
    state = priority = kind = 0
    if detection is not None and detection.judges:
        state = STATES.index("alarm" if changed else "ok")
    if raised:
        about, urgent = _alarm(stream, losses, changed)
        kind, priority = KINDS.index(about), PRIORITIES.index(urgent)
    value = bound = change_percent = nan
    if stream.main is not None:
        value, bound, change_percent = stream.main.value, stream.main.bound, stream.main.change_percent
    raised_s = int(max(losses.raised_s, stream.changed_s))
    return (
        number, state, priority, flags, kind, stream.log_s, stream.lost, age_s, value, bound, change_percent,
        raised, raised_s, losses.gaps,
    )  # fmt: skip


def _alarm(stream: AxisStream, losses: _Losses, changed: bool) -> tuple[str, str]:
    """Kind and priority of the alarm to show: what is active, else what was raised last."""
    if stream.failure:
        return "failure", "high"
    if changed or stream.changed_s > losses.raised_s:
        return "change", "high"
    return "loss", "medium"
