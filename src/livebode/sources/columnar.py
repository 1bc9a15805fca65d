"""Arrow schemas as columns and their values as NumPy arrays: what Parquet and Arrow IPC have in common."""

from __future__ import annotations

from typing import Any

import pyarrow as pa
from numpy.typing import NDArray

from livebode import arrow
from livebode.sources.damage import oversized
from livebode.sources.recording import COLUMNS_MAX, Column, Skipped
from livebode.sources.units import split_units

UNIT_KEYS = b"unit", b"units"
NANOSECONDS = {"s": 1_000_000_000, "ms": 1_000_000, "us": 1_000, "ns": 1}


def schema_columns(schema: pa.Schema, samples: int | None) -> tuple[tuple[Column, ...], tuple[Skipped, ...]]:
    """Columns of a schema; `key` is the field's number. Units are from field metadata, else from brackets in names.

    >>> columns, _ = schema_columns(pa.schema([("u [V]", pa.float32()), ("note", pa.string())]), 10)
    >>> [(c.name, c.unit) for c in columns]
    [('u', 'V')]
    """
    if len(schema) > COLUMNS_MAX:
        raise oversized(
            f"the file has {len(schema)} columns, more than {COLUMNS_MAX}", COLUMNS_MAX, columns=len(schema)
        )
    columns, skipped = [], []
    for at, (field, (name, unit)) in enumerate(zip(schema, split_units(schema.names))):
        metadata = field.metadata or {}
        stated = next((metadata[key].decode("utf-8", "replace") for key in UNIT_KEYS if key in metadata), "")
        alias = () if name == field.name else (field.name,)
        if is_temporal(field.type):
            columns.append(Column(name, "ns", samples, alias, temporal=True, key=at))
        elif is_number(field.type):
            columns.append(Column(name, stated or unit, samples, alias, key=at))
        else:
            skipped.append(Skipped(name, f"its values are of type {field.type}, not numbers"))
    return tuple(columns), tuple(skipped)


def schema_scalars(schema: pa.Schema) -> dict[str, float]:
    """Numbers in a schema's metadata, such as rate_hz."""
    numbers = {}
    for key, value in (schema.metadata or {}).items():
        if len(value) < 40:
            try:
                numbers[key.decode("utf-8", "replace")] = float(value)
            except ValueError:
                continue
    return numbers


def is_temporal(kind: pa.DataType) -> bool:
    return bool(pa.types.is_timestamp(kind) or pa.types.is_duration(kind))


def is_number(kind: pa.DataType) -> bool:
    types = pa.types
    return bool(
        types.is_integer(kind) or types.is_floating(kind) or types.is_boolean(kind) or types.is_decimal(kind)
    ) or bool(types.is_dictionary(kind) and is_number(kind.value_type))


def to_numpy(array: pa.Array[Any]) -> NDArray[Any]:
    """Values of an Arrow array; without a copy where it has no nulls. Nulls become NaN."""
    array.validate(full=True)
    if pa.types.is_dictionary(array.type):
        array = array.dictionary_decode()
    if is_temporal(array.type):
        factor = NANOSECONDS[array.type.unit]
        return arrow.to_numpy(array.view(pa.int64())) * factor
    if pa.types.is_decimal(array.type):
        array = array.cast(pa.float64())
    if pa.types.is_boolean(array.type):
        array = array.cast(pa.uint8())
    return arrow.to_numpy(array)
