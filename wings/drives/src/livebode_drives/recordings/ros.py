"""Recordings of ROS 2, of one file or a directory: numbers in the messages of each topic, decoded by rosbags."""

from __future__ import annotations

import re
from abc import abstractmethod
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from livebode.core import RecordingError
from livebode.sources import COLUMNS_MAX, Chunk, Column, Recording, Skipped, located, missing, oversized, truncated
from livebode_drives.recordings.rostypes import SEQUENCES, Topic, store_of, unknown_type

SUFFIXES = ".mcap", ".db3"
METADATA = "metadata.yaml"
METADATA_BYTES_MAX = 1 << 24
LISTED = re.compile(r"^\s*-\s*[\"']?(?:[^\"'\n]*/)?([^/\"'\n]+?\.(?:mcap|db3)(?:\.zstd)?)[\"']?\s*$", re.MULTILINE)
"""A file in the metadata of a bag."""


def parts_of(path: Path) -> list[Path]:
    """The files of a bag by their numbers, also without metadata (its recorder was stopped); `path` itself if a file.

    None of a directory that is no bag.

    Raises
    ------
    RecordingError
        Where a bag is compressed as a whole, has files of two kinds, or not all that its metadata lists.
    """
    if not path.is_dir():
        return [path]
    parts = sorted((file for file in path.iterdir() if file.suffix in SUFFIXES and file.is_file()), key=in_order)
    if packed := sorted(file for file in path.glob("*.zstd") if file.stem.endswith(SUFFIXES)):
        raise RecordingError(
            "not-a-file", f"{packed[0]} is compressed as a whole", "decompress it with zstd -d", path=str(packed[0])
        )
    if len({part.suffix for part in parts}) > 1:
        raise RecordingError(
            "not-a-file", f"{path} has files of two kinds, .mcap and .db3", "name one of the files", path=str(path)
        )
    for name in listed_in(path / METADATA):
        if not (path / name).is_file():
            raise truncated(f"{path} has no file {name}, which its {METADATA} lists", path=str(path), part=name)
    return parts


def in_order(part: Path) -> list[tuple[int, str]]:
    """
    >>> sorted([Path("a_10.mcap"), Path("a_9.mcap")], key=in_order)[0].name
    'a_9.mcap'
    """
    return [(int(text), "") if text.isdecimal() else (-1, text) for text in re.split(r"(\d{1,18})", part.name)]


def listed_in(metadata: Path) -> list[str]:
    """Names of the files that the metadata of a bag lists; empty without metadata."""
    if not metadata.is_file():
        return []
    with metadata.open("rb") as file:
        return LISTED.findall(file.read(METADATA_BYTES_MAX).decode("utf-8", "replace"))


WIDTH_MAX = 64
"""A longer array in a message is an image or a scan, not a set of channels."""
HEADER = "std_msgs/msg/Header"
LOGGED: tuple[str | int, ...] = ("logged",)
STAMP: tuple[str | int, ...] = ("header", "stamp")
INTEGERS = (f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64))
NUMBERS = frozenset(("bool", "byte", "char", "float32", "float64", *INTEGERS))
NS_PER_S = 1_000_000_000


