"""Names, kinds and units of the columns of a table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

STRING = "string"
KINDS = (
    "bool", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64", "float16", "float32", "float64",
    STRING,
)  # fmt: skip


@dataclass(frozen=True)
class Field:
    """A column.

    Parameters
    ----------
    name
        Its name.
    kind
        Type of its values by the name that NumPy and Arrow share, such as "float64", "int64" or "bool"; or "string".
    metadata
        Further texts, such as its "unit".

    Raises
    ------
    TypeError
        If a column cannot have this kind.
    """

    name: str
    kind: str
    metadata: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise TypeError(f"column {self.name!r} is of type {self.kind}")

    @cached_property
    def dtype(self) -> np.dtype[Any]:
        """Of NumPy; TypeError for text."""
        return np.dtype(self.kind)


@dataclass(frozen=True)
class Schema:
    """The columns of a table in order, and texts on the whole table. Iterate over it to get its fields."""

    fields: tuple[Field, ...]
    metadata: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, **kinds: str) -> Schema:
        """Columns without metadata.

        >>> Schema.of(sample="int64", time_s="float64").names
        ['sample', 'time_s']
        """
        return cls(tuple(Field(name, kind) for name, kind in kinds.items()))

    @cached_property
    def names(self) -> list[str]:
        return [one.name for one in self.fields]

    def field(self, name: str) -> Field:
        """The column of this name; KeyError if there is none."""
        return self.fields[self.place(name)]

    def place(self, name: str) -> int:
        """The number of a column; KeyError if there is none."""
        for number, one in enumerate(self.fields):
            if one.name == name:
                return number
        raise KeyError(name)

    def __iter__(self) -> Iterator[Field]:
        return iter(self.fields)

    def __len__(self) -> int:
        return len(self.fields)

    def __arrow_c_schema__(self) -> object:
        from livebode.tables.exchange import schema_to_arrow  # of the extra parquet

        return schema_to_arrow(self).__arrow_c_schema__()
