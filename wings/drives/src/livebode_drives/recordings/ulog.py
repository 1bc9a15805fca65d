"""PX4 ULog: topics parsed by pyulog, after a check of what their definitions expand to."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar

from livebode.sources import Chunk, Column, Recording, Skipped, damaged, missing
from livebode_drives.recordings.silence import silence
from livebode_drives.recordings.ulogcheck import check

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
