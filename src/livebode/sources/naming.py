"""Which column a name means."""

from __future__ import annotations

from collections.abc import Sequence

from livebode.core import InputError, missing_channel
from livebode.sources.recording import Column


def resolve(name: str, columns: Sequence[Column], everything: Sequence[Column]) -> Column:
    """The column that `name` means: exactly, else by alias, else as a path that leaves out a lone (1)."""
    found = [column for column in columns if column.name == name and not column.temporal]
    found = found or [column for column in columns if name in column.aliases and not column.temporal]
    plain = name.replace("(1).", ".")
    found = found or [column for column in columns if column.name.replace("(1).", ".") == plain and not column.temporal]
    if len(found) == 1:
        return found[0]
    if found:
        paths = ", ".join(column.name for column in found[:5])
        raise InputError(f"channel {name!r} means more than one: {paths}; name the one by its path")
    for column in everything:
        if column.name == name and not column.temporal:
            raise InputError(
                f"channel {name!r} has {column.samples} samples, the others {columns[0].samples}; open it on its own"
            )
    raise InputError(missing_channel(name, [column.name for column in columns if not column.temporal]))
