"""Kinds of TOML files: `livebode doctor --schema` prints the schema of each, and its tables show the kind of a file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from livebode.plugins import named


class FileKind(NamedTuple):
    """A kind of TOML file.

    Attributes
    ----------
    schema
        "module:name" of the function with the JSON Schema of the file NAME.toml, for `livebode doctor --schema NAME`.
    title
        What the file describes, as "an experiment".
    tables
        Tables or keys of which a file of this kind has at least one, and axis.toml none; empty where only its command
        recognises the file.
    model
        "module:name" of the pydantic model of a file that is recognised. `read(path)` of it reads the file, and
        `check()` of the result raises the LivebodeError that its command would raise at the beginning.
    """

    schema: str
    title: str = ""
    tables: frozenset[str] = frozenset()
    model: str = ""


FILES: Mapping[str, FileKind] = {"axis": FileKind("livebode.configuration.schema:axis_schema")}


def kind_of_file(table: Mapping[str, Any]) -> FileKind | None:
    """The kind of a file with this content: the last one that has one of its tables; None for axis.toml."""
    kinds = [kind for kind in named("files").values() if kind.tables & table.keys()]
    return kinds[-1] if kinds else None
