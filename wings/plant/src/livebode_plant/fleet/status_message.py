"""Status messages: the state of each axis of a partition, once a second, as bytes for the fleet page.

A message has a header, a body and the CRC-32 of both. All numbers are little endian.

| byte | type | what |
|---|---|---|
| 0 | 4 bytes | `LBST` |
| 4 | u8 | version, 1 |
| 5 | u8 | kind: 0 status, 1 names |
| 6 | u16 | partition |
| 8 | u32 | table: CRC-32 of the body of the names that the axes are numbered in |
| 12 | u32 | number of axes in the body |
| 16 | f64 | when it was sent, seconds since 1970 |
| 24 | u64 | messages of the log that wait for the partition |
| 32 | f32 | age of the oldest of them, s |
| 36 | u32 | length of the body, bytes |
| 40 | | body |
| end | u32 | CRC-32 of everything before |

The body of a status has 52 bytes for each axis, `AXIS_STATUS`, ordered by the axis's number. The body of names is
compressed JSON (zlib), `PartitionNames`. Names are sent when they change, and every few seconds for pages that
opened later.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Mapping
from math import nan
from typing import TYPE_CHECKING, Any, Final, Literal
from urllib.parse import urlsplit

import numpy as np

from livebode.dataclass import dataclass
from livebode_plant.fleet.subjects import axis_path

if TYPE_CHECKING:
    from livebode_plant.fleet.axis_stream import AxisStream
    from livebode_plant.fleet.main_quantity import MainQuantity

State = Literal["open", "ok", "check", "alarm"]
STATES: Final[tuple[State, ...]] = ("open", "ok", "check", "alarm")
"""Verdict on an axis, by its number in a message; open: not assessed."""
PRIORITIES: Final = ("none", "low", "medium", "high")
SILENT, NOT_READY, BEHIND, GAPS, ACTIVE = 1, 2, 4, 8, 16
"""Flags: no samples arrive; the machine is not ready; later than it should be; samples are missing; alarm present."""
_FLAGS = SILENT | NOT_READY | BEHIND | GAPS | ACTIVE

AXIS_STATUS: Final = np.dtype(
    [
        ("axis", "<u4"),
        ("state", "u1"),
        ("priority", "u1"),
        ("flags", "u1"),
        ("kind", "u1"),
        ("effective_s", "<f8"),
        ("lost", "<u8"),
        ("lag_s", "<f4"),
        ("value", "<f4"),
        ("bound", "<f4"),
        ("change_percent", "<f4"),
        ("raised", "<u4"),
        ("raised_s", "<u4"),
        ("gaps", "<u4"),
    ]
)
"""An axis: its number; numbers in STATES and PRIORITIES; flags; number of the alarm's kind in the names; newest
effective time, seconds since 1970 (NaN: none); lost samples; lag; main parameter and its 95 % bound, NaN if not fitted;
its change from the baseline; how often an alarm was raised, and when last, seconds since 1970; number of gaps."""

AXES_MAX: Final = 1 << 14
MESSAGE_BYTES_MAX: Final = 1 << 20
PARTITIONS_MAX: Final = 1 << 16
_NAMES_BYTES_MAX = 8 << 20
_TEXT_MAX = 300
_HEADER = struct.Struct("<4sBBHIIdQfI")
_CRC = struct.Struct("<I")
_MAGIC, _VERSION, _STATUS, _NAMES = b"LBST", 1, 0, 1


class StatusError(ValueError):
    """Bytes from the network that are not a status message; they are dropped and counted."""


@dataclass(frozen=True)
class AxisName:
    """What a page shows of an axis that does not change each second.

    Attributes
    ----------
    path
        Site, line, machine and axis, joined by "/".
    parameter, unit
        Name and unit of its main parameter; empty without a fit.
    url
        Address (http or https) of its own page; empty if there is none.
    """

    path: str
    parameter: str = ""
    unit: str = ""
    url: str = ""


@dataclass(frozen=True)
class PartitionNames:
    """The axes of a partition in the order of their numbers, the kinds of alarm, and the worker that owns it."""

    partition: int
    worker: str
    axes: tuple[AxisName, ...]
    kinds: tuple[str, ...]
    table: int = 0


@dataclass(frozen=True)
class PartitionStatus:
    """One message of a partition; `body` has the bytes of its axes, whose values are not checked yet."""

    partition: int
    table: int
    count: int
    at_s: float
    waiting: int
    lag_s: float
    body: bytes

    @property
    def axes(self) -> np.ndarray[Any, Any]:
        """Axes of the message, `AXIS_STATUS`."""
        return np.frombuffer(self.body, AXIS_STATUS)


def encode_status(
    partition: int, table: int, axes: np.ndarray[Any, Any], at_s: float, waiting: int = 0, lag_s: float = 0.0
) -> bytes:
    """The message of a partition; `axes` has the type `AXIS_STATUS`, ordered by number, at most `AXES_MAX`."""
    body = np.ascontiguousarray(axes, AXIS_STATUS).tobytes()
    return _packed(_STATUS, partition, table, len(axes), at_s, waiting, lag_s, body)


def encode_names(names: PartitionNames, at_s: float) -> tuple[bytes, int]:
    """The message of the names of a partition, and the number of their table."""
    rows = [[axis.path, axis.parameter, axis.unit, axis.url] for axis in names.axes]
    text = json.dumps({"worker": names.worker, "axes": rows, "kinds": names.kinds}, ensure_ascii=False)
    body = zlib.compress(text.encode())
    table = zlib.crc32(body)
    return _packed(_NAMES, names.partition, table, len(rows), at_s, 0, 0.0, body), table


def names_table(message: bytes) -> tuple[int, int]:
    """Partition and table of a message of names, from its unchecked header; (-1, 0) of any other."""
    if len(message) < _HEADER.size or message[:4] != _MAGIC or message[5] != _NAMES:
        return -1, 0
    _, _, _, partition, table, *_ = _HEADER.unpack_from(message)
    return partition, table


def decode(message: bytes) -> PartitionStatus | PartitionNames:
    """The content of a message; of a status, everything but the values of its axes is checked.

    Raises
    ------
    StatusError
        If it is not a whole message of this version.
    """
    if not _HEADER.size + _CRC.size <= len(message) <= MESSAGE_BYTES_MAX:
        raise StatusError("size")
    magic, version, kind, partition, table, count, at_s, waiting, lag_s, length = _HEADER.unpack_from(message)
    if (magic, version) != (_MAGIC, _VERSION) or len(message) != _HEADER.size + length + _CRC.size:
        raise StatusError("header")
    if _CRC.unpack_from(message, len(message) - _CRC.size)[0] != zlib.crc32(message[: -_CRC.size]):
        raise StatusError("damaged")
    if not 0 <= at_s < 1e11 or not 0 <= lag_s < 1e9 or count > AXES_MAX:
        raise StatusError("values")
    body = message[_HEADER.size : -_CRC.size]
    if kind == _STATUS and length == count * AXIS_STATUS.itemsize:
        return PartitionStatus(partition, table, count, at_s, waiting, lag_s, body)
    if kind == _NAMES and table == zlib.crc32(body):
        return _names(partition, table, count, body)
    raise StatusError("body")


def usable(axes: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Which rows of `AXIS_STATUS` have values within their ranges, shape (axes,)."""
    good = axes["state"] < len(STATES)
    good &= axes["priority"] < len(PRIORITIES)
    good &= axes["flags"] <= _FLAGS
    good &= (axes["lag_s"] >= 0) & (axes["lag_s"] < 1e9)
    for name in ("effective_s", "value", "bound", "change_percent"):
        good &= ~np.isinf(axes[name])
    return np.asarray(good)


