"""Where the files of a lake are: a directory, or a URL of an object store."""

from __future__ import annotations

import shutil
from pathlib import Path

from livebode.core.files import whole_file


def is_url(place: str) -> bool:
    """Whether it is a URL instead of a path."""
    return "://" in place


def table_url(lake: str, table: str) -> str:
    """The directory of a table; a local one is created."""
    if is_url(lake):
        return f"{lake.rstrip('/')}/{table}"
    folder = (Path(lake) / table).absolute()
    return str(folder)


def stored(path: Path, place: str) -> None:
    """Put a file at a path or URL, completely or not at all."""
    if is_url(place):
        import fsspec

        filesystem, inside = fsspec.url_to_fs(place)
        filesystem.put_file(str(path), inside)
        return
    target = Path(place)
    target.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(target) as partial:
        shutil.copyfile(path, partial)


__all__ = ["is_url", "stored", "table_url"]
