"""PyArrow's schemas and arrays as columns and values: what foreign Parquet files and Arrow IPC have in common."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pyarrow as pa
from numpy.typing import NDArray

from livebode import arrow
from livebode.sources.columnar import Content, StoredColumn, scalars_of

_NANOSECONDS = {"s": 1_000_000_000, "ms": 1_000_000, "us": 1_000, "ns": 1}


def stored_columns(schema: pa.Schema) -> list[StoredColumn]:
    """The columns of a schema."""
    return [StoredColumn(one.name, content_of(one.type), str(one.type), _texts(one.metadata)) for one in schema]


def schema_scalars(schema: pa.Schema) -> dict[str, float]:
    """Numbers in the metadata of a schema."""
    return scalars_of(_texts(schema.metadata).items())


def content_of(kind: pa.DataType) -> Content:
    """What a column of this type has."""
    if _is_time(kind):
        return Content.TIME
    return Content.NUMBER if _is_number(kind) else Content.OTHER


def to_numpy(array: pa.Array[Any]) -> NDArray[Any]:
    """Values of an Arrow array; without a copy where it has no nulls. Nulls become NaN."""
    array.validate(full=True)
    if pa.types.is_dictionary(array.type):
        array = array.dictionary_decode()
    if _is_time(array.type):
        factor = _NANOSECONDS[array.type.unit]
        return arrow.to_numpy(array.view(pa.int64())) * factor
    if pa.types.is_decimal(array.type):
        array = array.cast(pa.float64())
    if pa.types.is_boolean(array.type):
        array = array.cast(pa.uint8())
    return arrow.to_numpy(array)


def _is_time(kind: pa.DataType) -> bool:
    return bool(pa.types.is_timestamp(kind) or pa.types.is_duration(kind))


def _is_number(kind: pa.DataType) -> bool:
    types = pa.types
    return bool(
        types.is_integer(kind) or types.is_floating(kind) or types.is_boolean(kind) or types.is_decimal(kind)
    ) or bool(types.is_dictionary(kind) and _is_number(kind.value_type))


def _texts(metadata: Mapping[bytes, bytes] | None) -> dict[str, str]:
    return {key.decode("utf-8", "replace"): value.decode("utf-8", "replace") for key, value in (metadata or {}).items()}
