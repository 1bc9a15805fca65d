"""Projects of TwinCAT Scope (.svdx): a table, acquisitions in pieces of 16 samples, and XML."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np
from numpy.typing import NDArray

TICKS_TO_1970 = 116_444_736_000_000_000
PIECE = 16
TYPES = {"f8": "REAL64", "f4": "REAL32", "i2": "INT16", "u1": "BIT", "u8": "UINT64"}


@dataclass(frozen=True)
class Acquired:
    """A variable: its times in s, raw values, and how a chart shows it (not at all without a name)."""

    symbol: str
    time_s: NDArray[np.float64]
    values: NDArray[np.generic]
    name: str = ""
    unit: str = "(None)"
    scale: float = 1.0
    offset: float = 0.0
    unit_scale: float = 1.0
    unit_offset: float = 0.0
    compression: str = "Uncompressed"
    type: str = ""
    bits: int = (1 << 64) - 1


def data_of(one: Acquired, after_s: float = 0.0) -> bytes:
    """The acquisition; with `after_s` its record ends that much before its last sample."""
    ticks = TICKS_TO_1970 + np.rint(one.time_s * 1e7).astype(np.int64)
    end = int(ticks[-1]) - round(after_s * 1e7) if len(ticks) else TICKS_TO_1970
    first = int(ticks[0]) if len(ticks) else TICKS_TO_1970
    head = struct.pack("<11sQQQQQQQ", b"01.00.00.40", first, 0, first, end, 2, PIECE, 10_000)
    count = -(-len(ticks) // PIECE)
    at = len(head) + 2 * 56
    levels = [(count, count, level, at, 0, count, PIECE, 0) for level in (1, 0)]
    parts = [head, *(struct.pack("<QQIQQQQI", *level) for level in levels)]
    for k in range(0, len(ticks), PIECE):
        times, values = ticks[k : k + PIECE], one.values[k : k + PIECE]
        parts.append(struct.pack("<QQ", int(times[0]), len(times)) + values[:1].tobytes())
        later = np.empty(len(times) - 1, [("after", "<u4"), ("value", values.dtype)])
        later["after"], later["value"] = times[1:] - times[0], values[1:]
        parts.append(later.tobytes())
    return b"".join(parts)


def xml_of(given: Sequence[Acquired]) -> str:
    pool = "".join(
        f"<AdsAcquisition><CompressionMode>{one.compression}</CompressionMode>"
        f"<DataType>{one.type or TYPES[one.values.dtype.str[1:]]}</DataType><FileHandle>{handle}</FileHandle>"
        f"<Guid>g{handle}</Guid><Name>{escape(one.symbol.rpartition('.')[2])}</Name>"
        f"<SymbolName>{escape(one.symbol)}</SymbolName></AdsAcquisition>"
        for handle, one in enumerate(given, 1)
    )
    chart = "".join(
        f"<Channel><Name>{escape(one.name)}</Name><SubMember><AcquisitionInterpreter>"
        f"<AcquisitionGUID>g{handle}</AcquisitionGUID><BitMask>{one.bits}</BitMask><Offset>{one.offset}</Offset>"
        f"<ResultingUnit><Unit><ReturnText>{escape(one.unit)} </ReturnText></Unit>"
        f"<UnitOffsetResult>{one.unit_offset}</UnitOffsetResult><UnitScaleResult>{one.unit_scale}</UnitScaleResult>"
        f"</ResultingUnit><ScaleFactor>{one.scale}</ScaleFactor><Usage>Y</Usage></AcquisitionInterpreter></SubMember>"
        "</Channel>"
        for handle, one in enumerate(given, 1)
        if one.name
    )
    return f'<?xml version="1.0" encoding="utf-8"?><ScopeProject>{pool}<YTChart>{chart}</YTChart></ScopeProject>'


def write_project(path: Path, given: Sequence[Acquired], after_s: float = 0.0) -> None:
    datas = [data_of(one, after_s) for one in given]
    at = 20 + 20 * len(datas)
    table = []
    for handle, data in enumerate(datas, 1):
        table.append(struct.pack("<QQI", at, len(data), handle))
        at += len(data)
    xml = xml_of(given).encode()
    path.write_bytes(b"".join([struct.pack("<QQI", at, len(xml), len(datas)), *table, *datas, xml]))
