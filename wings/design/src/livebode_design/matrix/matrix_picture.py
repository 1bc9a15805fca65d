"""The picture of a design for several inputs: its experiments over time, and the predicted bound of each entry."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from livebode.pictures import Style, drawing, heading, new_figure, plain, save, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from livebode_design.matrix.result import MatrixDesign

_DASHES = ((), (5, 2), (1.5, 1.5), (5, 2, 1.5, 2))


def save_matrix_excitation_picture(design: MatrixDesign, path: str | PathLike[str], *, dark: bool = False) -> Path:
    """Write the picture as PNG."""
    return save(matrix_excitation_figure(design, dark=dark), Path(path), style(dark))


def matrix_excitation_figure(design: MatrixDesign, *, dark: bool = False) -> Figure:
    """Each excitation over one repetition, periods that are not used shaded; below, the bound of each entry by line."""
    look, inputs = style(dark), len(design.inputs)
    with drawing(look):
        figure = new_figure(11.0, 4.6 + 1.2 * inputs)
        height = figure.get_size_inches()[1]
        grid = figure.add_gridspec(
            inputs + 1, 1, height_ratios=[1.0] * inputs + [2.2], left=0.08, right=0.8, top=1 - 1.1 / height,
            bottom=0.55 / height, hspace=0.35,
        )  # fmt: skip
        heading(figure, look, f"{inputs} inputs: {design.excitation.kind} experiments", _facts(design), 0.08)
        top = [figure.add_subplot(grid[0, 0])]
        top += [figure.add_subplot(grid[i, 0], sharex=top[0], sharey=top[0]) for i in range(1, inputs)]
        for i, axes in enumerate(top):
            _input(axes, look, design, i)
        _bounds(figure.add_subplot(grid[inputs, 0]), look, design)
    return figure


def _facts(design: MatrixDesign) -> str:
    used = design.excitation
    return (
        f"{len(used.spectra)} experiments of {used.dwell} periods, {used.settle} of them for the transient · "
        f"{design.repetitions} repetitions · {design.time_s:.4g} s · {used.lines.window} samples at "
        f"{used.lines.rate_hz:g} Hz"
    )


def _input(axes: Axes, look: Style, design: MatrixDesign, i: int) -> None:
    used = design.excitation
    period_s = used.lines.window / used.lines.rate_hz
    seconds = np.arange(used.samples.shape[1]) / used.lines.rate_hz
    axes.plot(seconds, used.samples[i], color=look.traces[i], linewidth=0.9)
    for number in range(len(used.spectra)):
        begin = number * used.dwell * period_s
        label = "transient, not used" if number == 0 else None
        axes.axvspan(begin, begin + used.settle * period_s, color=look.nothing, alpha=0.45, linewidth=0, label=label)
        if number:
            axes.axvline(begin, color=look.ink, linewidth=1.0)
        if i == 0:
            middle = begin + used.dwell * period_s / 2
            axes.text(middle, 1.03, f"experiment {number + 1}", transform=axes.get_xaxis_transform(), ha="center",
                      color=look.muted, size=9)  # fmt: skip
    axes.set_xlim(0, used.samples.shape[1] / used.lines.rate_hz)
    axes.set_ylabel(f"{design.excitations[i]} in N m")
    last = i == len(design.inputs) - 1
    axes.tick_params(labelbottom=last)
    if last:
        axes.set_xlabel("time in one repetition in s")
        axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0))
    plain(axes)


def _bounds(axes: Axes, look: Style, design: MatrixDesign) -> None:
    f = design.excitation.lines.frequency_hz
    for o, output in enumerate(design.outputs):
        for i, input in enumerate(design.inputs):
            axes.plot(
                f, 100 * design.bound[:, o, i], "o-", markersize=3.5, linewidth=1.2, label=f"{output}/{input}",
                color=look.traces[o % len(look.traces)], dashes=_DASHES[i % len(_DASHES)],
            )  # fmt: skip
    if design.spec.accuracy is not None:
        axes.axhline(100 * design.spec.accuracy, color=look.ink, linewidth=1.2, dashes=(1.5, 1.5), label="required")
    axes.set_ylim(0, None)
    axes.set_xlabel("frequency in Hz")
    axes.set_ylabel("95 % bound in % of the\noutput's largest response")
    axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), ncols=1 if design.bound[0].size <= 12 else 2)
    plain(axes)
