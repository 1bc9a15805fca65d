"""run.json: description of a run, with a checksum, and a copy that is read if it is damaged."""

from __future__ import annotations

import json
import os
import re
import zlib
from pathlib import Path
from typing import Any

from livebode.core import RecordError, nearest_name
from livebode.records.inside import read_bytes
from livebode.records.json_format import check_version, format_of, to_json

RUN, COPY = "run.json", "run-copy.json"
_SIZE_BYTES_MAX = 64 << 20
_LISTED_MAX = 20  # runs beside a missing one
_CHECKSUM = re.compile(r',\n  "crc32": "([0-9a-f]{8})"\n\}\n?\Z')


def to_document(summary: dict[str, Any], name: str = "run") -> bytes:
    """A document as JSON over several lines; its last key is the CRC-32 of the text without that key.

    `name` is that of its format.

    >>> print(to_document({"found": {}}).decode(), end="")
    {
      "format": "livebode run",
      "version": 3,
      "found": {},
      "crc32": "d1a35dfe"
    }
    """
    text = to_json(format_of(name) | summary, indent=2)
    return f'{text[:-2]},\n  "crc32": "{zlib.crc32(text.encode()):08x}"\n}}\n'.encode()


def from_document(data: bytes) -> dict[str, Any]:
    """The summary with its format, without its checksum; ValueError if it is not as it was written.

    Null values are treated as missing.

    >>> from_document(to_document({"found": {"rate_hz": 1000}}))
    {'format': 'livebode run', 'version': 3, 'found': {'rate_hz': 1000}}
    >>> from_document(to_document({"found": {"rate_hz": 1000}}).replace(b"1000", b"1001"))
    Traceback (most recent call last):
    ValueError: its checksum is wrong
    """
    try:
        text = data.decode("utf-8")
        end = _CHECKSUM.search(text)
        if end is None:
            raise ValueError("it has no checksum")
        text = text[: end.start()] + "\n}"
        if f"{zlib.crc32(text.encode()):08x}" != end[1]:
            raise ValueError("its checksum is wrong")
        found = json.loads(text)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    if not isinstance(found, dict):
        raise ValueError("it is not an object")
    return {name: value for name, value in found.items() if value is not None}


def read_summary(run: Path) -> tuple[dict[str, Any], str]:
    """Content of run.json, or of its copy if it is damaged; then also a message on this.

    The copy is also read if run.json is missing.

    Raises
    ------
    RecordError
        If neither can be read, this is not the directory of a run, or another version of livebode wrote it.
    """
    try:
        return _read(run, RUN), ""
    except (FileNotFoundError, NotADirectoryError):
        if not is_run(run):
            raise _not_a_run(run) from None
        path = str(run / RUN)
        first = RecordError("damaged", f"{path!r} is missing", "restore it from a backup", path=path)
    except RecordError as error:
        first = error
    except OSError as error:
        path = str(run / RUN)
        first = RecordError(
            "unreadable",
            f"{path!r} cannot be read: {error}",
            "check its permissions",
            path=path,
            reason=str(error),
            errno=error.errno,
        )
    try:
        return _read(run, COPY), f"{first.message}; its copy {COPY} is read instead"
    except (OSError, RecordError):
        raise first from None


def is_run(directory: Path) -> bool:
    """Whether a directory has run.json, or its copy: what else is in it may then belong to a run."""
    return os.path.lexists(summary_path(directory))


def summary_path(run: Path) -> Path:
    """run.json of a run, or its copy where that is missing."""
    return run / (COPY if not os.path.lexists(run / RUN) and os.path.lexists(run / COPY) else RUN)


def copy_damage(run: Path) -> str:
    """What is wrong with the copy of an intact run.json; empty if it is intact too, or missing."""
    try:
        _read(run, COPY)
    except FileNotFoundError:
        return ""
    except (OSError, RecordError) as error:
        reason = error.message if isinstance(error, RecordError) else str(error)
        return f"{reason}; {RUN} is intact, so nothing is lost"
    return ""


def _not_a_run(run: Path) -> RecordError:
    message, remedy = f"{str(run)!r} is not the directory of a run: it has no run.json", "give the directory of a run"
    if run.is_file():
        message = f"{str(run)!r} is a file, not the directory of a run"
        remedy = f"run it, and give the directory that this writes: livebode run {run}"
    elif not run.exists():
        message = f"there is no directory {str(run)!r}"
        runs = [found.parent.name for found in sorted(run.parent.glob(f"*/{RUN}"))[:_LISTED_MAX]]
        if runs:
            remedy = nearest_name(run.name, runs, f"Runs in {run.parent}")
    return RecordError("not-a-run", message, remedy, path=str(run))


def _read(run: Path, name: str) -> dict[str, Any]:
    data = read_bytes(run, name, _SIZE_BYTES_MAX)
    try:
        found = from_document(data)
    except ValueError as error:
        path = str(run / name)
        raise RecordError(
            "damaged", f"{path!r} is damaged: {error}", "restore it from a backup", path=path, reason=str(error)
        ) from None
    if found.pop("format", None) != format_of("run")["format"]:
        raise RecordError(
            "not-a-run",
            f"{str(run / name)!r} does not describe a run of livebode",
            "give the directory of a run",
            path=str(run),
        )
    check_version(run / name, "run", found.pop("version", None))
    return found
