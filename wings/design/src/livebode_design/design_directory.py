"""The directory of a design: its files, and what may be replaced in it."""

from __future__ import annotations

import json
from pathlib import Path

from livebode.core import ConfigError, OutputError, UsageError, remove_empty, remove_files
from livebode_design.files import FORMATS

MARK, AXIS, SCHEMA = "design.json", "axis.toml", "axis.schema.json"


def check_names(name: str, log: str) -> None:
    """UsageError or ConfigError if the excitation or the recording cannot have this name."""
    if not name.strip() or not name.isprintable() or name.startswith(".") or Path(name).name != name:
        raise UsageError(
            "invalid-name",
            f"{name!r} cannot be the name of a file",
            "choose letters, digits and underscores",
            argument="name",
            value=name,
        )
    if not log.isprintable() or not Path(log).name:
        raise ConfigError(
            "value-invalid",
            f"log = {log!r} cannot be the file of a recording",
            "specify one such as 'log.csv'",
            key="log",
            value=log,
        )
    if log in (MARK, AXIS, SCHEMA, f"{name}.png", *(f"{name}{kind}" for kind in FORMATS)):
        raise ConfigError(
            "key-conflict",
            f"log = {log!r} is a file of the design",
            "give the recording another name",
            key="log",
            value=log,
        )


def check_free(directory: Path, force: bool) -> None:
    """OutputError if the directory exists and must not be replaced."""
    if not (directory.exists() or directory.is_symlink()):
        return
    if not force:
        raise OutputError(
            "exists",
            f"{str(directory)!r} exists already",
            "choose another directory, or replace it with force",
            path=str(directory),
        )
    own = set() if directory.is_symlink() else _left_by(directory)
    if not own:
        raise OutputError(
            "not-replaceable",
            f"{str(directory)!r} is not the directory of an earlier design",
            "choose another directory",
            path=str(directory),
        )
    if others := sorted(
        path.name for path in directory.iterdir() if path.name not in own or path.is_symlink() or not path.is_file()
    ):
        raise OutputError(
            "not-replaceable",
            f"{str(directory)!r} also contains {others[0]!r}, which is not from a design",
            "move it, or choose another directory",
            path=str(directory),
            name=others[0],
        )


def remove_design(directory: Path) -> None:
    """Remove the files of an earlier design, and the directory if it is then empty; OSError if it is not."""
    remove_files(directory, sorted(_left_by(directory), key=lambda name: name == MARK))
    remove_empty(directory)


def _left_by(directory: Path) -> set[str]:
    """The files that design.json lists; none if it is not that of a design."""
    mark = directory / MARK
    if mark.is_symlink() or not mark.is_file():
        return set()
    try:
        listed = json.loads(mark.read_text(encoding="utf-8"))["files"]
        names = {name for name in listed if isinstance(name, str)}
    except (OSError, ValueError, KeyError, TypeError):
        return set()
    excitations = names - {MARK, AXIS, SCHEMA}
    one = len({Path(name).stem for name in excitations}) == 1
    plain = all(Path(name).suffix in (*FORMATS, ".png") and Path(name).name == name for name in excitations)
    return names if one and plain and len(names - excitations) == 3 else set()
