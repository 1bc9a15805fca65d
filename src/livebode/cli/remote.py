"""URLs among the arguments of a command: runs that are read, where results are written, and where a run is recorded."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import wraps
from pathlib import Path
from typing import Any, TypeVar

from livebode.core import LocationError
from livebode.locations import Location, Url

T = TypeVar("T")
_COLLAPSED = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+:[/\\]")
"""How a URL begins that was taken for a path, which has no empty part."""


def with_copies(command: Callable[..., T]) -> Callable[..., T]:
    """The command, of which an argument that is a `Url` becomes the path of a copy for as long as it runs.

    LocationError if a URL was given where only a path is possible.
    """

    @wraps(command)
    def with_paths(**given: Any) -> T:
        with ExitStack() as copies:
            return command(**{name: _here(value, name, copies) for name, value in given.items()})

    return with_paths


def _here(value: Any, name: str, copies: ExitStack) -> Any:
    if isinstance(value, list):
        return [_here(one, name, copies) for one in value]
    if isinstance(value, Url):
        from livebode.locations import local_copy

        return copies.enter_context(local_copy(value))
    if isinstance(value, Path) and _COLLAPSED.match(str(value)) and not Path(value.parts[0]).exists():
        raise LocationError(
            "not-possible",
            f"{name} is the URL {_restored(value)}, and only a file or directory of this computer is possible",
            "use a path; copy files from or to the URL with the tools of the storage",
            argument=name,
            path=_restored(value),
        )
    return value


def _restored(path: Path) -> str:
    scheme, _, rest = path.as_posix().partition(":/")
    return str(Url(f"{scheme}://{rest}"))


def results_directory(run: Path) -> Path:
    """Where results about a run are written: its directory, or for one at a URL a directory of its name here."""
    from livebode.locations import is_copy

    if not is_copy(run):
        return run
    own = Path(run.name)
    own.mkdir(exist_ok=True)
    return own


def beside(run: Path) -> Path:
    """What the name of a file beside a run begins with: the run, or for one at a URL its name in this directory."""
    from livebode.locations import is_copy

    return Path(run.name) if is_copy(run) else run.resolve()


@contextmanager
def recorded_at(place: Location, *, segments: bool) -> Iterator[tuple[Path, Callable[[], None]]]:
    """The directory in which a run for this place is recorded, and what uploads it if that is a URL.

    LocationError if the run is recorded with a journal, or something is at the URL.
    """
    if isinstance(place, Path):
        yield place, _nothing
        return
    if segments:
        raise LocationError(
            "not-possible",
            f"a run in segments grows and cannot be recorded at {place}",
            "record it to a path; copy it to the URL with the tools of the storage when it is finished",
            argument="out",
            path=str(place),
        )
    from livebode.locations import Upload

    with Upload(place) as upload:
        yield upload.path, upload.send


def _nothing() -> None:
    """A run at a path is in its place."""
