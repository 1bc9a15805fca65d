"""The bundle for a report of a problem, without secrets."""

from __future__ import annotations

import logging
import os
import platform
import re
import sys
import zipfile
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from importlib.metadata import distributions
from pathlib import Path
from typing import Any, get_args

from livebode.configuration import MAY_BE_SECRET, Axis, FileKind
from livebode.core import LivebodeError, TypedTable
from livebode.doctor.check import Check, worst
from livebode.doctor.subject import Subject
from livebode.export import save
from livebode.kernel import instruction_sets
from livebode.plugins import loaded
from livebode.records import RunRecord, to_json
from livebode.sources.live import parse_address, secret
from livebode.version import __version__

REMOVED = "[removed]"
_SECRET_NAME = re.compile(r"pass(word|wd|phrase)|secret|token|credential|auth|user|login|api_?key", re.IGNORECASE)
_USER_IN_URL = re.compile(r"(?<=://)[^\s\"'<>]*(?=@)")
_QUERY_IN_URL = re.compile(r"https?://[^\s\"'<>?]*\?([^\s\"'<>]+)")
_PIECES = re.compile(r"[^\w.%+~-]+")
_LETTERS_MIN = 4
"""A shorter text is not looked for in others: it is in many words."""


class Secrets:
    """Removes secrets, and remembers which it has removed.

    Parameters
    ----------
    folder
        Where relative paths of a configuration are from.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._found: set[str] = set()

    def configuration(self, table: Mapping[str, Any], kind: FileKind | None = None) -> dict[str, Any]:
        """A configuration, valid or not, as plain data without secrets."""
        if kind is not None:
            return self._fields(table, loaded(kind.model))
        shared = {key: value for key, value in table.items() if key != "axes"}
        kept = self._fields(shared, Axis)
        if "axes" in table:
            axes = table["axes"]
            several = isinstance(axes, Mapping)
            kept["axes"] = {name: self._section(axis, Axis) for name, axis in axes.items()} if several else REMOVED
        return kept

    def plain(self, value: Any) -> Any:
        """Plain data without what was removed before, users in URLs, and values of keys that name a secret."""
        if isinstance(value, Mapping):
            return {
                self.text(str(key)): REMOVED if _SECRET_NAME.search(str(key)) else self.plain(inner)
                for key, inner in value.items()
            }
        if isinstance(value, list | tuple):
            return [self.plain(inner) for inner in value]
        return value if isinstance(value, int | float | None) else self.text(str(value))

    def text(self, text: str) -> str:
        """A text without what was removed before, and without users and queries in URLs."""
        for secret_part in (*_USER_IN_URL.findall(text), *_QUERY_IN_URL.findall(text)):
            self._removed(secret_part)
        for removed in sorted(self._found, key=len, reverse=True):
            text = text.replace(removed, REMOVED)
        return text

    def _section(self, table: Any, model: type[TypedTable]) -> Any:
        if isinstance(table, list):
            return [self._section(item, model) for item in table]
        if not isinstance(table, Mapping):
            return self._removed(table)
        return self._fields(table, model)

    def _fields(self, table: Mapping[str, Any], model: type[TypedTable]) -> dict[str, Any]:
        return {key: self._field(key, value, model) for key, value in table.items()}

    def _field(self, key: str, value: Any, model: type[TypedTable]) -> Any:
        field = model.model_fields.get(key)
        if field is None:
            return self._removed(value) if _SECRET_NAME.search(key) else REMOVED
        if key in MAY_BE_SECRET:
            return self._kept_where_harmless(key, value)
        inner = next(_models(field.annotation), None)
        return self.plain(value) if inner is None else self._section(value, inner)

    def _kept_where_harmless(self, key: str, value: Any) -> Any:
        """The name of a variable or file that is there, or an address; anything else may be the secret itself."""
        if not isinstance(value, str):
            return self._removed(value)
        name, _, kind = key.rpartition("_")
        if kind == "env" and value in os.environ:
            self._remember(name, variable=value)
            return value
        if kind == "file" and (path := self._folder / value).is_file():
            self._remember(name, path=path)
            return value
        if key == "url":
            try:
                parse_address(value)
                return value
            except LivebodeError:
                return self._removed(value)
        return REMOVED if key == "username" else self._removed(value)

    def _remember(self, name: str, variable: str | None = None, path: Path | None = None) -> None:
        try:
            self._note(secret("", name, variable, path) or "")
        except LivebodeError:
            return  # it cannot be read by us, so that nothing holds it

    def _removed(self, value: Any) -> str:
        """The mark in the place of a value, which no other text may repeat, not in pieces either."""
        for text in _texts(value):
            self._note(text)
            for piece in _PIECES.split(text.partition("://")[2] or text):
                self._note(piece)
        return REMOVED

    def _note(self, text: str) -> None:
        if len(text) >= _LETTERS_MIN:
            self._found.add(text)


def _models(annotation: Any) -> Iterator[type[TypedTable]]:
    """The models in a field's annotation."""
    if isinstance(annotation, type) and hasattr(annotation, "model_fields"):  # of a plug-in perhaps pydantic's own
        yield annotation
    for inner in get_args(annotation):
        yield from _models(inner)


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, Mapping):
        for inner in value.values():
            yield from _texts(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from _texts(inner)
    elif isinstance(value, str):
        yield value


PART_BYTES_MAX = 2 << 20
"""Of each file in the bundle, before it is compressed."""
EVENTS_MAX = 1000
_TOO_LONG = "left out: longer than {} bytes"


def write_bundle(path: Path, subject: Subject, checks: Sequence[Check], *, force: bool = False) -> list[str]:
    """Write the bundle, whole or not at all.

    Parameters
    ----------
    path
        The ZIP.
    subject
        Configuration and run, which are put in without secrets.
    checks
        Of `examine`.
    force
        Whether to replace a file that is there.

    Returns
    -------
    list[str]
        Names of the files in it.

    Raises
    ------
    OutputError
        If a file is there and not to be replaced, or it cannot be written.
    """

    def write(partial: Path) -> list[str]:
        with zipfile.ZipFile(partial, "w", zipfile.ZIP_DEFLATED) as bundle:
            for name, text in _parts(subject, checks):
                bundle.writestr(name, _bounded(text))
            return bundle.namelist()

    return save(path, write, force=force)


def _parts(subject: Subject, checks: Sequence[Check]) -> Iterator[tuple[str, str]]:
    folder = Path() if subject.configuration is None else subject.configuration.parent
    secrets = Secrets(folder)
    # First: what is removed here is removed from everything behind it.
    configuration = None
    if subject.table is not None:
        configuration = secrets.configuration(subject.table, subject.kind)
    run = None if subject.run is None else _summary(subject.run, secrets)
    yield "doctor.json", _json(secrets.plain({
        "written": f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}",
        "verdict": worst(check.verdict for check in checks),
        "checks": [check.as_dict() for check in checks],
    }))  # fmt: skip
    yield "versions.json", _json(versions())
    if configuration is not None:
        yield "configuration.json", _json(configuration)
    if subject.run is not None:
        yield "run.json", run or ""
        yield "events.jsonl", _newest_events(subject.run, secrets)
    for log in _log_files():
        yield f"logs/{log.name}", secrets.text(_end_of(log))


