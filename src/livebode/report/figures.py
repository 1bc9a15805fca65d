"""The pictures that a document names, in the size of its page."""

from __future__ import annotations

from typing import TYPE_CHECKING

from livebode.core.document import Picture
from livebode.language import tr
from livebode.report.local_ticks import localise_ticks

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH_IN = 9.0
"""Width of all pictures of a document; on A4 they are scaled to three quarters, with letters of 7 points."""


def drawn(picture: Picture) -> Figure:
    """The picture in the light look and the language in use."""
    figure = _figure(picture)
    localise_ticks(figure)
    return figure


def _figure(picture: Picture) -> Figure:
    if picture.what == "bode":
        from livebode.report.bode import bode_figure

        return bode_figure(**picture.data, title=tr("Average response"))
    if picture.what == "tracking":
        from livebode.report.tracking import tracking_figure

        return tracking_figure(**picture.data, title=tr("Magnitude over time"), width_in=WIDTH_IN)
    if picture.what == "parameters":
        from livebode.report.parameters import parameters_figure

        return parameters_figure(**picture.data)
    if picture.what in ("loop", "proposal"):
        return _loop_figure(picture)
    if picture.what == "validation":
        from livebode.report.validation import validation_figure

        return validation_figure(**picture.data, title=tr("Measured and simulated"), folded=True)
    if picture.what == "years":
        from livebode.report.year import years_figure

        return years_figure(**picture.data)
    if picture.what == "matrix":
        from livebode.report.matrix import matrix_figure

        return matrix_figure(**picture.data, title=tr("Matrix of responses"), width_in=WIDTH_IN)
    if picture.what == "singular values":
        from livebode.report.matrix import singular_values_figure

        return singular_values_figure(**picture.data, title=tr("Singular values"))
    if picture.what == "comparison":
        from livebode.report.comparison import comparison_figure

        return comparison_figure(**picture.data)
    from livebode.report.comparison import places_figure

    return places_figure(**picture.data)


def _loop_figure(picture: Picture) -> Figure:
    if picture.what == "loop":
        from livebode.report.loop import loop_figure

        return loop_figure(**picture.data, title=tr("Open loop"), width_in=WIDTH_IN)
    from livebode.report.tuning import folded_tuning_figure

    return folded_tuning_figure(**picture.data, width_in=WIDTH_IN)
