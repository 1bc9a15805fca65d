"""The pictures of a document as SVG: their colours follow the light or dark page, and their text remains text."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TextIO

from livebode.core import Document, Picture, needing
from livebode.language import Message, numerals, worded
from livebode.pictures import DARK, LIGHT, Style, drawing, quiet_about_letters, wide_letters
from livebode.plugins import loaded

with needing("Matplotlib", "plots", "a picture"):
    from matplotlib.backends.backend_mixed import MixedModeRenderer
    from matplotlib.backends.backend_svg import RendererSVG
    from matplotlib.ticker import Formatter

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_PROLOGUE = re.compile(r"^.*?(?=<svg)", re.S)
_METADATA = re.compile(r"<metadata>.*?</metadata>", re.S)
_SIZE = re.compile(r'<svg [^>]*?viewBox="([^"]+)"[^>]*>')
# Only names in <defs> and of clip paths are referenced; all other names repeat from figure to figure.
_NAMED = re.compile(r'<g id="[^"]*">')
_STYLE = re.compile(r'style="[^"]*"')
_COLOUR = re.compile(r"#[0-9a-f]{6}")
_FONT = "'DejaVu Sans'"


def pictures_svg(document: Document) -> tuple[str, ...]:
    """The pictures of the document in the light look, each as one SVG that names nothing as another one does."""
    return tuple(_svg(drawn(picture), f"p{i}") for i, picture in enumerate(document.pictures))


def themed_svg(svg: str, label: str) -> str:
    """A picture as an element of a page, whose colours are the variables of `variables`.

    Parameters
    ----------
    svg
        From `pictures_svg`.
    label
        Text alternative for screen readers; already escaped.
    """
    svg = _SIZE.sub(rf'<svg class="figure" viewBox="\1" role="img" aria-label="{_literal(label)}">', svg, count=1)
    return _STYLE.sub(lambda style: _themed(style.group()), svg)


def _svg(figure: Figure, salt: str) -> str:
    import matplotlib

    text = io.StringIO()
    with drawing(LIGHT), matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": salt}), quiet_about_letters():
        from livebode_reports.svg import draw_svg

        draw_svg(figure, text)
    svg = _METADATA.sub("", _PROLOGUE.sub("", text.getvalue(), count=1), count=1)
    return _NAMED.sub("<g>", svg)


def variables(look: Style) -> str:
    """The colours of this look as CSS variables, named after those of the light look."""
    return " ".join(f"--c{light[1:]}: {own};" for light, own in _pairs(look).items())


def _pairs(look: Style) -> dict[str, str]:
    names = ("paper", "muted", "grid", "nothing")
    colours = dict(zip(LIGHT.traces, look.traces))
    # Last, so that a colour that a trace shares gets the dark colour of its main use.
    named = ("ink", "run", "newest", *names)
    return colours | {getattr(LIGHT, name): getattr(look, name) for name in named}


def _themed(declaration: str) -> str:
    fonts = declaration.replace(_FONT, f"{_FONT}, Verdana, sans-serif")
    return _COLOUR.sub(lambda c: f"var(--c{c.group()[1:]}, {c.group()})" if c.group() in _KNOWN else c.group(), fonts)


def _literal(text: str) -> str:
    return text.replace("\\", "\\\\")


_KNOWN = frozenset(_pairs(DARK))


WIDTH_IN = 9.0
"""Width of all pictures of a document; on A4 they are scaled to three quarters, with letters of 7 points."""


_FIGURES: Mapping[str, tuple[str, str, bool]] = {
    "bode": ("livebode.pictures:bode_figure", Message("Average response"), False),
    "tracking": ("livebode.pictures:tracking_figure", Message("Magnitude over time"), True),
    "parameters": ("livebode_reports.parameters:parameters_figure", "", False),
    "matrix": ("livebode.pictures:matrix_figure", Message("Matrix of responses"), True),
    "singular values": ("livebode.pictures:singular_values_figure", Message("Singular values"), False),
    "comparison": ("livebode_reports.comparison:comparison_figure", "", False),
    "places": ("livebode_reports.comparison:places_figure", "", False),
}
"""What draws each kind, its title, and whether it needs the width of the page."""


def drawn(picture: Picture) -> Figure:
    """The picture in the light look and the language in use."""
    figure = _figure(picture)
    localise_ticks(figure)
    return figure


def _figure(picture: Picture) -> Figure:
    reference, title, wide = _FIGURES.get(picture.what, (picture.what, "", True))
    options: dict[str, Any] = {"title": worded(title)} if title else {}
    if wide:
        options["width_in"] = WIDTH_IN
    figure: Figure = loaded(reference)(**picture.data, **options)
    return figure


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


def localise_ticks(figure: Figure) -> None:
    """Let all axes of the figure format their numbers as before, in the language in use."""
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter(_Local(axis.get_major_formatter()))


class _Local(Formatter):
    def __init__(self, usual: Formatter) -> None:
        self._usual = usual

    def set_axis(self, axis: Any) -> None:
        super().set_axis(axis)
        self._usual.set_axis(axis)

    def set_locs(self, locs: list[float]) -> None:
        super().set_locs(locs)
        self._usual.set_locs(locs)

    def __call__(self, x: float, pos: int | None = None) -> str:
        return numerals(self._usual(x, pos))

    def get_offset(self) -> str:
        return numerals(self._usual.get_offset())
