"""Errors of the system on writing, as errors with a code: what, why, and what to do."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from livebode.core.errors import LivebodeError, OutputError, RecordError
from livebode.core.files import whole_files

_ROOM, _PERMISSIONS = "free some space, or choose another path", "check its permissions, or choose another path"
_KNOWN = {
    errno.ENOSPC: ("the disk is full", _ROOM),
    errno.EDQUOT: ("the disk quota is used up", _ROOM),
    errno.EFBIG: ("the file has its largest size", _ROOM),
    errno.EIO: ("the disk has an input/output error", "check the disk, or choose another path"),
    errno.EROFS: ("the disk is read-only", _PERMISSIONS),
    errno.EACCES: ("permission denied", _PERMISSIONS),
    errno.EPERM: ("permission denied", _PERMISSIONS),
}


def why(error: OSError | LivebodeError) -> str:
    """Description of a system error.

    >>> why(OSError(errno.ENOSPC, "No space left on device"))
    'the disk is full'
    """
    if not isinstance(error, OSError):
        return str(error)
    known = _KNOWN.get(error.errno or 0)
    return known[0] if known else error.strerror or str(error)


def not_written(
    path: Path | None,
    error: OSError,
    kind: type[OutputError | RecordError] = OutputError,
    *,
    unchanged: bool = True,
) -> OutputError | RecordError:
    """The error for a file or directory that the system refuses to write; None: the standard output.

    Parameters
    ----------
    path
        Its place.
    error
        The system's error.
    kind
        `RecordError` for a run.
    unchanged
        Whether the previous content is still there, because it is written whole (`livebode.core.files`).

    Examples
    --------
    >>> print(not_written(Path("healthy.json"), OSError(errno.ENOSPC, "No space left on device")))
    'healthy.json' could not be written: the disk is full; nothing was changed there; free some space, or choose \
another path
    """
    name, cause = "the output" if path is None else repr(str(path)), why(error)
    remedy = _KNOWN.get(error.errno or 0, ("", "check the path and its permissions"))[1]
    facts: dict[str, object] = {} if path is None else {"path": str(path)}
    facts |= {"reason": cause, "errno": error.errno}
    message = f"{name} could not be written: {cause}" + ("; nothing was changed there" if unchanged else "")
    if kind is RecordError:
        return RecordError("not-written", message, remedy, **facts)
    return OutputError("not-written", message, remedy, **facts)


@contextmanager
def writing(
    path: Path, kind: type[OutputError | RecordError] = OutputError, *, unchanged: bool = True
) -> Iterator[None]:
    """Within, an OSError is raised as `not_written`."""
    try:
        yield
    except OSError as error:
        raise not_written(path, error, kind, unchanged=unchanged) from None


@contextmanager
def output_files(folder: Path, name: str) -> Iterator[Path]:
    """A directory to write files to, which are moved to `folder` when the block ends: all of them, or none.

    Parameters
    ----------
    folder
        Created if it is missing.
    name
        What they are: one word.

    Raises
    ------
    OutputError
        Where the system refuses to write.
    """
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        with whole_files(folder, name) as partial:
            yield partial
