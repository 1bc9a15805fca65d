"""PX4 ULog: topics parsed by pyulog, after a check of what their definitions expand to."""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import ModuleType
from typing import IO, Any, ClassVar

from livebode.sources import COLUMNS_MAX, Chunk, Column, Recording, Skipped, damaged, missing, oversized
from livebode_drives.recordings.silence import silence

HEAD = struct.Struct("<HB")
HEAD_BYTES = 16
KINDS = frozenset(b"FDIMPQARSOLCB")
UNKNOWN_BYTES_MAX = 10_000
"""A message of an unknown kind may be of a later version of the format, if it has a plausible size."""


def check(file: IO[bytes], size: int, ulog: Any) -> None:
    """RecordingError for a file that pyulog would guess at; one that ends inside a message is usual and accepted.

    pyulog expands nested arrays without a limit, and searches behind a damaged message byte by byte.

    Parameters
    ----------
    file
        The file at its beginning.
    size
        Its length in bytes.
    ulog
        The class of pyulog.
    """
    file.seek(0)
    definitions, topics = walk(file, size)
    formats = ulog(io.BytesIO(definitions), parse_header_only=True).message_formats
    width: dict[str, int] = {}
    total = 0
    for name in topics:
        if name not in formats:
            raise damaged(f"topic {name!r} has no definition", part=name)
        if ("uint64_t", 0, "timestamp") not in formats[name].fields:
            raise damaged(f"topic {name!r} has no timestamp of 64 bits", part=name)
        total += fields_of(name, formats, ulog._UNPACK_TYPES, width, ())
        if total > COLUMNS_MAX:
            raise oversized(f"its topics have more than {COLUMNS_MAX} fields", COLUMNS_MAX)


def walk(file: IO[bytes], size: int) -> tuple[bytes, list[str]]:
    """The definitions as a file of their own, and the topic of each subscription."""
    definitions = [file.read(HEAD_BYTES)]
    topics: list[str] = []
    position, appended = HEAD_BYTES, list[int]()
    while position + HEAD.size <= size:
        length, kind = HEAD.unpack(file.read(HEAD.size))
        after = position + HEAD.size + length
        if appended and after > appended[0]:  # what a crash cut off, before the data that was appended
            position = appended.pop(0)
            file.seek(position)
            continue
        if kind not in KINDS and not 0 < length <= UNKNOWN_BYTES_MAX:
            raise damaged(f"there is no message at byte {position}", byte=position)
        if after > size:
            break
        if kind in b"FAB":
            content = file.read(length)
            if kind == ord("A"):
                topics.append(content[3:].decode("utf-8", "ignore"))
            elif kind == ord("F"):
                definitions.append(HEAD.pack(length, kind) + content)
            else:
                appended = [offset for offset in struct.unpack_from("<3Q", content.ljust(40, b"\0"), 16) if offset]
        else:
            file.seek(length, io.SEEK_CUR)
        position = after
    return b"".join(definitions), topics


def fields_of(name: str, formats: Any, kinds: Any, width: dict[str, int], within: tuple[str, ...]) -> int:
    """Fields that a definition expands to, without expanding it."""
    if name in kinds:
        return 1
    if name in width:
        return width[name]
    if name in within or name not in formats:
        raise damaged(f"definition {name!r} {'contains itself' if name in within else 'is missing'}", part=name)
    count = sum(
        max(repeated, 1) * fields_of(inner, formats, kinds, width, (*within, name))
        for inner, repeated, _ in formats[name].fields
    )
    width[name] = min(count, COLUMNS_MAX + 1)
    return width[name]


TIME = "timestamp"
US_PER_S = 1e6
UNITS = {TIME: "s"}


class ULogRecording(Recording):
    """A ULog file. A channel is topic.field, and topic[k].field for the instances of a topic after the first.

    Every topic has a clock of its own, `topic.timestamp` in seconds. The initial parameters are scalars. The topics are
    in memory, about the size of the file.
    """

    format: ClassVar[str] = "ulog"

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        log = parsed(path)
        self.scalars = {name: float(value) for name, value in log.initial_parameters.items()}
        columns: list[Column] = []
        skipped: list[Skipped] = []
        for topic in log.data_list:
            add_topic(topic, columns, skipped)
        self.columns, self.skipped = tuple(columns), tuple(skipped)

    def chunks(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        for first in range(0, columns[0].samples or 0, rows):
            parts = [(column, column.key[first : first + rows]) for column in columns]
            yield [part / US_PER_S if column.clock else part for column, part in parts]


def add_topic(topic: Any, columns: list[Column], skipped: list[Skipped]) -> None:
    """Columns of one instance of a topic; the first instance can also be written as topic[0]."""
    group = f"{topic.name}[{topic.multi_id}]" if topic.multi_id else topic.name
    for field in topic.field_data:
        name = field.field_name
        if field.type_str == "char":
            skipped.append(Skipped(f"{group}.{name}", "it is text"))
        elif not name.startswith("_padding"):
            clock = name == TIME
            indexed = () if topic.multi_id else (f"{topic.name}[0].{name}",)
            values = topic.data[name]
            unit = UNITS.get(name, "us" if name.startswith(TIME) else "")
            columns.append(Column(f"{group}.{name}", unit, len(values), (name, *indexed), False, values, group, clock))


def parsed(path: Path) -> Any:
    """The file as pyulog reads it; RecordingError if it is damaged apart from an early end."""
    pyulog = import_pyulog(path)
    with path.open("rb") as file:
        check(file, path.stat().st_size, pyulog.ULog)
        file.seek(0)
        log = pyulog.ULog(file)
    if log.file_corruption:
        raise damaged("a message contradicts its definition")
    return log


def import_pyulog(path: Path) -> ModuleType:
    try:
        import pyulog
        import pyulog.core
    except ImportError:
        raise missing(path, "pyulog", "ulog") from None
    silence(pyulog.core)
    return pyulog  # type: ignore[no-any-return]
