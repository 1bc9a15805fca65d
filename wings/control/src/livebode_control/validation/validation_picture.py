"""The picture of a validation: measured and simulated output, and the residual's correlations with their limits."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from livebode.language import tr, worded
from livebode.pictures import Style, drawing, heading, new_figure, plain, save, shortened, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.gridspec import GridSpec

    from livebode_control.validation.correlation import Correlation
    from livebode_control.validation.validation import Validation

_SHOWN = 600  # samples of the output
_CLIPPED = 4.0  # times the limit: larger correlations are clipped at the edge, with a mark


def save_validation_picture(
    validations: Sequence[Validation], directory: str | PathLike[str], *, title: str = "", dark: bool = False
) -> Path:
    """Write validation.png to an existing directory."""
    return save(validation_figure(validations, title=title, dark=dark), Path(directory) / "validation.png", style(dark))


def validation_figure(
    validations: Sequence[Validation], *, title: str = "", dark: bool = False, width_in: float | None = None
) -> Figure:
    """A row for each model: the last samples of the output, and the correlations over the lags.

    With the width of a page the correlations are below the output.

    The band contains 97 % of random correlations at a lag; the dashed lines are ±2.17/√L. Lags that cannot detect a
    wrong model are thin; a triangle at the edge marks a correlation beyond it.
    """
    look = style(dark)
    columns = max(len(v.correlations) for v in validations)
    folded = width_in is not None
    with drawing(look):
        if width_in is not None:
            figure, grid = _grid(width_in, 2 * len(validations), columns, [1.0] * columns)
        else:
            figure, grid = _grid(3.4 * (columns + 1) + 1.2, len(validations), columns + 1, [1.5, *[1.0] * columns])
        facts = tr(
            "{samples} samples · band: 97 % of random correlations at each lag · dashed: {limit:.2f}/√L",
            samples=validations[0].samples, limit=2.17,
        )  # fmt: skip
        heading(figure, look, title or tr("Validation"), facts, 0.7 / figure.get_size_inches()[0])
        for row, validation in enumerate(validations):
            last, below = row == len(validations) - 1, 2 * row + 1 if folded else row
            _output(figure.add_subplot(grid[2 * row, :] if folded else grid[row, 0]), look, validation, last or folded)
            for column, c in enumerate(validation.correlations, 0 if folded else 1):
                _correlation(figure.add_subplot(grid[below, column]), look, c, c.name in validation.judged_by, last)
    return figure


def _grid(width_in: float, rows: int, columns: int, ratios: list[float]) -> tuple[Figure, GridSpec]:
    figure = new_figure(width_in, 1.3 + 2.5 * rows)
    height = figure.get_size_inches()[1]
    grid = figure.add_gridspec(
        rows, columns, width_ratios=ratios, left=0.7 / width_in, right=0.985, top=1 - 1.2 / height,
        bottom=0.55 / height, hspace=0.45, wspace=0.36,
    )  # fmt: skip
    return figure, grid


def _output(axes: Axes, look: Style, validation: Validation, last: bool) -> None:
    shown = slice(max(0, validation.samples - _SHOWN), validation.samples)
    at_s = np.arange(validation.samples)[shown] / validation.rate_hz
    axes.plot(at_s, validation.measured[shown], color=look.newest, linewidth=2.6, alpha=0.55, label=tr("measured"))
    axes.plot(at_s, validation.simulated.output[shown], color=look.run, linewidth=0.9, label=tr("ŷ, simulated"))
    axes.set_title(
        tr(
            "{model}: {verdict}, fit {percent:.1f} %",
            model=worded(validation.model), verdict=worded(validation.verdict), percent=validation.fit_percent,
        ),
        loc="left", size=10, color=look.ink,
    )  # fmt: skip
    axes.set_ylabel(shortened(validation.output, 30))
    if last:
        axes.set_xlabel(tr("time in s"))
    axes.legend(loc="upper right", ncols=2, borderpad=0.2)
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.22 * (high - low))
    plain(axes)


def _correlation(axes: Axes, look: Style, c: Correlation, counts: bool, last: bool) -> None:
    axes.fill_between(c.lags, -c.limit, c.limit, color=look.run, alpha=0.2, linewidth=0)
    for sign in (-1, 1):
        axes.axhline(sign * c.white_limit, color=look.muted, linewidth=0.9, dashes=(4, 2))
    axes.vlines(
        c.lags, 0, c.value, color=np.where(c.judged, look.run, look.muted), linewidth=np.where(c.judged, 1.6, 0.6)
    )
    limit = float(np.max(c.limit))
    reach = 1.15 * min(max(limit, float(np.max(np.abs(c.value)))), _CLIPPED * max(limit, c.white_limit))
    beyond = np.abs(c.value) > reach
    outside = c.judged & (np.abs(c.value) > c.limit) & ~beyond
    axes.plot(c.lags[outside], c.value[outside], "o", markersize=3, color=look.newest)
    for sign, mark in ((1, "^"), (-1, "v")):
        lags = c.lags[beyond & (np.sign(c.value) == sign)]
        axes.plot(lags, np.full(len(lags), 0.96 * sign * reach), mark, markersize=4, color=look.newest)
    axes.set_ylim(-reach, reach)
    axes.set_ylabel(tr("correlation"))
    share = tr("{percent:.0f} % inside", percent=100 * c.share) if counts else tr("does not count")
    axes.set_title(tr("ε with {signal}: {share}", signal=c.name, share=share), loc="left", size=10, color=look.ink)
    if last:
        axes.set_xlabel(tr("lag in samples"))
    plain(axes)
