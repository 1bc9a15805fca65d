"""The messages of a ULog file, checked before pyulog reads them: what definitions expand to, and where data is."""

from __future__ import annotations

import io
import struct
from typing import IO, Any

from livebode.sources import COLUMNS_MAX, damaged, oversized

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
    at, appended = HEAD_BYTES, list[int]()
    while at + HEAD.size <= size:
        length, kind = HEAD.unpack(file.read(HEAD.size))
        after = at + HEAD.size + length
        if appended and after > appended[0]:  # what a crash cut off, before the data that was appended
            at = appended.pop(0)
            file.seek(at)
            continue
        if kind not in KINDS and not 0 < length <= UNKNOWN_BYTES_MAX:
            raise damaged(f"there is no message at byte {at}", byte=at)
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
        at = after
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