def _packed(
    kind: int, partition: int, table: int, count: int, at_s: float, waiting: int, lag_s: float, body: bytes
) -> bytes:
    head = _HEADER.pack(_MAGIC, _VERSION, kind, partition, table, count, at_s, waiting, lag_s, len(body))
    return head + body + _CRC.pack(zlib.crc32(head + body))


def _names(partition: int, table: int, count: int, body: bytes) -> PartitionNames:
    try:
        unpacking = zlib.decompressobj()
        text = unpacking.decompress(body, _NAMES_BYTES_MAX)
        if not unpacking.eof:
            raise StatusError("names too long")
        content = json.loads(text)
        worker, kinds = _text(content["worker"]), tuple(map(_text, content["kinds"]))
        axes = tuple(AxisName(*map(_text, row)) for row in content["axes"])
    except StatusError:
        raise
    except (zlib.error, ValueError, TypeError, KeyError, RecursionError):
        raise StatusError("names") from None
    if len(axes) != count or len(kinds) > 255 or not all(_named(axis) for axis in axes):
        raise StatusError("names")
    return PartitionNames(partition, worker, axes, kinds, table)


def _named(axis: AxisName) -> bool:
    levels = axis.path.split("/")
    known = not axis.url or (urlsplit(axis.url).scheme in ("http", "https") and axis.url.isprintable())
    return known and 1 <= len(levels) <= 4 and all(levels)


def _text(value: object) -> str:
    if not isinstance(value, str) or len(value) > _TEXT_MAX or not value.isprintable():
        raise StatusError("names")
    return value


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
        messages = []
        for key, stream in streams.items():
            if key not in self._known:
                self._known[key] = _Losses(AxisName(axis_path(key)), stream.lost)
            if stream.main is not None:
                losses = self._known[key]
                losses.name = _renamed(losses.name, stream.main)
        names = tuple(losses.name for losses in self._known.values())
        if names != self._named:
            self._named = names
            about = PartitionNames(self._partition, self._worker, names, KINDS)
            self._names, self._table = encode_names(about, now_s)
            self._named_s = float("-inf")
        if self._names and now_s - self._named_s >= NAMES_EVERY_S:
            self._named_s = now_s
            messages.append((f"{NAMES}.{self._partition}", self._names))
        each = enumerate(self._known.items())
        rows = [_row(i, streams[key], losses, now_s, waiting > 0, lag_s) for i, (key, losses) in each]
        status = encode_status(self._partition, self._table, np.array(rows, AXIS_STATUS), now_s, waiting, lag_s)
        return [*messages, (f"{VIEW}.{self._partition}", status)] if self._names else messages


def _renamed(name: AxisName, main: MainQuantity) -> AxisName:
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
