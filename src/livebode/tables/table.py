"""Tables in memory: NumPy columns of equal length with names, kinds and units; text as few words that repeat."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from functools import cached_property
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from livebode.dataclass import dataclass

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


@dataclass(frozen=True, eq=False)
class Text:
    """The word number `at[i]` in row i.

    Attributes
    ----------
    words
        Different words; some may be in no row.
    at
        Numbers of words, int32, shape (rows,).
    """

    words: tuple[str, ...]
    at: NDArray[np.int32]

    @classmethod
    def of(cls, words: Sequence[str], at: NDArray[np.integer[Any]] | None = None) -> Text:
        """The word number `at[i]` in row i, or all words in order; they may repeat.

        >>> Text.of(["Hz", "kg", "Hz"]).words, Text.of(["Hz", "kg", "Hz"], np.array([2, 1])).to_list()
        (('Hz', 'kg'), ['Hz', 'kg'])
        """
        numbers: dict[str, int] = {}
        unique = np.array([numbers.setdefault(word, len(numbers)) for word in words], dtype=np.int32)
        return cls(tuple(numbers), unique if at is None else unique[at])

    @classmethod
    def join(cls, parts: Sequence[Text]) -> Text:
        """The rows of all parts, one after the other."""
        numbers: dict[str, int] = {}
        rows = []
        for part in parts:
            new = np.array([numbers.setdefault(word, len(numbers)) for word in part.words], dtype=np.int32)
            rows.append(new[part.at])
        return cls(tuple(numbers), np.concatenate(rows) if rows else np.empty(0, np.int32))

    def to_list(self) -> list[str]:
        return [self.words[number] for number in self.at.tolist()]

    def where(self, word: str) -> NDArray[np.bool_]:
        """Whether each row has this word."""
        found: NDArray[np.bool_] = self.at == (self.words.index(word) if word in self.words else -1)
        return found

    def __len__(self) -> int:
        return len(self.at)

    def __iter__(self) -> Iterator[str]:
        return iter(self.to_list())

    @overload
    def __getitem__(self, rows: int) -> str: ...
    @overload
    def __getitem__(self, rows: slice | NDArray[Any]) -> Text: ...
    def __getitem__(self, rows: int | slice | NDArray[Any]) -> str | Text:
        if isinstance(rows, int):
            return self.words[int(self.at[rows])]
        return Text(self.words, self.at[rows])

    def __eq__(self, other: object) -> bool:
        """Whether the rows are equal."""
        return isinstance(other, Text) and self.to_list() == other.to_list()

    __hash__ = None  # type: ignore[assignment]


Column = NDArray[Any] | Text
"""Numbers or truth values of shape (rows,), or text."""


@dataclass(frozen=True, eq=False)
class Table:
    """NumPy columns of equal length with a schema. It has no nulls: a missing value is NaN.

    PyArrow, Polars, DuckDB and pandas read it by Arrow's PyCapsule interface, numbers without a copy:
    `pyarrow.table(table)`, `polars.DataFrame(table)`.

    Parameters
    ----------
    schema
        Names and kinds of the columns, in their order.
    columns
        One for each; of the kind that the schema states.

    Raises
    ------
    ValueError
        If the columns do not fit the schema, or differ in length.

    Examples
    --------
    >>> table = Table.of({"sample": np.arange(3), "model": Text.of(["rigid"], np.zeros(3, int))})
    >>> table.num_rows, table["sample"][1:], table.text("model")[0]
    (3, array([1, 2]), 'rigid')
    """

    schema: Schema
    columns: tuple[Column, ...]

    def __post_init__(self) -> None:
        if len(self.columns) != len(self.schema) or len({len(column) for column in self.columns}) > 1:
            raise ValueError("the columns do not fit the schema, or differ in length")
        for column, stated in zip(self.columns, self.schema):
            if not _is_of(column, stated):
                raise ValueError(f"column {stated.name!r} is not of type {stated.kind}")

    @classmethod
    def of(cls, columns: Mapping[str, Column]) -> Table:
        """These columns, with the kinds that they have."""
        kinds = {name: STRING if isinstance(c, Text) else c.dtype.name for name, c in columns.items()}
        return cls(Schema.of(**kinds), tuple(columns.values()))

    @classmethod
    def empty(cls, schema: Schema) -> Table:
        """No rows."""
        return cls(schema, tuple(_no_rows(field) for field in schema))

    @classmethod
    def from_arrow(cls, data: object) -> Table:
        """Everything that has Arrow's PyCapsule interface: a table, a record batch, or a stream, which is read.

        A null becomes NaN, and integers in the same column doubles; among truth values it is False, in a text "".

        Raises
        ------
        ImportError
            If nanoarrow, of the extra `parquet`, is not installed and the data are not a Table.
        TypeError
            If a column contains neither numbers, truth values nor text.
        """
        if isinstance(data, Table):
            return data
        from livebode.tables.exchange import from_arrow  # of the extra parquet

        return from_arrow(data)

    @classmethod
    def join(cls, parts: Sequence[Table], schema: Schema | None = None) -> Table:
        """The rows of all parts, one after the other; ValueError if the columns of one differ.

        With the schema of the first, or another one, whose floating-point numbers may have fewer digits.
        """
        schema = parts[0].schema if schema is None else schema
        if not parts[1:] and parts[0].schema == schema:
            return parts[0]
        if any(part.schema.names != schema.names for part in parts):
            raise ValueError("the tables have different columns")
        columns = zip(*(part.columns for part in parts))
        return cls(schema, tuple(map(_joined, columns, schema)))

    @property
    def num_rows(self) -> int:
        return len(self.columns[0]) if self.columns else 0

    @property
    def column_names(self) -> list[str]:
        return self.schema.names

    def __getitem__(self, name: str) -> NDArray[Any]:
        """The numbers of a column; KeyError if there is none of this name, TypeError if it is text."""
        column = self.columns[self.schema.place(name)]
        if isinstance(column, Text):
            raise TypeError(f"column {name!r} is text")
        return column

    def text(self, name: str) -> Text:
        """The words of a column; KeyError if there is none of this name, TypeError if it has numbers."""
        column = self.columns[self.schema.place(name)]
        if not isinstance(column, Text):
            raise TypeError(f"column {name!r} is not text")
        return column

    def values(self, name: str) -> NDArray[Any]:
        """Any column as an array; of a text its words as objects, shape (rows,)."""
        column = self.columns[self.schema.place(name)]
        if not isinstance(column, Text):
            return column
        return np.array(column.words or [""], dtype=object)[column.at]

    def slice(self, start: int, rows: int | None = None) -> Table:
        """So many rows from this one on, or all; without a copy."""
        part = slice(start, None if rows is None else start + rows)
        return Table(self.schema, tuple(column[part] for column in self.columns))

    def select(self, names: Sequence[str]) -> Table:
        """These columns, in this order."""
        places = [self.schema.place(name) for name in names]
        schema = Schema(tuple(self.schema.fields[at] for at in places), self.schema.metadata)
        return Table(schema, tuple(self.columns[at] for at in places))

    def equals(self, other: Table) -> bool:
        """Whether schema and values are equal, NaN to NaN."""
        return self.schema == other.schema and all(map(_equal, self.columns, other.columns))

    def __len__(self) -> int:
        return self.num_rows

    def __arrow_c_schema__(self) -> object:
        return self.schema.__arrow_c_schema__()

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        from livebode.tables.exchange import to_arrow_stream

        return to_arrow_stream(self).__arrow_c_stream__(requested_schema)


def _is_of(column: Column, field: Field) -> bool:
    if isinstance(column, Text):
        return field.kind == STRING
    return field.kind != STRING and column.dtype == field.dtype


def _no_rows(field: Field) -> Column:
    return Text((), np.empty(0, np.int32)) if field.kind == STRING else np.empty(0, field.dtype)


def _joined(columns: Sequence[Column], field: Field) -> Column:
    if isinstance(columns[0], Text):
        return Text.join([column for column in columns if isinstance(column, Text)])
    with np.errstate(over="ignore", under="ignore"):  # of fewer digits: infinite, or 0
        return np.concatenate([column for column in columns if not isinstance(column, Text)], dtype=field.dtype)


def _equal(column: Column, other: Column) -> bool:
    if isinstance(column, Text) or isinstance(other, Text):
        return isinstance(column, Text) and column == other
    return np.array_equal(column, other, equal_nan=column.dtype.kind == "f")
