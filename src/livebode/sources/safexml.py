"""XML without the parts of XML that make reading a file dangerous."""

from __future__ import annotations

from pathlib import Path
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from livebode.nouns import InputError

BYTES_MAX = 1 << 28
DEPTH_MAX = 64


def parse(path: Path) -> Element:
    """Root element of the document.

    Raises
    ------
    InputError
        For a document type or entity declaration (they can expand without bound or name other files), for more than
        256 MiB or 64 levels, and for text that is not XML.
    """
    if (size := path.stat().st_size) > BYTES_MAX:
        raise InputError(f"{path} has {size} bytes of XML, more than {BYTES_MAX}; is it a measurement?")
    builder, depth = TreeBuilder(), 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
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
        parser.ParseFile(file)
    return builder.close()
