"""The pictures of a document as SVG: drawn once, for the page on a screen and for paper."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from livebode.core import Document, Picture
from livebode.language import Message, worded
from livebode.pictures import Figure, svg
from livebode.plugins import loaded

_FIGURES: Mapping[str, tuple[str, str]] = {
    "bode": ("livebode.pictures:bode_figure", Message("Average response")),
    "tracking": ("livebode.pictures:tracking_figure", Message("Magnitude over time")),
    "parameters": ("livebode_reports.parameters:parameters_figure", ""),
    "matrix": ("livebode.pictures:matrix_figure", Message("Matrix of responses")),
    "singular values": ("livebode.pictures:singular_values_figure", Message("Singular values")),
    "comparison": ("livebode_reports.comparison:comparison_figure", ""),
    "places": ("livebode_reports.comparison:places_figure", ""),
}
"""What draws each kind, and its title."""
STORED = "stored"
"""The kind of a picture that is drawn already: `svg` of its data, as from `stored_svg`."""


def pictures_svg(document: Document) -> tuple[str, ...]:
    """The pictures of the document, in the language in use, each as an element with its caption for screen readers."""
    return tuple(
        picture.data["svg"] if picture.what == STORED else svg(drawn(picture), picture.caption)
        for picture in document.pictures
    )


def drawn(picture: Picture) -> Figure:
    """The figure of a picture."""
    reference, title = _FIGURES.get(picture.what, (picture.what, ""))
    options: dict[str, Any] = {"title": worded(title)} if title else {}
    figure: Figure = loaded(reference)(**picture.data, **options)
    return figure
