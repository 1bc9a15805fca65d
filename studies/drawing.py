"""The look of the studies' figures: that of livebode's own pictures."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from livebode.pictures import drawing, heading, new_figure, plain
from livebode.pictures._style import LIGHT

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["LIGHT", "figure_of", "spread"]

HEAD_IN = 0.85


@contextmanager
def figure_of(title: str, facts: str, size_in: tuple[float, float]) -> Iterator[Figure]:
    """An empty figure with the head that every picture has; laid out at the end."""
    with drawing(LIGHT):
        figure = new_figure(*size_in)
        yield figure
        for axes in figure.axes:
            plain(axes)
        figure.tight_layout(rect=(0, 0, 1, 1 - HEAD_IN / size_in[1]))
        heading(figure, LIGHT, title, facts, 0.2 / size_in[0])


def spread(heights: NDArray[np.float64], least: float) -> NDArray[np.float64]:
    """Ascending heights of labels, moved apart to at least this distance."""
    moved = np.array(heights, dtype=np.float64)
    for i in range(1, len(moved)):
        moved[i] = max(moved[i], moved[i - 1] + least)
    return moved - np.mean(moved - heights)
