"""MCAP: its records are walked here from the beginning, so that no index is trusted; their messages are of ROS 2."""

from __future__ import annotations

import io
import struct
import sys
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO, ClassVar

from livebode.sources import damaged, oversized, truncated
from livebode_drives.recordings.ros import RosRecording
from livebode_drives.recordings.rostypes import Topic

MAGIC = b"\x89MCAP0\r\n"
RECORD = struct.Struct("<BQ")
FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK = 0x02, 0x03, 0x04, 0x05, 0x06
READ = SCHEMA, CHANNEL, MESSAGE, CHUNK
RECORD_BYTES_MAX = 1 << 28
PACKED_MAX = 1000
"""Highest plausible compression of a chunk: its messages differ at least by their times."""


class McapRecording(RosRecording):
    """An MCAP file; see RosRecording."""

    format: ClassVar[str] = "mcap"

    def _messages_in(self, part: Path) -> Iterator[tuple[Topic, int, bytes]]:
        schemas: dict[int, tuple[str, str, str]] = {}
        topics: dict[int, Topic] = {}
        with part.open("rb") as file:
            for kind, record in flat_records(file, part.stat().st_size):
                if kind == MESSAGE:
                    number, _, time_ns, _ = struct.unpack_from("<HIQQ", record)
                    if number not in topics:
                        raise damaged(f"a message belongs to channel {number}, which is not defined", part=number)
                    yield topics[number], time_ns, record[22:]
                elif kind == SCHEMA:
                    number, fields = int.from_bytes(record[:2], "little"), record[2:]
                    schemas[number] = texts(fields)
                else:
                    number, schema = struct.unpack_from("<HH", record)
                    topics[number] = topic_of(texts(record[4:])[:2], schemas.get(schema, ("", "", "")))


def topic_of(channel: tuple[str, ...], schema: tuple[str, str, str]) -> Topic:
    (name, encoding), (type_, language, definition) = channel, schema
    unreadable = "" if encoding == "cdr" else f"its messages are encoded as {encoding!r}, not cdr"
    if definition and language not in ("ros2msg", "ros2idl", "omgidl"):
        unreadable = unreadable or f"its type is defined as {language!r}"
    return Topic(name, type_, definition, language, unreadable)


def texts(raw: bytes) -> tuple[str, str, str]:
    """Three texts, each behind its length."""
    words, position = [], 0
    for _ in range(3):
        length = int.from_bytes(raw[position : position + 4], "little")
        position += 4 + length
        if position > len(raw):
            raise damaged(f"a text of {length} bytes exceeds its record")
        words.append(raw[position - length : position].decode("utf-8", "replace"))
    return words[0], words[1], words[2]


def flat_records(file: IO[bytes], size: int) -> Iterator[tuple[int, bytes]]:
    """Schemas, channels and messages in the order of the file, also those in chunks."""
    file.seek(max(size - len(MAGIC), 0))
    if size < 2 * len(MAGIC) or file.read() != MAGIC:
        raise truncated("the file does not end as MCAP does")
    file.seek(len(MAGIC))
    for kind, record in records(file, size - len(MAGIC)):
        if kind != CHUNK:
            yield kind, record
            continue
        chunk = expanded(record)
        for inner, content in records(io.BytesIO(chunk), len(chunk)):
            if inner == CHUNK:
                raise damaged("a chunk contains a chunk")
            yield inner, content


def records(file: IO[bytes], end: int) -> Iterator[tuple[int, bytes]]:
    """Kind and content of the records that are read, from here to `end` or to the end of the data."""
    start = file.tell()
    while start < end:
        head = file.read(RECORD.size)
        if len(head) < RECORD.size:
            raise truncated(f"the record at byte {start} ends early", byte=start)
        kind, length = RECORD.unpack(head)
        if start + RECORD.size + length > end:
            raise truncated(f"the record at byte {start} declares {length} bytes, more than there are", byte=start)
        if kind == FOOTER:
            return
        if kind in READ:
            if length > RECORD_BYTES_MAX:
                raise oversized(f"the record at byte {start} has {length} bytes", RECORD_BYTES_MAX, byte=start)
            yield kind, file.read(length)
        start += RECORD.size + length
        file.seek(start)


def expanded(chunk: bytes) -> bytes:
    """The records in a chunk, never more bytes than it declares."""
    _, _, declared, checksum, length = struct.unpack_from("<QQQII", chunk)
    compression, packed = chunk[32 : 32 + length], chunk[32 + length + 8 :]
    if declared > min(RECORD_BYTES_MAX, PACKED_MAX * len(packed)):
        raise oversized(f"a chunk declares {declared} bytes", RECORD_BYTES_MAX, declared=declared)
    raw = decompressed(packed, compression, declared + 1)
    if len(raw) != declared or (checksum and zlib.crc32(raw) != checksum):
        raise damaged(f"a chunk does not have the {declared} bytes that it declares", declared=declared)
    return raw


def decompressed(packed: bytes, compression: bytes, most: int) -> bytes:
    import lz4.frame

    if sys.version_info >= (3, 14):
        from compression import zstd
    else:
        from backports import zstd

    if compression == b"lz4":
        return bytes(lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=most))
    if compression == b"zstd":
        return bytes(zstd.ZstdDecompressor().decompress(packed, max_length=most))
    if compression:
        raise damaged(f"a chunk is compressed by {compression[:20]!r}")
    return packed
