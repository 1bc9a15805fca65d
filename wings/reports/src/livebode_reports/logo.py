"""The logo of a report: a small PNG or SVG file that loads nothing."""

from __future__ import annotations

import re
from pathlib import Path

from livebode.core import ConfigError, Logo

BYTES_MAX = 1 << 20
_PIXELS_MAX = 4000
# Nothing that names another file, executes, or grows when it is parsed.
_ACTIVE = re.compile(
    rb"<!DOCTYPE|<!ENTITY|<script|<foreignObject|\bon\w+\s*=|@import|href\s*=\s*[\"'](?!#|data:)", re.I
)


def read_logo(path: Path, text: str) -> Logo:
    """Read the file; `text` replaces it for a screen reader.

    Raises
    ------
    ConfigError
        If it cannot be read, is too large, or is not a PNG or a passive SVG.
    """
    try:
        with path.open("rb") as file:
            data = file.read(BYTES_MAX + 1)
    except OSError as error:
        raise ConfigError(
            "file-unreadable",
            f"the logo {str(path)!r} cannot be read: {error.strerror}",
            "correct the name of the logo",
            path=str(path), key="report.logo",
        ) from None  # fmt: skip
    if len(data) > BYTES_MAX:
        raise _unusable(path, f"has more than {BYTES_MAX >> 20} MiB")
    if data.startswith(b"\x89PNG\r\n"):
        _check_png(path, data)
        return Logo(data, "png", text)
    _check_svg(path, data)
    return Logo(data, "svg", text)


def _check_png(path: Path, data: bytes) -> None:
    from io import BytesIO

    from PIL import Image

    try:
        with Image.open(BytesIO(data), formats=["PNG"]) as image:
            size = image.size
            if max(size) <= _PIXELS_MAX:
                image.load()
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError):
        raise _unusable(path, "is damaged") from None
    if max(size) > _PIXELS_MAX:
        raise _unusable(path, f"has {size[0]} × {size[1]} pixels, more than {_PIXELS_MAX} on a side")


def _check_svg(path: Path, data: bytes) -> None:
    from xml.etree import ElementTree

    if found := _ACTIVE.search(data):
        what = found.group().decode("ascii", "replace")
        raise _unusable(path, f"contains {what!r}: a logo may not load or execute anything")
    try:
        root = ElementTree.fromstring(data)
    except ElementTree.ParseError:
        raise _unusable(path, "is neither a PNG nor an SVG") from None
    if root.tag != "{http://www.w3.org/2000/svg}svg":
        raise _unusable(path, "is neither a PNG nor an SVG")


def _unusable(path: Path, why: str) -> ConfigError:
    return ConfigError(
        "file-unusable",
        f"the logo {str(path)!r} {why}",
        "give a PNG or SVG file of at most 1 MiB",
        path=str(path), key="report.logo",
    )  # fmt: skip
