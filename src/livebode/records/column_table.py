"""Layout of a table of a record."""

from __future__ import annotations

from livebode.dataclass import dataclass
from livebode.tables import Field, Schema


@dataclass(frozen=True)
class ColumnTable:
    """The columns of a table, with ``sample`` (int64) and ``time_s`` among them.

    `repeating` names those whose values repeat over lines or rows: they compress by a dictionary; measured ones never
    do. `rounded` names those of which the run of a recording has 7 digits: half of their bytes, which nothing makes
    smaller. A journal has all digits.
    """

    schema: Schema
    repeating: tuple[str, ...] = ()
    rounded: tuple[str, ...] = ()

    @property
    def of_recording(self) -> Schema:
        """The schema of the file of a recording."""
        rounded = (Field(one.name, "float32", one.metadata) if one.name in self.rounded else one for one in self.schema)
        return Schema(tuple(rounded), self.schema.metadata)
