"""XML without the parts of XML that make reading a file dangerous."""

from __future__ import annotations

from pathlib import Path
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from livebode.core import InputError

BYTES_MAX = 1 << 28
DEPTH_MAX = 64
ELEMENTS_MAX = 1 << 20
TOKEN_BYTES_MAX = 1 << 20
"""Longest tag, comment or instruction: the parser reads an unfinished one again with every piece of it."""
_PIECE_BYTES = 1 << 16


def parse(path: Path) -> Element:
    """Root element of the document.

    Raises
    ------
    InputError
        For a document type or entity declaration (they can expand without bound or name other files), for more than
        256 MiB, 64 levels, a million elements or 1 MiB in one tag, and for text that is not XML.
    """
    if (size := path.stat().st_size) > BYTES_MAX:
        raise InputError(f"{path} has {size} bytes of XML, more than {BYTES_MAX}; is it a measurement?")
    builder, depth, elements = TreeBuilder(), 0, 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth, elements
        depth, elements = depth + 1, elements + 1
        if elements > ELEMENTS_MAX:
            raise InputError(f"{path} has more than {ELEMENTS_MAX} elements; is it a measurement?")
        if depth > DEPTH_MAX:
            raise InputError(f"{path} nests deeper than {DEPTH_MAX} levels; is it a measurement?")
        builder.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    def refuse(*_: object) -> None:
        raise InputError(f"{path} declares a document type or entities, which are not read; take the declaration out")

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = builder.data
    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = refuse
    with path.open("rb") as file:
        while piece := file.read(_PIECE_BYTES):
            parser.Parse(piece)
            if file.tell() - parser.CurrentByteIndex > TOKEN_BYTES_MAX:
                raise InputError(
                    f"{path} has a tag or comment of more than {TOKEN_BYTES_MAX} bytes at byte "
                    f"{parser.CurrentByteIndex}; is it a measurement?"
                )
    parser.Parse(b"", True)
    return builder.close()
