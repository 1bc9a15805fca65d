"""The picture of responses in a notebook, as HTML."""

from __future__ import annotations

import base64
from html import escape

from livebode.core import Response, Responses
from livebode.language import tr, worded
from livebode.pictures.bode import bode_figure
from livebode.pictures.vector import svg_file


def picture_html(responses: Responses, front: Response | None = None) -> str:
    """The Bode plot as every run writes it, as an image in SVG, with `front` as the mean; empty if nothing is valid.

    Examples
    --------
    >>> from livebode import example_responses
    >>> picture_html(example_responses())[:33]
    '<img alt="Bode plot of the plant"'
    """
    if not responses.valid.any():
        return ""
    # As an image of its own, so that the page's styles do not change it, nor its own those of the page.
    data = base64.b64encode(svg_file(bode_figure(responses, mean=front)).encode()).decode()
    words = tr("Bode plot of the {quantity}", quantity=worded(str(responses.quantity)))
    return f'<img alt="{escape(words)}" style="width: 100%; max-width: 720px" src="data:image/svg+xml;base64,{data}"/>'