class RosRecording(Recording):
    """A recording of ROS 2: a file, or the directory of a bag.

    A channel is topic.field, with nested fields after dots and elements of arrays as [0].

    Every topic has a clock of its own: `topic.header.stamp` where its messages have one that is set, otherwise
    `topic.logged`, the time at which the message was recorded.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        import_rosbags(path)
        self._parts = parts_of(path)
        count: Counter[Topic] = Counter()
        first: dict[Topic, bytes] = {}
        last: dict[Topic, bytes] = {}
        for topic, _, raw in self._messages():
            count[topic] += 1
            first.setdefault(topic, raw)
            last[topic] = raw
        columns: list[Column] = []
        skipped: list[Skipped] = []
        for topic in sorted(first, key=lambda entry: entry.name):
            if why := topic.unreadable or unknown_type(topic):
                skipped.append(Skipped(topic.name, why))
            else:
                columns += topic_columns(topic, (first[topic], last[topic]), count[topic], skipped)
            if len(columns) > COLUMNS_MAX:
                raise oversized(f"{path} has more than {COLUMNS_MAX} fields", COLUMNS_MAX)
        self.columns, self.skipped = tuple(columns), tuple(skipped)

    def _messages(self) -> Iterator[tuple[Topic, int, bytes]]:
        """Topic, time of recording in ns, and content of each message, file by file."""
        for part in self._parts:
            with located(part):
                yield from self._messages_in(part)

    @abstractmethod
    def _messages_in(self, part: Path) -> Iterator[tuple[Topic, int, bytes]]:
        """The messages of one file."""

    def chunks(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        topic = columns[0].key[0]
        decode = store_of(topic).deserialize_cdr
        held: list[list[Any]] = []
        for message_topic, time_ns, raw in self._messages():
            if message_topic != topic:
                continue
            message = decode(raw, topic.type)
            held.append([value_at(message, column.key[1], time_ns) for column in columns])
            if len(held) == rows:
                yield arrays(columns, held)
                held = []
        if held:
            yield arrays(columns, held)


def arrays(columns: Sequence[Column], rows: list[list[Any]]) -> Chunk:
    return [
        np.array(values, dtype=np.int64 if column.temporal else np.float64)
        for column, values in zip(columns, zip(*rows, strict=True), strict=True)
    ]


def value_at(message: Any, path: tuple[str | int, ...], time_ns: int) -> Any:
    """The number at `path` in a message; NaN where a sequence is shorter than in the first message."""
    if path == LOGGED:
        return time_ns
    for part in path:
        if isinstance(part, str):
            message = getattr(message, part)
        elif part < len(message):
            message = message[part]
        else:
            return float("nan")
    return message.sec * NS_PER_S + message.nanosec if path == STAMP else message


def topic_columns(topic: Topic, ends: tuple[bytes, bytes], samples: int, skipped: list[Skipped]) -> list[Column]:
    """The clocks and numbers of a topic from its first and last message; sequences are as long as in the first."""
    store = store_of(topic)
    message, last = (store.deserialize_cdr(raw, topic.type) for raw in ends)
    fields = dict(store.fielddefs[topic.type][1])
    stamped = fields.get("header", (0, ""))[1] == HEADER
    clock = STAMP if stamped and value_at(last, STAMP, 0) else LOGGED

    def column(path: tuple[str | int, ...], temporal: bool) -> Column:
        text = path_text(path)
        key, unit = (topic, path), "ns" if temporal else ""
        return Column(f"{topic.name}.{text}", unit, samples, (text,), temporal, key, topic.name, path == clock)

    columns = [column(path, True) for path in ((LOGGED, STAMP) if stamped else (LOGGED,))]
    for path, why in numbers_in(store, topic.type, message, ()):
        if why:
            skipped.append(Skipped(f"{topic.name}.{path_text(path)}", why))
        elif path[:2] != STAMP or not stamped:
            columns.append(column(path, False))
        if len(columns) > COLUMNS_MAX:
            raise oversized(f"topic {topic.name!r} has more than {COLUMNS_MAX} fields", COLUMNS_MAX)
    return columns


def path_text(path: tuple[str | int, ...]) -> str:
    """A path as it is written.

    >>> path_text(("pose", "covariance", 3))
    'pose.covariance[3]'
    """
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).removeprefix(".")


def numbers_in(
    store: Any, type_: str, message: Any, parent: tuple[str | int, ...]
) -> Iterator[tuple[tuple[str | int, ...], str]]:
    """Paths of the numbers in a message, and of what is not a number with the reason."""
    from rosbags.interfaces import Nodetype
    from rosbags.typesys.base import normalize_fieldname

    for field, (kind, detail) in store.fielddefs[type_][1]:
        name = normalize_fieldname(field)
        path, value = (*parent, name), getattr(message, name)
        repeated = kind in SEQUENCES
        inner, item_type = detail[0] if repeated else (kind, detail)
        if inner == Nodetype.BASE and item_type[0] not in NUMBERS:
            yield path, f"it is of type {item_type[0]}"
        elif repeated and len(value) > WIDTH_MAX:
            yield path, f"it has {len(value)} elements, more than {WIDTH_MAX}"
        else:
            places = [((*path, k), item) for k, item in enumerate(value)] if repeated else [(path, value)]
            for place, item in places:
                if inner == Nodetype.NAME:
                    yield from numbers_in(store, item_type, item, place)
                else:
                    yield place, ""


def import_rosbags(path: Path) -> None:
    try:
        import rosbags  # noqa: F401
    except ImportError:
        raise missing(path, "rosbags", "ros") from None
