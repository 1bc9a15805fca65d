"""TDMS, the file of LabVIEW: channels streamed by npTDMS."""

from __future__ import annotations

import logging
import struct
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from livebode.core import not_installed
from livebode.sources.recording import COLUMNS_MAX, Chunk, Column, Recording, Skipped, damaged, oversized, truncated
from livebode.sources.steps import exact_rate_hz

UNITS = "unit_string", "NI_UnitDescription", "unit"
PERIOD = "wf_increment"
LEAD_IN = struct.Struct("<4sIIQQ")
SEGMENTS_MAX = 1_000_000
_UNFINISHED = (1 << 64) - 1


class TdmsRecording(Recording):
    """A TDMS file. Channels go by their name where the file has one group, else by group/name.

    The rate is from the waveform property `wf_increment` if it is equal in all channels.
    """

    format: ClassVar[str] = "tdms"

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        refuse_truncated(path)
        columns, skipped, periods = [], [], set()
        with opened(path) as file:
            channels = [channel for group in file.groups() for channel in group.channels()]
            if len(channels) > COLUMNS_MAX:
                raise oversized(
                    f"{path} has {len(channels)} channels, more than {COLUMNS_MAX}", COLUMNS_MAX, path=str(path)
                )
            several = len(file.groups()) > 1
            count = Counter(channel.name for channel in channels)
            for channel in channels:
                key = (channel.group_name, channel.name)
                path_name = "/".join(key)
                name = path_name if several else channel.name
                dtype = np.dtype(channel.dtype)
                if dtype.kind not in "fiubM":
                    skipped.append(Skipped(name, f"its values are of type {dtype}, not numbers"))
                    continue
                other = channel.name if several else path_name
                aliases = (other,) if count[channel.name] == 1 or not several else ()
                unit = next((str(channel.properties[key]) for key in UNITS if channel.properties.get(key)), "")
                moment = dtype.kind == "M"
                columns.append(Column(name, "ns" if moment else unit, len(channel), aliases, moment, key))
                periods.add(channel.properties.get(PERIOD) if not moment else None)
        self.columns, self.skipped = tuple(columns), tuple(skipped)
        period_s = periods.pop() if len(periods) == 1 else None
        if isinstance(period_s, float) and 0 < period_s < 1e9:
            self.rate_hz = exact_rate_hz(period_s, 0.0)

    def chunks(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        with opened(self.path) as file:
            channels = [file[column.key[0]][column.key[1]] for column in columns]
            samples = columns[0].samples or 0
            for first in range(0, samples, rows):
                yield [values(channel.read_data(first, min(rows, samples - first))) for channel in channels]


def values(data: Any) -> Any:
    return data.astype("datetime64[ns]").view(np.int64) if data.dtype.kind == "M" else data


def refuse_truncated(path: Path) -> None:
    """RecordingError if the file ends before its last segment; npTDMS would read the rest without an error."""
    size = path.stat().st_size
    at = segments = 0
    with path.open("rb") as file:
        while at + LEAD_IN.size <= size:
            file.seek(at)
            tag, _, _, following, _ = LEAD_IN.unpack(file.read(LEAD_IN.size))
            segments += 1
            if tag != b"TDSm" or segments > SEGMENTS_MAX:
                raise damaged(f"{path} has no TDMS segment at byte {at}", path=str(path), byte=at)
            if following == _UNFINISHED:
                return  # its writer was stopped, and marked it
            at += LEAD_IN.size + following
    if at != size:
        raise truncated(
            f"{path} ends {abs(at - size)} bytes {'early' if at > size else 'late'}",
            path=str(path),
            missing_bytes=at - size,
        )


@contextmanager
def opened(path: Path) -> Iterator[Any]:
    try:
        import nptdms
    except ImportError:
        raise not_installed(
            f"{path} needs the package npTDMS, which is not installed", package="npTDMS", extra="tdms", path=str(path)
        ) from None
    logging.getLogger("nptdms").setLevel(logging.CRITICAL)  # its messages are in the error that follows
    # With a path it would read the index file next to it, which may belong to another recording.
    with path.open("rb") as raw, nptdms.TdmsFile.open(raw) as file:
        yield file
