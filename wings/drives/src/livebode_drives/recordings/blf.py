"""BLF, the binary log of Vector: frames read by python-can, after a check of its containers."""

from __future__ import annotations

from pathlib import Path
from typing import IO, Any, ClassVar

from livebode_drives.recordings.blfcheck import check
from livebode_drives.recordings.can import VectorRecording, import_can


class BlfRecording(VectorRecording):
    """A BLF file; see VectorRecording."""

    format: ClassVar[str] = "blf"

    def __init__(self, path: Path, dbc: Path | None) -> None:
        with path.open("rb") as file:
            check(file, path.stat().st_size)
        super().__init__(path, dbc)

    def _reader(self, file: IO[bytes]) -> Any:
        reader = import_can(self.path).BLFReader(file)
        reader.start_timestamp = 0.0  # a date in seconds would leave a double 0.2 µs of resolution
        return reader
