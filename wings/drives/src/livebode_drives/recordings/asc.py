"""ASC, the text log of Vector: frames read by python-can."""

from __future__ import annotations

import io
from pathlib import Path
from typing import IO, Any, ClassVar

from livebode.core import RecordingError
from livebode.sources import HEAD_BYTES, oversized
from livebode_drives.formats import ASC_HEAD
from livebode_drives.recordings.can import VectorRecording, import_can

LINE_CHARACTERS_MAX = 1 << 16


class AscRecording(VectorRecording):
    """An ASC file; see VectorRecording."""

    format: ClassVar[str] = "asc"

    def __init__(self, path: Path, dbc: Path | None) -> None:
        with path.open("rb") as file:
            kind = ASC_HEAD.match(file.read(HEAD_BYTES))
        if kind is not None and kind[1].lower() == b"relative":  # to the event before, which may be of another kind
            raise RecordingError(
                "time-irregular",
                f"the times in {path} are relative to the previous event",
                "export it with absolute timestamps",
                path=str(path),
            )
        super().__init__(path, dbc)

    def _reader(self, file: IO[bytes]) -> Any:
        return import_can(self.path).ASCReader(BoundedLines(file, encoding="latin-1"))


class BoundedLines(io.TextIOWrapper):
    """Text of which no line fills the memory."""

    def __next__(self) -> str:  # type: ignore[override]
        line = self.readline(LINE_CHARACTERS_MAX)
        if not line:
            raise StopIteration
        if len(line) == LINE_CHARACTERS_MAX:
            raise oversized(f"a line has more than {LINE_CHARACTERS_MAX} characters", LINE_CHARACTERS_MAX)
        return line
