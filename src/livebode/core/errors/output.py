"""Files that cannot be written."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class OutputError(LivebodeError):
    """A file that was asked for cannot be written.

    Examples
    --------
    >>> import livebode
    >>> from pathlib import Path
    >>> from livebode.export import save
    >>> try:
    ...     save(Path("."), write=Path.touch)
    ... except livebode.OutputError as error:
    ...     print(error.code)
    output.is-directory
    """

    area: ClassVar[str] = "output"
    codes: ClassVar[Mapping[str, str]] = {
        "exists": "The file or directory exists already, and is replaced only on request.",
        "is-directory": "The path of the file is a directory.",
        "no-font": "This computer has no font with the letters of the language, and a PDF contains its fonts.",
        "not-archivable": "The content cannot be written as PDF/A.",
        "not-replaceable": "The directory contains something else than an earlier output, and is not replaced.",
        "not-written": "The system refuses to write the output.",
        "too-large": "There are more values than can be written in this format.",
    }
