"""Recordings that cannot be read: reads them to their end, and the sentence with which one is refused."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from livebode.core import LivebodeError, RecordingError
from tests.support.recordings import (
    open_log,
)


def drain(path: Path, **options: object) -> None:
    log = open_log(path, **options)
    assert log.skipped is not None
    assert log.aliases is not None
    for _ in log.blocks():
        pass


def refusal(path: Path, **options: object) -> LivebodeError:
    """The error of a file that cannot be read, in one line that names it."""
    with pytest.raises(RecordingError) as caught:
        drain(path, **options)
    assert "\n" not in str(caught.value)
    assert caught.value.path == str(path)
    assert str(path) in str(caught.value)
    return caught.value


def survives(path: Path, **options: object) -> bool:
    """True where the file could be read, False where it was refused in one line; anything else fails the test."""
    message = ""
    try:
        drain(path, **options)
    except RecordingError as error:
        message = str(error)
        json.dumps(error.as_dict())  # its facts are plain data
    assert "\n" not in message
    return not message


def text(folder: Path, content: str | bytes, name: str = "log.csv") -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path
