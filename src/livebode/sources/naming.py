"""Which column a name means."""

from __future__ import annotations

from collections.abc import Sequence

from livebode.core import RecordingError, nearest_name
from livebode.sources.recording import Column


def resolve(name: str, columns: Sequence[Column], everything: Sequence[Column]) -> Column:
    """The column with this name: exactly, else by alias, else as a path without a single (1)."""
    found = [column for column in columns if column.name == name and not column.temporal]
    found = found or [column for column in columns if name in column.aliases and not column.temporal]
    plain = name.replace("(1).", ".")
    found = found or [column for column in columns if plain in plain_paths(column) and not column.temporal]
    if len(found) == 1:
        return found[0]
    if found:
        paths = [column.name for column in found[:5]]
        raise RecordingError(
            "channel-ambiguous",
            f"channel {name!r} means more than one: {', '.join(paths)}",
            "use the path of one of them",
            channel=name,
            channels=paths,
        )
    for column in everything:
        if column.name == name and not column.temporal:
            if column.group != columns[0].group:
                raise RecordingError(
                    "clocks-differ",
                    f"channel {name!r} is sampled by the clock of {column.group!r}, the others by {columns[0].group!r}",
                    "open it separately",
                    channel=name,
                    groups=[column.group, columns[0].group],
                )
            raise RecordingError(
                "lengths-differ",
                f"channel {name!r} has {column.samples} samples, the others {columns[0].samples}",
                "open it separately",
                channel=name,
                samples=[column.samples, columns[0].samples],
            )
    names = [column.name for column in columns if not column.temporal]
    raise RecordingError(
        "channel-unknown", f"there is no channel {name!r}", nearest_name(name, names), channel=name, channels=names
    )


def plain_paths(column: Column) -> list[str]:
    return [name.replace("(1).", ".") for name in (column.name, *column.aliases)]
