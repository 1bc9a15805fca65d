"""An SVG of livebode, read back: that it is one file of text and shapes, and where its shapes are."""

from __future__ import annotations

import re
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

SVG = "{http://www.w3.org/2000/svg}"
_KNOWN = {f"{SVG}{tag}" for tag in ("svg", "style", "rect", "path", "circle", "text", "image")}
_POSITIONS = ("d", "x", "y", "width", "height", "cx", "cy", "viewBox", "stroke-width")
_TOKEN = re.compile(r"[a-zA-Z]|-?\d+(?:\.\d+)?")
_NUMBERS = {"M": 2, "m": 2, "L": 2, "l": 2, "H": 1, "h": 1, "V": 1, "v": 1, "z": 0}


def checked(text: str) -> Element:
    """The picture, which is valid XML, has no script, and refers to nothing outside of it."""
    root = ElementTree.fromstring(text)
    for element in root.iter():
        numbers = " ".join(value for name, value in element.attrib.items() if name in _POSITIONS)
        assert not re.search("nan|inf|None", numbers), numbers
        assert element.tag in _KNOWN, element.tag
        assert not [name for name in element.attrib if name.startswith("on") or name in ("id", "style")], element.attrib
        assert element.get("href", "data:image/png;base64,").startswith("data:image/png;base64,")
    assert "url(" not in text
    return root


def paths_of(root: Element, name: str) -> list[tuple[Element, list[NDArray[np.float64]]]]:
    """Each path of this name with the points of its parts, in tenths of a unit from the corner of its panel."""
    return [(path, _points(path.get("d", ""))) for path in root.iter(f"{SVG}path") if path.get("class") == name]


def _points(path: str) -> list[NDArray[np.float64]]:
    parts: list[list[tuple[float, float]]] = []
    tokens, command, at = _TOKEN.findall(path), "", (0.0, 0.0)
    i = 0
    while i < len(tokens):
        if tokens[i].isalpha():
            command, i = tokens[i], i + 1
        values = [float(token) for token in tokens[i : i + _NUMBERS[command]]]
        i += len(values)
        if not values:
            continue
        at = _moved(command, values, at)
        if command in "Mm":
            parts.append([at])
        else:
            parts[-1].append(at)
    return [np.array(part) for part in parts]


def _moved(command: str, values: list[float], at: tuple[float, float]) -> tuple[float, float]:
    x, y = at if command.islower() else (0.0, 0.0)
    if command in "Hh":
        return x + values[0], at[1]
    if command in "Vv":
        return at[0], y + values[0]
    return x + values[0], y + values[1]
