"""Table: layout of the rows of one kind, in the journal, in Parquet and in Arrow."""

from __future__ import annotations

from dataclasses import dataclass

import pyarrow as pa


@dataclass(frozen=True)
class ColumnTable:
    """The columns of a table, with ``sample`` (int64) and ``time_s`` among them.

    `repeating` names those whose values repeat over lines or rows: they compress by a dictionary; measured ones never
    do.
    """

    schema: pa.Schema
    repeating: tuple[str, ...] = ()
