"""Directories of ROS 2 bags: the files of one recording in their order."""

from __future__ import annotations

import re
from pathlib import Path

from livebode.core import RecordingError
from livebode.sources import truncated

SUFFIXES = ".mcap", ".db3"
METADATA = "metadata.yaml"
METADATA_BYTES_MAX = 1 << 24
LISTED = re.compile(r"^\s*-\s*[\"']?(?:[^\"'\n]*/)?([^/\"'\n]+?\.(?:mcap|db3)(?:\.zstd)?)[\"']?\s*$", re.MULTILINE)
"""A file in the metadata of a bag."""


def parts_of(path: Path) -> list[Path]:
    """The files of a bag by their numbers, also without metadata (its recorder was stopped); `path` itself if a file.

    None of a directory that is no bag.

    Raises
    ------
    RecordingError
        Where a bag is compressed as a whole, has files of two kinds, or not all that its metadata lists.
    """
    if not path.is_dir():
        return [path]
    parts = sorted((one for one in path.iterdir() if one.suffix in SUFFIXES and one.is_file()), key=in_order)
    if packed := sorted(one for one in path.glob("*.zstd") if one.stem.endswith(SUFFIXES)):
        raise RecordingError(
            "not-a-file", f"{packed[0]} is compressed as a whole", "decompress it with zstd -d", path=str(packed[0])
        )
    if len({part.suffix for part in parts}) > 1:
        raise RecordingError(
            "not-a-file", f"{path} has files of two kinds, .mcap and .db3", "name one of the files", path=str(path)
        )
    for name in listed_in(path / METADATA):
        if not (path / name).is_file():
            raise truncated(f"{path} has no file {name}, which its {METADATA} lists", path=str(path), part=name)
    return parts


def in_order(part: Path) -> list[tuple[int, str]]:
    """
    >>> sorted([Path("a_10.mcap"), Path("a_9.mcap")], key=in_order)[0].name
    'a_9.mcap'
    """
    return [(int(text), "") if text.isdecimal() else (-1, text) for text in re.split(r"(\d{1,18})", part.name)]


def listed_in(metadata: Path) -> list[str]:
    """Names of the files that the metadata of a bag lists; empty without metadata."""
    if not metadata.is_file():
        return []
    with metadata.open("rb") as file:
        return LISTED.findall(file.read(METADATA_BYTES_MAX).decode("utf-8", "replace"))
