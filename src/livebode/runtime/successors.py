"""Names of the runs that continue a run after changes of its configuration: NAME, NAME-2, NAME-3, …"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from livebode.configuration import Axes
from livebode.core import LivebodeError
from livebode.records import read_summary
from livebode.runtime.same_run import continues


def newest(directory: Path) -> Path:
    """The newest run that continues the one in this directory; the directory itself if there is none."""
    return [directory, *_after(directory)][-1]


def all_of(directory: Path) -> list[Path]:
    """This run and those that continue it, by age."""
    return [directory, *_after(directory)]


def free(directory: Path) -> Path:
    """Directory for the next run that continues this one: the first free name after the newest."""
    number = _number(newest(directory), directory) + 1
    while (path := _named(directory, number)).exists():
        number += 1
    return path


def next_run(directory: Path, axes: Axes) -> Path:
    """Directory for another run of these axes whose place is not specified: NAME, or the first free NAME-2, NAME-3, …

    Live sources continue the newest one instead, if it has their configuration: with another one, a new run begins.
    """
    last = directory
    number = 1
    while (path := _named(directory, number)).exists() or number == 1:
        if "continues" not in _summary(path):
            last = path
        number += 1
    if not directory.exists() or _continue(last, axes):
        return last
    return path


def _continue(directory: Path, axes: Axes) -> bool:
    runs = {name: newest(directory / name) for name in axes}
    return all(
        axis.source.live and (not (run := runs[name]).exists() or continues(_summary(run), axis))
        for name, axis in axes.items()
    )


def _after(directory: Path) -> list[Path]:
    before = {}
    for path in directory.parent.glob("*"):
        if _number(path, directory) > 1 and (name := _summary(path).get("continues")) is not None:
            before[str(name)] = path
    found, name = [], directory.name
    while name in before:
        path = before.pop(name)
        found.append(path)
        name = path.name
    return found


def _named(directory: Path, number: int) -> Path:
    return directory if number == 1 else directory.with_name(f"{directory.name}-{number}")


def _number(path: Path, first: Path) -> int:
    """1 for the first, 2 for NAME-2, 0 for any other."""
    if path.name == first.name:
        return 1
    text = path.name.removeprefix(f"{first.name}-")
    return int(text) if text != path.name and text.isascii() and text.isdecimal() and len(text) < 10 else 0


def _summary(path: Path) -> dict[str, Any]:
    try:
        return read_summary(path)[0]
    except LivebodeError:
        return {}
