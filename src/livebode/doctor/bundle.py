"""The bundle: one ZIP with what a report of a fault needs, and without secrets."""

from __future__ import annotations

import logging
import platform
import sys
import zipfile
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

from livebode.core import LivebodeError
from livebode.doctor.check import Check, worst
from livebode.doctor.secrets import Secrets
from livebode.doctor.subject import Subject
from livebode.export import save
from livebode.kernel import instruction_sets
from livebode.records import RunRecord, to_json
from livebode.version import __version__

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
    read = (found.metadata for found in distributions())  # each time from its file
    packages = {one["Name"]: one["Version"] for one in read if one["Name"]}
    return {
        "livebode": __version__,
        "python": sys.version,
        "system": platform.platform(),
        "machine": platform.machine(),
        "instruction_sets": list(instruction_sets()),
        "packages": dict(sorted(packages.items(), key=lambda item: item[0].lower())),
    }
