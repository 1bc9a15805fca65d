"""A figure as SVG that stands in a page: its colours follow the page's light or dark, its text stays text."""

from __future__ import annotations

import io
import re
from typing import TYPE_CHECKING

from livebode.report.style import DARK, LIGHT, Style, drawing, quiet_about_letters

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PROLOGUE = re.compile(r"^.*?(?=<svg)", re.S)
_METADATA = re.compile(r"<metadata>.*?</metadata>", re.S)
_SIZE = re.compile(r'<svg [^>]*?viewBox="([^"]+)"[^>]*>')
# What is referred to by others is in <defs>, or a clip path; all other names repeat from figure to figure.
_NAMED = re.compile(r'<g id="[^"]*">')
_STYLE = re.compile(r'style="[^"]*"')
_COLOUR = re.compile(r"#[0-9a-f]{6}")
_FONT = "'DejaVu Sans'"


def inline_svg(figure: Figure, label: str, salt: str) -> str:
    """The figure, drawn in the light look, as an element of a page.

    Parameters
    ----------
    figure
        Of `LIGHT`; its colours become the variables of `variables`.
    label
        What it shows, for who cannot see it; escaped already.
    salt
        Tells the names within it from those of the page's other figures.
    """
    import matplotlib

    text = io.StringIO()
    with drawing(LIGHT), matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": salt}), quiet_about_letters():
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    svg = _METADATA.sub("", _PROLOGUE.sub("", text.getvalue(), count=1), count=1)
    svg = _SIZE.sub(rf'<svg class="figure" viewBox="\1" role="img" aria-label="{_literal(label)}">', svg, count=1)
    svg = _NAMED.sub("<g>", svg)
    return _STYLE.sub(lambda found: _themed(found.group()), svg)


def variables(look: Style) -> str:
    """The page's colours in this look, as CSS variables, named after those of the light one."""
    return " ".join(f"--c{light[1:]}: {own};" for light, own in _pairs(look).items())


def _pairs(look: Style) -> dict[str, str]:
    names = ("paper", "muted", "grid", "nothing")
    found = dict(zip(LIGHT.traces, look.traces))
    # Last, so that a colour that is a trace's too is in the dark what its main use is.
    named = ("ink", "run", "newest", *names)
    return found | {getattr(LIGHT, name): getattr(look, name) for name in named}


def _themed(declaration: str) -> str:
    fonts = declaration.replace(_FONT, f"{_FONT}, Verdana, sans-serif")
    return _COLOUR.sub(lambda c: f"var(--c{c.group()[1:]}, {c.group()})" if c.group() in _KNOWN else c.group(), fonts)


def _literal(text: str) -> str:
    return text.replace("\\", "\\\\")


_KNOWN = frozenset(_pairs(DARK))
