"""The two pictures that every run writes."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from livebode.core import Model, Response, Responses, whole_file
from livebode.pictures._style import Style, drawing, quiet_about_letters, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_RUNS = 3
"""zlib's strategy for runs of equal bytes, of which these pictures consist: as small as a search, in less time."""


def save_pictures(
    responses: Responses,
    directory: str | PathLike[str],
    *,
    title: str = "",
    schedule_name: str = "",
    names: tuple[str, str] | None = None,
    fitted: Model | None = None,
    mean: Response | None = None,
    dark: bool = False,
) -> list[Path]:
    """Write bode.png and tracking.png to an existing directory and return their paths.

    bode.png shows the run's `mean` alone, if there is one.

    The same responses give the same bytes: the files contain no date and no version.

    Raises
    ------
    OSError
        If a file cannot be written.
    """
    from livebode.pictures.bode import bode_figure
    from livebode.pictures.tracking import tracking_figure

    assessed = responses[responses.ready] if responses.ready.any() else responses
    if mean is not None:
        assessed = Responses.of(mean)
    look = style(dark)
    with drawing(look):
        pictures = {
            "bode.png": bode_figure(assessed, title=title, names=names, fitted=fitted, mean=mean, dark=dark),
            "tracking.png": tracking_figure(responses, title=title, schedule_name=schedule_name, dark=dark),
        }
        return [save(figure, Path(directory) / name, look) for name, figure in pictures.items()]


def save(figure: Figure, path: Path, look: Style) -> Path:
    """Write a figure; the same figure gives the same bytes. OSError, and nothing has changed, if it is not written."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    with whole_file(path) as partial, drawing(look), quiet_about_letters():
        canvas = FigureCanvasAgg(figure)
        canvas.draw()  # type: ignore[no-untyped-call]
        pixels = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
        # Without the alpha channel, a quarter of the bytes: the paper is opaque.
        picture = Image.fromarray(np.ascontiguousarray(pixels[..., :3]))
        picture.save(partial, "png", compress_type=_RUNS, dpi=(figure.dpi, figure.dpi))
    return path
