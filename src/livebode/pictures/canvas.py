"""Canvas: curves as Braille dots in the cells of a terminal."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby

import numpy as np
from numpy.typing import NDArray
from rich.style import Style

from livebode.arrays import Floats
from livebode.pictures._style import shortened

_BRAILLE = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
_CURVE, _CIRCLE = Style(color="cyan"), Style(color="bright_yellow")
_PLAIN = str.maketrans(
    {"─": "-", "│": "|", "–": "-", "−": "-", "…": "~", "·": "*", "×": "x", "°": "deg", "²": "2", "µ": "u", "μ": "u"}
    | dict.fromkeys("┌┐└┘├┤┬┴┼", "+")
    | {"Ω": "Ohm", "ω": "w", "φ": "phi", "θ": "theta"}
)


@dataclass(frozen=True)
class Scale:
    """Linear from the first to the last of so many cells; `begin` may be larger than `end`."""

    begin: float
    end: float
    cells: int

    def dot(self, values: Floats, of_a_cell: int) -> NDArray[np.intp]:
        """Numbers of the dots at these values, so many in each cell."""
        share = (values - self.begin) / (self.end - self.begin)
        return np.clip((share * self.cells * of_a_cell).astype(np.intp), 0, self.cells * of_a_cell - 1)

    def cell(self, value: float) -> int:
        return int(self.dot(np.array([value]), 1)[0])


@dataclass(frozen=True)
class Canvas:
    """Cells of 4 × 2 dots, and the cells with a circle."""

    dots: NDArray[np.bool_]
    circles: NDArray[np.bool_]

    @classmethod
    def blank(cls, rows: int, columns: int) -> Canvas:
        return cls(np.zeros((4 * rows, 2 * columns), bool), np.zeros((rows, columns), bool))

    def row(self, row: int, colour: bool, unicode: bool) -> str:
        """Text of a row; its parts have the colour of a curve or a circle."""
        dots = self.dots[4 * row : 4 * row + 4].reshape(4, -1, 2)
        patterns = np.tensordot(dots, _BRAILLE, ((0, 2), (0, 1)))
        curve = [(chr(0x2800 + pattern) if unicode else ".") if pattern else " " for pattern in patterns.tolist()]
        circle = "●" if unicode else "o"
        cells = [circle if circled else letter for circled, letter in zip(self.circles[row].tolist(), curve)]
        if not colour:
            return "".join(cells)
        styles = {" ": Style(), circle: _CIRCLE}
        parts = groupby(cells, lambda letter: styles.get(letter, _CURVE))
        return "".join(style.render("".join(part)) for style, part in parts)


def written(text: str, width: int | None = None, unicode: bool = False) -> str:
    """Text in at most `width` columns; without Unicode, characters outside ASCII become question marks."""
    if not unicode:
        text = text.translate(_PLAIN).encode("ascii", "replace").decode()
    if width is not None:
        text = shortened(text, width)
    return text if unicode else text.translate(_PLAIN)
