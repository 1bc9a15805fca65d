"""Matplotlib's SVG with wide letters measured as wide: its fonts lack them, the fonts of the browser do not."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TextIO

from livebode.core import needing
from livebode.pictures import wide_letters

with needing("Matplotlib", "plots", "a picture"):
    from matplotlib.backends.backend_mixed import MixedModeRenderer
    from matplotlib.backends.backend_svg import RendererSVG

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LACKING = 0.4  # of the size: a wide letter is as wide as its size, and the box for an unknown one 0.6 of it


def draw_svg(figure: Figure, file: TextIO) -> None:
    """Write the figure as SVG, without date."""
    width_in, height_in = figure.get_size_inches()
    before, figure.dpi = figure.dpi, 72
    metadata = {"Date": None, "Creator": None}
    try:
        vector = _Wide(72 * width_in, 72 * height_in, file, image_dpi=before, metadata=metadata)  # type: ignore[no-untyped-call]
        mixed: Any = MixedModeRenderer(figure, width_in, height_in, before, vector)  # type: ignore[no-untyped-call]
        figure.draw(mixed)
        mixed.finalize()
    finally:
        figure.dpi = before


class _Wide(RendererSVG):
    def get_text_width_height_descent(self, s: str, prop: Any, ismath: Any) -> tuple[float, float, float]:
        width, height, descent = super().get_text_width_height_descent(s, prop, ismath)  # type: ignore[no-untyped-call]
        return width + _LACKING * wide_letters(s) * prop.get_size_in_points(), height, descent
