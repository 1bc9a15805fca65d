"""XML without the features that make reading a file dangerous."""

from __future__ import annotations

from pathlib import Path
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from livebode.core import RecordingError
from livebode.sources import oversized

BYTES_MAX = 1 << 28
DEPTH_MAX = 64
ELEMENTS_MAX = 1 << 20
TOKEN_BYTES_MAX = 1 << 20
"""Longest tag, comment or instruction: the parser reads an incomplete one again with each new piece."""
_PIECE_BYTES = 1 << 16


def parse(path: Path, first: int = 0, length: int | None = None) -> Element:
    """Root element of the document.

    Parameters
    ----------
    path, first, length
        The file, and the bytes of the document in it. Default: all of them.

    Raises
    ------
    RecordingError
        For a document type or entity declaration (they can expand without bound or name other files), for more than
        256 MiB, 64 levels, a million elements or 1 MiB in one tag, and for text that is not XML.
    """
    size = path.stat().st_size - first if length is None else length
    if size > BYTES_MAX:
        raise oversized(f"{path} has {size} bytes of XML, more than {BYTES_MAX}", BYTES_MAX, path=str(path), bytes=size)
    builder, depth, elements = TreeBuilder(), 0, 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth, elements
        depth, elements = depth + 1, elements + 1
        if elements > ELEMENTS_MAX:
            raise oversized(f"{path} has more than {ELEMENTS_MAX} elements", ELEMENTS_MAX, path=str(path))
        if depth > DEPTH_MAX:
            raise oversized(f"{path} is nested deeper than {DEPTH_MAX} levels", DEPTH_MAX, path=str(path))
        builder.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    def refuse(*_: object) -> None:
        raise RecordingError(
            "declaration-refused",
            f"{path} declares a document type or entities, which are not read",
            "remove the declaration",
            path=str(path),
        )

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = builder.data
    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = refuse
    with path.open("rb") as file:
        file.seek(first)
        while piece := file.read(min(_PIECE_BYTES, first + size - file.tell())):
            parser.Parse(piece)
            if file.tell() - first - parser.CurrentByteIndex > TOKEN_BYTES_MAX:
                position = parser.CurrentByteIndex
                raise oversized(
                    f"{path} has a tag or comment of more than {TOKEN_BYTES_MAX} bytes at byte {position}",
                    TOKEN_BYTES_MAX,
                    path=str(path),
                    byte=position,
                )
    parser.Parse(b"", True)
    return builder.close()
