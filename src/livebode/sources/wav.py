"""WAV: the chunks are found here and their samples decoded by SciPy, block by block."""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO, ClassVar

from livebode.core import needing
from livebode.dataclass import dataclass
from livebode.sources.recording import COLUMNS_MAX, Chunk, Column, Recording, damaged, oversized, truncated

with needing("SciPy", "analysis", "a WAV file"):
    from scipy.io import wavfile

CHUNKS_MAX = 10_000
FORMAT_BYTES_MAX = 4096
BLOCK_BYTES_MAX = 1 << 24
_UNKNOWN = 0xFFFFFFFF
"""Size that a writer leaves if it cannot return to the head, and that RF64 replaces by one of 64 bits."""


@dataclass(frozen=True)
class WavLayout:
    """Byte order, content of the format chunk, and where the samples are."""

    order: str
    format: bytes
    first_byte: int
    frame_bytes: int
    frames: int


class WavRecording(Recording):
    """A WAV file (RIFF, RIFX or RF64). The channels are c1, c2, …; integers are raw counts as SciPy returns them."""

    format: ClassVar[str] = "wav"

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        with path.open("rb") as file:
            self._layout = find_layout(file, path.stat().st_size)
        channels, rate_hz = struct.unpack_from(self._layout.order + "2xHI", self._layout.format)
        if not rate_hz:
            raise damaged("the sample rate in the header is 0 Hz")
        if channels > COLUMNS_MAX:
            raise oversized(f"{path} has {channels} channels, more than {COLUMNS_MAX}", COLUMNS_MAX)
        self.columns = tuple(Column(f"c{at + 1}", "", self._layout.frames, key=at) for at in range(channels))
        self.rate_hz = float(rate_hz)
        for _ in self.chunks(self.columns[:1], 1):  # a compression that SciPy does not read is refused at once
            break

    def chunks(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        layout = self._layout
        rows = max(1, min(rows, BLOCK_BYTES_MAX // layout.frame_bytes))
        with self.path.open("rb") as file:
            file.seek(layout.first_byte)
            for first in range(0, layout.frames, rows):
                size = min(rows, layout.frames - first) * layout.frame_bytes
                raw = file.read(size)
                if len(raw) != size:
                    raise truncated(f"the samples end {size - len(raw)} bytes early", missing_bytes=size - len(raw))
                _, data = wavfile.read(io.BytesIO(complete_file(layout, raw)))
                data = data.reshape(-1, len(self.columns))
                yield [data[:, column.key] for column in columns]


def complete_file(layout: WavLayout, raw: bytes) -> bytes:
    """A WAV file of these samples only, so that SciPy never holds more than one block."""
    size = layout.order + "I"
    chunks = b"".join(
        name + struct.pack(size, len(content)) + content + b"\0" * (len(content) % 2)
        for name, content in ((b"fmt ", layout.format), (b"data", raw))
    )
    return (b"RIFF" if layout.order == "<" else b"RIFX") + struct.pack(size, 4 + len(chunks)) + b"WAVE" + chunks


def find_layout(file: IO[bytes], file_bytes: int) -> WavLayout:
    """Format and place of the samples; RecordingError if the file does not contain what its header declares."""
    order = ">" if file.read(12).startswith(b"RIFX") else "<"
    format_, long_bytes = b"", _UNKNOWN
    for _ in range(CHUNKS_MAX):
        head = file.read(8)
        if len(head) < 8:
            raise truncated("the file ends before its samples")
        name, size = struct.unpack(order + "4sI", head)
        at = file.tell()
        if name == b"data":
            return samples_at(order, format_, at, long_bytes if size == _UNKNOWN else size, file_bytes)
        if name == b"fmt ":
            format_ = read_format(file, order, size)
        elif name == b"ds64":
            long_bytes = int.from_bytes(file.read(16)[8:], "little")
        file.seek(at + size + size % 2)
    raise oversized(f"there are more than {CHUNKS_MAX} chunks before the samples", CHUNKS_MAX)


def read_format(file: IO[bytes], order: str, size: int) -> bytes:
    if not 16 <= size <= FORMAT_BYTES_MAX:
        raise damaged(f"its format chunk has {size} bytes", size=size)
    format_ = file.read(size)
    if len(format_) < size:
        raise truncated("the file ends inside its format chunk")
    channels, frame_bytes = struct.unpack_from(order + "2xH8xH", format_)
    if not channels or not frame_bytes or frame_bytes % channels:
        raise damaged(
            f"its header declares {channels} channels in frames of {frame_bytes} bytes",
            channels=channels,
            frame_bytes=frame_bytes,
        )
    return format_


def samples_at(order: str, format_: bytes, at: int, size: int, file_bytes: int) -> WavLayout:
    if not format_:
        raise damaged("it has no format chunk before its samples")
    (frame_bytes,) = struct.unpack_from(order + "12xH", format_)
    if size == _UNKNOWN:  # written as a stream: the samples reach to the end of the file
        size = (file_bytes - at) // frame_bytes * frame_bytes
    if size > file_bytes - at:
        missing = size - (file_bytes - at)
        raise truncated(f"the samples end {missing} bytes early", missing_bytes=missing)
    if size % frame_bytes:
        raise damaged(f"its samples have {size} bytes, not a multiple of {frame_bytes}", size=size)
    return WavLayout(order, format_, at, frame_bytes, size // frame_bytes)
