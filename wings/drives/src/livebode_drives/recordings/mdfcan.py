"""CAN frames in MDF 4: read by asammdf from the groups of the bus, their signals defined by a DBC file."""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from typing import Any, ClassVar

import numpy as np

from livebode.sources import truncated
from livebode_drives.recordings.can import CanRecording, Identity
from livebode_drives.recordings.mdffile import opened

FRAME = "CAN_DataFrame"
ROWS = 1000
EXTENDED = 1 << 31


class MdfCanRecording(CanRecording):
    """The CAN frames of an MDF file; see CanRecording. Its other channels are read without a DBC."""

    format: ClassVar[str] = "mdf"

    def _frames(self) -> Iterator[tuple[Identity, float, bytes]]:
        with opened(self.path) as file:
            groups = [
                group_frames(file, at, int(group.channel_group.cycles_nr))
                for at, group in enumerate(file.groups)
                if any(channel.name == FRAME for channel in group.channels)
            ]
            yield from heapq.merge(*groups, key=lambda frame: frame[1])


def group_frames(file: Any, group: int, samples: int) -> Iterator[tuple[Identity, float, bytes]]:
    for first in range(0, samples, ROWS):
        count = min(ROWS, samples - first)
        found = file.get(FRAME, group, record_offset=first, record_count=count, ignore_invalidation_bits=True)
        if len(found.samples) != count:
            raise truncated(f"group {group} ends before its {samples} frames", samples=samples)
        fields = {name.rpartition(".")[2]: found.samples[name] for name in found.samples.dtype.names}
        numbers = np.asarray(fields["ID"], dtype=np.int64)
        extended = np.asarray(fields.get("IDE", 0), dtype=bool) | (numbers & EXTENDED > 0)
        buses = np.broadcast_to(fields.get("BusChannel", np.int64(1)), count)
        lengths = np.asarray(fields.get("DataLength", fields.get("DLC")), dtype=np.int64)
        for row in range(count):
            identity = int(buses[row]), int(numbers[row]) & 0x1FFFFFFF, bool(extended[row])
            yield identity, float(found.timestamps[row]), fields["DataBytes"][row][: lengths[row]].tobytes()
