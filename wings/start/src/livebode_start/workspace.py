"""The files of a directory of runs, and harmless names for those that come from a browser."""

from __future__ import annotations

import os
import re
import unicodedata
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from functools import cache
from itertools import count
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

from livebode.core import LivebodeError, ServerError
from livebode.language import Message
from livebode.plugins import tables

NAME_BYTES_MAX = 100
"""Of a name without its ending: run directory, configuration and outbox are named after it."""
_ENDING_LETTERS_MAX, _NAME_LETTERS_MAX = 12, 64
_FILES_MAX = 1000
_BESIDE = "../"
_FORBIDDEN = re.compile(r'[<>:"/\\|?*]')
_DEVICE = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)
_OWN = (".toml", ".json", ".jsonl", ".sqlite")  # a run.json would make the directory a run


def harmless_name(text: str) -> str:
    """A name of a file that is valid on every system and in no other directory, from one that somebody else chose.

    >>> harmless_name("../../etc/passwd"), harmless_name("C:\\\\logs\\\\axis 3.csv"), harmless_name("con.csv")
    ('passwd', 'axis 3.csv', '_con.csv')
    >>> harmless_name("run.json"), harmless_name("..")
    ('run.json.txt', 'recording')
    """
    text = PureWindowsPath(PurePosixPath(text.replace("\0", "")).name).name
    text = unicodedata.normalize("NFC", text.encode(errors="ignore").decode())
    text = "".join(letter for letter in text if unicodedata.category(letter)[0] != "C")
    text = _FORBIDDEN.sub("_", text).strip(". ")
    if _DEVICE.fullmatch(text):
        text = f"_{text}"
    if text.lower().endswith(_OWN):
        text += ".txt"
    stem, dot, ending = text.rpartition(".")
    if not dot or len(ending) > _ENDING_LETTERS_MAX:
        stem, ending = text, ""
    stem = stem.encode()[:NAME_BYTES_MAX].decode(errors="ignore").strip(". ") or "recording"
    if not ending and stem.lower().endswith(_OWN):  # where it was cut
        ending = "txt"
    return f"{stem}.{ending}" if ending else stem


def file_name(text: object) -> str:
    """The name of something that a person adds to the directory of the runs.

    Raises
    ------
    ServerError
        If it could be a path, or a name that some system does not have.

    >>> file_name("press 3, before")
    'press 3, before'
    """
    name = text.strip() if isinstance(text, str) else ""
    usual = re.fullmatch(r"\w[\w .,+=()-]*", name) is not None and not name.endswith(".")
    if not usual or len(name.encode(errors="replace")) > _NAME_LETTERS_MAX or _DEVICE.fullmatch(name):
        raise ServerError(
            "name-invalid",
            Message("{name} cannot be the name of a file", name=repr(str(text)[:_NAME_LETTERS_MAX])),
            Message("use letters, digits, spaces, - and _, at most {count}", count=_NAME_LETTERS_MAX),
            argument="name",
        )
    return name


class Workspace:
    """A directory with recordings, their configurations and runs.

    If it is in the working directory, as `runs` is where livebode was started, the recordings beside it are also
    offered, as ../NAME. A name from outside is looked for among the offered names, and never becomes a path by itself.

    Parameters
    ----------
    directory
        It may be missing.
    """

    def __init__(self, directory: Path) -> None:
        self.directory = directory.absolute()
        self._working = Path.cwd()

    def files(self) -> dict[str, os.stat_result]:
        """The plain files by name, without links and hidden ones; those beside the directory only if recordings."""
        own = _plain_files(self.directory)
        # Of a link, ".." in a configuration would be another directory.
        if self.directory.parent != self._working or self.directory.is_symlink():
            return own
        beside = _plain_files(self._working).items()
        return own | {_BESIDE + name: status for name, status in beside if _is_recording(name)}

    def recordings(self) -> list[dict[str, Any]]:
        """Name, bytes and seconds since 1970 of each file with the ending of a recording, the newest first."""
        rows: list[dict[str, Any]] = [
            {"name": name, "size_bytes": status.st_size, "written": status.st_mtime}
            for name, status in self.files().items()
            if _is_recording(name)
        ]
        return sorted(rows, key=lambda row: row["written"], reverse=True)[:_FILES_MAX]

    def path(self, name: object) -> Path:
        """The file of this name; ServerError if there is none."""
        if not isinstance(name, str) or name not in self.files():
            shown = name[:NAME_BYTES_MAX] if isinstance(name, str) else ""
            raise ServerError(
                "file-unknown", f"there is no recording {shown!r}", Message("reload the page"), name=shown
            )
        # Not through the directory, which may be missing.
        return self._working / name.removeprefix(_BESIDE) if name.startswith(_BESIDE) else self.directory / name

    def free_name(self, name: str, taken: Collection[str] = ()) -> str:
        """This name, or one with a number, that neither a file nor `taken` has."""
        stem, dot, ending = name.rpartition(".")
        stem, ending = (stem, dot + ending) if dot else (name, "")
        return next(other for other in _numbered(stem, ending) if other not in taken and not self._has(other))

    def free_stem(self, stem: str) -> str:
        """This name, or one with a number, that neither a run nor a configuration has."""
        return next(other for other in _numbered(stem) if not self._has(other) and not self._has(f"{other}.toml"))

    def check_free(self, name: str) -> None:
        """ServerError if another program has put a file of this name here meanwhile."""
        if self._has(name):
            raise ServerError(
                "busy", Message("another {name} was put here meanwhile", name=name), Message("send it again")
            )

    def _has(self, name: str) -> bool:
        return os.path.lexists(self.directory / name)

    @contextmanager
    def short_names(self, directory: Path | None = None) -> Iterator[None]:
        """Errors inside it name files as in this directory; default: the workspace."""
        prefixes = {f"{directory or self.directory}{os.sep}": "", f"{self._working}{os.sep}": _BESIDE}
        try:
            yield
        except LivebodeError as error:
            for part in ("message", "remedy", "place"):
                for prefix, short in prefixes.items():
                    if prefix in (text := getattr(error, part)):
                        setattr(error, part, text.replace(prefix, short))
            raise


@cache
def _endings() -> tuple[str, ...]:
    return tuple({ending for table in tables("readers") for format_ in table for ending in format_.suffixes})


def _is_recording(name: str) -> bool:
    return name.lower().endswith(_endings())


def _plain_files(directory: Path) -> dict[str, os.stat_result]:
    try:
        with os.scandir(directory) as entries:
            plain = [e for e in entries if not e.name.startswith(".") and e.is_file(follow_symlinks=False)]
            return {entry.name: entry.stat(follow_symlinks=False) for entry in plain}
    except OSError:  # it is missing, or may not be read: there is nothing to choose from
        return {}


def _numbered(stem: str, ending: str = "") -> Iterator[str]:
    yield stem + ending
    for number in count(2):
        yield f"{stem}-{number}{ending}"
