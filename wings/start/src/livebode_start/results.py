"""Results of the tasks in the directory of the runs: what the page lists, shows and offers to download."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from livebode.core import LivebodeError, ServerError
from livebode.dataclass import dataclass
from livebode.language import Message
from livebode.records import is_run, read_bytes

FILE_BYTES_MAX = 256 << 20
_LISTED_MAX = 500
_FACTS = "design.json"
_FACTS_BYTES_MAX = 4 << 20
_SHOWN = {".html": "text/html; charset=utf-8", ".svg": "image/svg+xml"}
_ENDINGS = {"baselines": (".json",), "comparisons": (".html", ".pdf")}
_REPORTS = ("report.html", "report.pdf")


@dataclass(frozen=True)
class ResultFile:
    """A file that the page offers.

    Attributes
    ----------
    name
        Its name.
    content
        Its bytes.
    shown_as
        Type in which a browser shows it; None: it is downloaded.
    """

    name: str
    content: bytes
    shown_as: str | None


class Results:
    """The results in a directory of runs.

    A name from outside is looked for among the listed ones, and never becomes a path by itself.

    Parameters
    ----------
    directory
        Contains the runs.
    """

    def __init__(self, directory: Path) -> None:
        self._directory = directory

    def listed(self, folder: str) -> list[dict[str, Any]]:
        """The results of a folder, or of all runs if it is empty: name, files and bytes, the newest first."""
        rows = [self._row(name, place, files) for name, place, files in self._results(folder)]
        return sorted(rows, key=lambda row: row["written"], reverse=True)[:_LISTED_MAX]

    def check(self, folder: str, name: str) -> None:
        """ServerError if there is no result of this name."""
        if name not in (listed for listed, _, _ in self._results(folder)):
            raise _absent()

    def file(self, folder: str, name: str, file: str) -> ResultFile:
        """A file of a result; ServerError if it is not listed."""
        for listed, place, files in self._results(folder):
            if listed == name and file in files:
                return ResultFile(file, read_bytes(place, file, FILE_BYTES_MAX), _SHOWN.get(Path(file).suffix))
        raise _absent()

    def _results(self, folder: str) -> Iterator[tuple[str, Path, list[str]]]:
        """Name, directory and files of each result."""
        if folder in _ENDINGS:
            yield from _by_stem(self._directory / folder, _ENDINGS[folder])
            return
        for place in _folders(self._directory / folder):
            files = _files(place)
            if not folder and is_run(place):
                files = [name for name in files if name in _REPORTS]
            elif not folder or _FACTS not in files:
                continue
            if files:
                yield place.name, place, files

    @staticmethod
    def _row(name: str, place: Path, files: list[str]) -> dict[str, Any]:
        sizes = [(file, os.lstat(place / file)) for file in files]
        row = {
            "name": name,
            "files": [[file, status.st_size] for file, status in sizes],
            "written": max(status.st_mtime for _, status in sizes),
        }
        return row | {"choices": _choices(place)} if _FACTS in files else row


def _absent() -> ServerError:
    return ServerError("file-unknown", Message("this file is not here any more"), Message("reload the page"))


def _choices(design: Path) -> list[list[str]]:
    """What a design has chosen, with the reasons; empty if its file cannot be read."""
    try:
        rows = json.loads(read_bytes(design, _FACTS, _FACTS_BYTES_MAX))["choices"]
        return [[str(row[key]) for key in ("what", "value", "why")] for row in rows]
    except (LivebodeError, OSError, ValueError, KeyError, TypeError):
        return []


def _by_stem(place: Path, endings: tuple[str, ...]) -> Iterator[tuple[str, Path, list[str]]]:
    """The files of a directory with these endings, those of one name together."""
    stems: dict[str, list[str]] = {}
    for name in _files(place):
        if name.endswith(endings):
            stems.setdefault(name.rpartition(".")[0], []).append(name)
    for stem, files in stems.items():
        yield stem, place, files


def _entries(folder: Path) -> list[os.DirEntry[str]]:
    """What is in a directory that is not a link, without hidden names; nothing if it is missing."""
    try:
        if folder.is_symlink():
            return []
        with os.scandir(folder) as entries:
            return sorted((e for e in entries if not e.name.startswith(".")), key=lambda e: e.name)
    except OSError:
        return []


def _files(folder: Path) -> list[str]:
    return [entry.name for entry in _entries(folder) if entry.is_file(follow_symlinks=False)]


def _folders(folder: Path) -> list[Path]:
    return [folder / entry.name for entry in _entries(folder) if entry.is_dir(follow_symlinks=False)]
