"""The pictures that a document names, in the size of its page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from livebode.core import Picture
from livebode.language import Message, worded
from livebode.plugins import loaded
from livebode.report.local_ticks import localise_ticks

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH_IN = 9.0
"""Width of all pictures of a document; on A4 they are scaled to three quarters, with letters of 7 points."""


_FIGURES: Mapping[str, tuple[str, str, bool]] = {
    "bode": ("livebode.report.bode:bode_figure", Message("Average response"), False),
    "tracking": ("livebode.report.tracking:tracking_figure", Message("Magnitude over time"), True),
    "parameters": ("livebode.report.parameters:parameters_figure", "", False),
    "matrix": ("livebode.report.matrix:matrix_figure", Message("Matrix of responses"), True),
    "singular values": ("livebode.report.matrix:singular_values_figure", Message("Singular values"), False),
    "comparison": ("livebode.report.comparison:comparison_figure", "", False),
    "places": ("livebode.report.comparison:places_figure", "", False),
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
