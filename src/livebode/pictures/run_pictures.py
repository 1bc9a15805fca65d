"""The two pictures that every run writes."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from livebode.core import Model, Response, Responses
from livebode.pictures.bode import bode_figure
from livebode.pictures.tracking import tracking_figure
from livebode.pictures.vector import save_svg


def save_pictures(
    responses: Responses,
    directory: str | PathLike[str],
    *,
    title: str = "",
    schedule_name: str = "",
    names: tuple[str, str] | None = None,
    fitted: Model | None = None,
    mean: Response | None = None,
) -> list[Path]:
    """Write bode.svg and tracking.svg to an existing directory and return their paths.

    bode.svg shows the run's `mean` alone, if there is one.

    The same responses give the same bytes: the files contain no date and no version.

    Raises
    ------
    OSError
        If a file cannot be written.
    """
    assessed = responses[responses.ready] if responses.ready.any() else responses
    if mean is not None:
        assessed = Responses.of(mean)
    pictures = {
        "bode.svg": bode_figure(assessed, title=title, names=names, fitted=fitted, mean=mean),
        "tracking.svg": tracking_figure(responses, title=title, schedule_name=schedule_name),
    }
    return [save_svg(figure, Path(directory) / name) for name, figure in pictures.items()]
