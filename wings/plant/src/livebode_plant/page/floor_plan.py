"""Floor plan: an SVG of a hall, reduced to shapes and text, since a drawing may come from anyone."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final
from xml.etree import ElementTree as ET

from livebode.core import ConfigError

BYTES_MAX, ELEMENTS_MAX, DEPTH_MAX = 4 << 20, 50_000, 64
_SVG = "{http://www.w3.org/2000/svg}"
_SHAPES: Final = {
    "svg", "g", "path", "rect", "circle", "ellipse", "line", "polyline", "polygon", "text", "tspan", "title", "desc",
}  # fmt: skip
_IGNORED: Final = {"metadata", "defs", "namedview"}
_PRESENTATION: Final = {
    "fill", "fill-opacity", "fill-rule", "stroke", "stroke-width", "stroke-opacity", "stroke-dasharray",
    "stroke-linecap", "stroke-linejoin", "opacity", "font-size", "font-family", "font-weight", "font-style",
    "text-anchor", "display", "visibility",
}  # fmt: skip
_ATTRIBUTES: Final = _PRESENTATION | {
    "id", "data-axis", "d", "x", "y", "x1", "y1", "x2", "y2", "cx", "cy", "r", "rx", "ry", "width", "height", "points",
    "transform", "viewBox", "dx", "dy", "preserveAspectRatio",
}  # fmt: skip
_UNSAFE = re.compile(r"url\s*\(|javascript:|expression\s*\(|@import|\\", re.I)


def floor_plan(path: Path) -> str:
    """The drawing in a file as SVG that contains only shapes, text and their colours.

    Raises
    ------
    ConfigError
        If the file cannot be read, is not SVG, or contains scripts, event handlers, links, images, style sheets,
        entities or anything else that could load or run something.
    """
    try:
        if path.stat().st_size > BYTES_MAX:
            raise _refused(path, f"it is larger than {BYTES_MAX >> 20} MiB", "simplify the drawing")
        text = path.read_text("utf-8")
    except OSError as error:
        raise ConfigError(
            "file-unreadable", f"cannot read {str(path)!r}: {error.strerror}", "check the name", path=str(path)
        ) from None
    except UnicodeDecodeError:
        raise _refused(path, "it is not UTF-8", "save it as plain SVG") from None
    try:
        return sanitised(text)
    except ValueError as error:
        raise _refused(path, str(error), "save it as plain SVG with shapes and text only") from None


def sanitised(text: str) -> str:
    """The drawing without what is only for editors; ValueError with the reason if it contains what is not allowed."""
    if re.search(r"<!(DOCTYPE|ENTITY)|<\?xml-stylesheet", text, re.I):
        raise ValueError("it has a document type, entities or a style sheet")
    try:
        root = ET.fromstring(text)
    except (ET.ParseError, RecursionError, ValueError) as error:
        raise ValueError(f"it is not XML ({error})") from None
    if root.tag != f"{_SVG}svg":
        raise ValueError("it is not an SVG drawing")
    counted = [0]
    clean = _copied(root, counted, 0)
    if "viewBox" not in clean.attrib:
        size = [_length(clean.get(name)) for name in ("width", "height")]
        if None in size:
            raise ValueError("it has neither a viewBox nor a size")
        clean.set("viewBox", f"0 0 {size[0]:g} {size[1]:g}")
    for name in ("width", "height", "x", "y"):
        clean.attrib.pop(name, None)
    clean.set("xmlns", "http://www.w3.org/2000/svg")
    return ET.tostring(clean, encoding="unicode")


def _copied(source: ET.Element, counted: list[int], depth: int) -> ET.Element:
    counted[0] += 1
    if counted[0] > ELEMENTS_MAX or depth > DEPTH_MAX:
        raise ValueError(f"it has more than {ELEMENTS_MAX} elements, or more than {DEPTH_MAX} in each other")
    clean = ET.Element(source.tag.removeprefix(_SVG), dict(_attributes(source)))
    clean.text, clean.tail = source.text, source.tail
    for child in source:
        name = child.tag.rpartition("}")[2] if isinstance(child.tag, str) else ""
        if name in _IGNORED or not name:
            if name == "defs" and any(part.tag.rpartition("}")[2] in ("script", "style") for part in child.iter()):
                raise ValueError("it contains <style> or <script>")
            continue
        if name not in _SHAPES or not child.tag.startswith(_SVG):
            raise ValueError(f"it contains <{name}>")
        clean.append(_copied(child, counted, depth + 1))
    return clean


def _attributes(element: ET.Element) -> list[tuple[str, str]]:
    """Attributes that are allowed; those of a style become attributes, since the page allows no inline styles."""
    attributes = []
    for name, value in element.attrib.items():
        local = name.rpartition("}")[2]
        if local.lower().startswith("on") or local == "href":
            raise ValueError(f"it contains the attribute {local}")
        if name == "style":
            pairs = (part.partition(":")[::2] for part in value.split(";"))
            attributes += [(key.strip(), word.strip()) for key, word in pairs if key.strip() in _PRESENTATION]
        elif name in _ATTRIBUTES:
            attributes.append((name, value))
    for name, value in attributes:
        if name not in ("id", "data-axis") and _UNSAFE.search(value):
            raise ValueError(f"its attribute {name} refers to something else")
    return attributes


def _length(text: str | None) -> float | None:
    match = re.fullmatch(r"\s*([0-9.]+(?:e[+-]?\d+)?)\s*(?:px|mm|cm|in|pt)?\s*", text or "")
    try:
        return float(match[1]) if match else None
    except ValueError:
        return None


def _refused(path: Path, why: str, remedy: str) -> ConfigError:
    return ConfigError("file-unusable", f"the floor plan {str(path)!r} cannot be shown: {why}", remedy, path=str(path))