def _summary(run: RunRecord, secrets: Secrets) -> str:
    configuration = secrets.configuration(run.summary.get("configuration", {}))
    return _json(secrets.plain({**run.summary, "configuration": {}}) | {"configuration": configuration})


def _newest_events(run: RunRecord, secrets: Secrets) -> str:
    lines: deque[str] = deque(maxlen=EVENTS_MAX)
    try:
        for event in run.each_event():
            lines.append(to_json(secrets.plain(asdict(event))))
    except LivebodeError as error:
        lines.append(to_json({"error": secrets.text(str(error))}))
    return _end("".join(line + "\n" for line in lines))


def _log_files() -> list[Path]:
    """Which livebode's log is written to now."""
    handlers = logging.getLogger("livebode").handlers
    return [Path(handler.baseFilename) for handler in handlers if isinstance(handler, logging.FileHandler)]


def _end_of(path: Path) -> str:
    try:
        with path.open("rb") as file:
            file.seek(max(0, path.stat().st_size - PART_BYTES_MAX))
            return _end(file.read(PART_BYTES_MAX).decode("utf-8", errors="replace"))
    except OSError as error:
        return f"the log file cannot be read: {error.strerror}\n"


def _end(lines: str) -> str:
    """The newest whole lines that have room."""
    if len(lines) < PART_BYTES_MAX // 4:
        return lines
    return lines[-(PART_BYTES_MAX // 4) :].partition("\n")[2]


def _json(value: object) -> str:
    return to_json(value, indent=2) + "\n"


def _bounded(text: str) -> bytes:
    data = text.encode("utf-8", errors="replace")
    return data if len(data) <= PART_BYTES_MAX else f"{_TOO_LONG.format(PART_BYTES_MAX)}\n".encode()


def versions() -> dict[str, Any]:
    """livebode, Python, the system, the kernel's instruction sets, and every installed package."""
    read = (distribution.metadata for distribution in distributions())  # each time from its file
    packages = {metadata["Name"]: metadata["Version"] for metadata in read if metadata["Name"]}
    return {
        "livebode": __version__,
        "python": sys.version,
        "system": platform.platform(),
        "machine": platform.machine(),
        "instruction_sets": list(instruction_sets()),
        "packages": dict(sorted(packages.items(), key=lambda item: item[0].lower())),
    }
