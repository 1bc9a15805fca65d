"""ROS 2 bag in SQLite (.db3): read by rosbags."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar

from livebode.sources import truncated
from livebode_drives.recordings.ros import RosRecording
from livebode_drives.recordings.rostypes import Topic

LANGUAGES = {"MSG": "ros2msg", "IDL": "ros2idl"}


class RosbagRecording(RosRecording):
    """A database of a ROS 2 bag; see RosRecording."""

    format: ClassVar[str] = "rosbag"

    def _messages_in(self, part: Path) -> Iterator[tuple[Topic, int, bytes]]:
        from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader

        check_size(part)
        reader = Sqlite3Reader(part)
        reader.open()
        try:
            topics = {}
            for source in reader.connections:
                encoding = getattr(source.ext, "serialization_format", "")
                unreadable = "" if encoding == "cdr" else f"its messages are encoded as {encoding!r}, not cdr"
                language = LANGUAGES.get(source.msgdef.format.name, "")
                topics[source.id] = Topic(source.topic, source.msgtype, source.msgdef.data, language, unreadable)
            for connection, time_ns, raw in reader.messages(reader.connections):
                yield topics[connection.id], time_ns, raw
        finally:
            reader.close()


def check_size(part: Path) -> None:
    """RecordingError if the database declares more than the file has."""
    with part.open("rb") as file:
        head = file.read(32).ljust(32, b"\0")
    page_bytes, pages = int.from_bytes(head[16:18], "big"), int.from_bytes(head[28:32], "big")
    declared = (65536 if page_bytes == 1 else page_bytes) * pages
    if declared > part.stat().st_size:
        raise truncated(f"the database declares {declared} bytes, more than there are", declared=declared)
