"""The picture of responses in a notebook, as HTML."""

from __future__ import annotations

import base64
import io
from importlib.util import find_spec

from livebode.core import CIRCLE_FACTOR, Response, Responses
from livebode.pictures.plots import plot_responses

_SIZE_IN = (7.0, 4.6)


def picture_html(responses: Responses, front: Response | None = None) -> str:
    """A Bode plot as `Responses.plot` draws it, as an image in SVG; empty without Matplotlib or a valid response.

    Examples
    --------
    >>> from livebode import example_responses
    >>> picture_html(example_responses())[:33]
    '<img alt="Bode plot of the plant"'
    """
    if find_spec("matplotlib") is None or not responses.valid.any():
        return ""
    from matplotlib.figure import Figure

    figure = Figure(figsize=_SIZE_IN, layout="constrained")  # none of pyplot, which would also show it
    axes = figure.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": [3, 2]})
    plot_responses(responses, "bode", axes=axes, c=CIRCLE_FACTOR, label=None, color=None, front=front)
    axes[0].legend(frameon=False, fontsize="small")
    file = io.BytesIO()
    figure.savefig(file, format="svg", metadata={"Date": None})
    # As an image of its own, so that its names of clip paths do not meet those of other pictures of the page.
    data = base64.b64encode(file.getvalue()).decode()
    words = f'alt="Bode plot of the {responses.quantity}" style="max-width: 100%"'
    return f'<img {words} src="data:image/svg+xml;base64,{data}"/>'
