"""A figure as SVG in a page: its colours follow the light or dark page, and its text remains text."""

from __future__ import annotations

import io
import re
from typing import TYPE_CHECKING

from livebode.core import Document
from livebode.pictures import DARK, LIGHT, Style, drawing, quiet_about_letters
from livebode_reports.figures import drawn

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
    return _STYLE.sub(lambda found: _themed(found.group()), svg)


def _svg(figure: Figure, salt: str) -> str:
    import matplotlib

    text = io.StringIO()
    with drawing(LIGHT), matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": salt}), quiet_about_letters():
        from livebode_reports.svg_renderer import draw_svg

        draw_svg(figure, text)
    svg = _METADATA.sub("", _PROLOGUE.sub("", text.getvalue(), count=1), count=1)
    return _NAMED.sub("<g>", svg)


def variables(look: Style) -> str:
    """The colours of this look as CSS variables, named after those of the light look."""
    return " ".join(f"--c{light[1:]}: {own};" for light, own in _pairs(look).items())


def _pairs(look: Style) -> dict[str, str]:
    names = ("paper", "muted", "grid", "nothing")
    found = dict(zip(LIGHT.traces, look.traces))
    # Last, so that a colour that a trace shares gets the dark colour of its main use.
    named = ("ink", "run", "newest", *names)
    return found | {getattr(LIGHT, name): getattr(look, name) for name in named}


def _themed(declaration: str) -> str:
    fonts = declaration.replace(_FONT, f"{_FONT}, Verdana, sans-serif")
    return _COLOUR.sub(lambda c: f"var(--c{c.group()[1:]}, {c.group()})" if c.group() in _KNOWN else c.group(), fonts)


def _literal(text: str) -> str:
    return text.replace("\\", "\\\\")


_KNOWN = frozenset(_pairs(DARK))
