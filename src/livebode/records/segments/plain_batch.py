"""Record batches of a journal; rejected if they expand to more than their bytes: a journal is untrusted data."""

from __future__ import annotations

import struct

import pyarrow as pa

_HEADER, _COMPRESSION = 2, 3  # fields of Message and RecordBatch in Arrow's Message.fbs


def check_schema(schema: pa.Schema) -> None:
    """ValueError if a column has a type that a run does not write, such as one with a single value for all rows."""
    for field in schema:
        if field.type not in (pa.int64(), pa.float64(), pa.bool_(), pa.string()):
            raise ValueError(f"column {field.name!r} is of type {field.type}")


def plain_batch(payload: memoryview, schema: pa.Schema) -> pa.RecordBatch:
    """The rows in these bytes, without a copy.

    Raises
    ------
    ValueError
        If they are compressed, or several columns refer to the same bytes: they could expand to any size.
    """
    message = pa.ipc.read_message(pa.py_buffer(payload))
    about = bytes(message.metadata)
    header = _field(about, struct.unpack_from("<I", about)[0], _HEADER)
    if header is not None and _field(about, header + struct.unpack_from("<I", about, header)[0], _COMPRESSION):
        raise ValueError("compressed rows")
    batch = pa.ipc.read_record_batch(message, schema)
    if batch.nbytes > len(payload):
        raise ValueError(f"{len(payload)} bytes expand to {batch.nbytes}")
    return batch


def _field(data: bytes, table: int, number: int) -> int | None:
    """Position of a field of a FlatBuffers table; None if it is absent."""
    layout = table - struct.unpack_from("<i", data, table)[0]
    entry = 4 + 2 * number
    if entry >= struct.unpack_from("<H", data, layout)[0]:
        return None
    offset = struct.unpack_from("<H", data, layout + entry)[0]
    return table + offset if offset else None
