"""The number of partitions that a log was filled with: recorded in the description of its stream."""

from __future__ import annotations

import json
from pathlib import Path

from livebode.core import FleetError
from livebode_plant.fleet.subjects import LOG_STREAM

_WORD = "partitions"


def description_of(count: int) -> str:
    """The description of the stream.

    >>> partitions_of(description_of(16))
    16
    """
    return f"livebode, {count} {_WORD}"


def partitions_of(description: str | None) -> int | None:
    """The number in a description; None if it has none."""
    words = (description or "").split()
    return int(words[-2]) if words[-1:] == [_WORD] and words[-2].isdecimal() else None


def partitions_changed(before: int, count: int) -> FleetError:
    """The error for a number that differs from that of the data in the log."""
    return FleetError(
        "partitions-changed",
        f"the log has data in {before} partitions, and the fleet has partitions = {count}: an axis would continue in "
        "another partition, without its state and beside its former owner",
        f"set partitions = {before}, or begin with an empty log",
        before=before,
        partitions=count,
    )


def check_store(store: Path, count: int) -> None:
    """FleetError if the store of a server on this computer has data in another number of partitions."""
    for about in store.glob(f"jetstream/*/streams/{LOG_STREAM}/meta.inf"):
        before = partitions_of(json.loads(about.read_text()).get("description"))
        filled = any(block.stat().st_size for block in about.parent.glob("msgs/*.blk"))
        if before is not None and before != count and filled:
            raise partitions_changed(before, count)
