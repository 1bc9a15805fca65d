"""Recordings of CAN frames: the signals that a DBC file defines in them, decoded by cantools."""

from __future__ import annotations

import logging
from abc import abstractmethod
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import ModuleType
from typing import IO, Any

import numpy as np

from livebode.sources import COLUMNS_MAX, Chunk, Column, Recording, Skipped, damaged, missing, oversized
from livebode_drives.recordings.dbc import messages_of

Identity = tuple[int, int, bool]
"""Bus, identifier of the frame, and whether it is extended."""


class CanRecording(Recording):
    """A recording of CAN frames. A channel is Message.Signal, or bus/Message.Signal if several buses have the message.

    Every message has a clock of its own, `Message.time` in seconds from the beginning of the recording. Values are
    physical, without the texts that a DBC assigns to them.
    """

    def __init__(self, path: Path, dbc: Path | None) -> None:
        super().__init__(path)
        messages = messages_of(dbc, path)
        count: Counter[Identity] = Counter()
        for identity, _, _ in self._frames():
            count[identity] += 1
            if len(count) > COLUMNS_MAX:
                raise oversized(f"{path} has more than {COLUMNS_MAX} messages", COLUMNS_MAX)
        buses = Counter(identity[1:] for identity in count)
        columns: list[Column] = []
        skipped: list[Skipped] = []
        for identity in sorted(count):
            bus, number, _ = identity
            message = messages.get(identity[1:])
            if message is None:
                skipped.append(Skipped(f"{bus}/0x{number:X}", "the DBC does not define this frame"))
                continue
            name = f"{bus}/{message.name}" if buses[identity[1:]] > 1 else message.name
            if message.is_multiplexed():
                skipped.append(Skipped(name, "its signals are multiplexed"))
            else:
                columns += message_columns(name, message, identity, count[identity])
        self.columns, self.skipped = tuple(columns), tuple(skipped)

    @abstractmethod
    def _frames(self) -> Iterator[tuple[Identity, float, bytes]]:
        """Identity, time in seconds and content of each frame with data."""

    def chunks(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        identity, message, _ = columns[0].key
        signals = [column.key[2] for column in columns]
        held: list[list[float]] = []
        for frame_identity, time_s, data in self._frames():
            if frame_identity != identity:
                continue
            if len(data) < message.length:
                raise damaged(
                    f"a frame of message {message.name!r} has {len(data)} bytes, the DBC defines {message.length}",
                    part=message.name,
                )
            values = message.decode(data, decode_choices=False) if any(signals) else {}
            held.append([time_s if signal is None else values[signal] for signal in signals])
            if len(held) == rows:
                yield list(np.array(held, dtype=np.float64).T)
                held = []
        if held:
            yield list(np.array(held, dtype=np.float64).T)


class VectorRecording(CanRecording):
    """A log of Vector, which python-can reads; see CanRecording."""

    @abstractmethod
    def _reader(self, file: IO[bytes]) -> Any:
        """The reader of python-can for the file, which is open at its beginning."""

    def _frames(self) -> Iterator[tuple[Identity, float, bytes]]:
        with self.path.open("rb") as file, self._reader(file) as frames:
            for frame in frames:
                if not frame.is_error_frame and not frame.is_remote_frame:
                    bus = frame.channel + 1 if isinstance(frame.channel, int) else 1
                    yield (bus, frame.arbitration_id, frame.is_extended_id), frame.timestamp, bytes(frame.data)


def message_columns(name: str, message: Any, identity: Identity, samples: int) -> Iterator[Column]:
    """The clock of a message and its signals; a signal can also be written without its message."""
    yield Column(f"{name}.time", "s", samples, key=(identity, message, None), group=name, clock=True)
    for signal in message.signals:
        key = (identity, message, signal.name)
        yield Column(f"{name}.{signal.name}", signal.unit or "", samples, (signal.name,), key=key, group=name)


def import_can(path: Path) -> ModuleType:
    try:
        import can
    except ImportError:
        raise missing(path, "python-can", "can") from None
    logging.getLogger("can").setLevel(logging.CRITICAL)  # its messages are in the error that follows
    return can
