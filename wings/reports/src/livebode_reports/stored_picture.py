"""A picture that a command has drawn in the directory of a run, as an element of a report."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

from livebode_reports.first_page import BYTES_MAX, svg_fault

_SVG = "{http://www.w3.org/2000/svg}"
_TAGS = {_SVG + name for name in ("svg", "rect", "path", "circle", "text")}  # those of a chart


def stored_svg(path: Path, label: str) -> str | None:
    """The picture in a file, without its own rules: those of the page are the same; None if livebode has not drawn it.

    Parameters
    ----------
    path
        The file, from a run that may come from elsewhere.
    label
        Text alternative for screen readers.
    """
    with path.open("rb") as file:
        data = file.read(BYTES_MAX + 1)
    if len(data) > BYTES_MAX or svg_fault(data) or b"url(" in data:
        return None
    root = ElementTree.fromstring(data)
    for style in root.findall(f"{_SVG}style"):
        root.remove(style)
    for element in root.iter():
        if element.tag not in _TAGS or any("{" in name or name == "style" for name in element.attrib):
            return None
        element.tag = element.tag.removeprefix(_SVG)
    root.set("xmlns", _SVG.strip("{}"))
    root.set("aria-label", label)
    return ElementTree.tostring(root, encoding="unicode")
