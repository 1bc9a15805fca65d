"""Layout of a table of a record."""

from __future__ import annotations

from dataclasses import dataclass

from livebode.tables import Schema


@dataclass(frozen=True)
class ColumnTable:
    """The columns of a table, with ``sample`` (int64) and ``time_s`` among them.

    `repeating` names those whose values repeat over lines or rows: they compress by a dictionary; measured ones never
    do.
    """

    schema: Schema
    repeating: tuple[str, ...] = ()
