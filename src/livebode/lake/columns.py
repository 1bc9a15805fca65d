"""Types of columns that several tables of a lake have. Lists have the item name of Delta, "element"."""

from __future__ import annotations

from typing import Final

import pyarrow as pa

from livebode.core.machine_levels import LEVELS

TIME: Final = pa.timestamp("us", tz="UTC")
MACHINE: Final = [(level, pa.string()) for level in LEVELS]


def list_of(kind: pa.DataType) -> pa.DataType:
    """A list of any length."""
    return pa.list_(pa.field("element", kind))


def in_delta(kind: pa.DataType) -> pa.DataType:
    """The type in Delta, whose lists have any length."""
    return list_of(kind.value_type) if pa.types.is_fixed_size_list(kind) else kind
