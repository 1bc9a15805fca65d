"""The picture of a design for several inputs: its experiments over time, and the predicted bound of each entry."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from livebode.pictures import (
    ABOVE,
    BELOW,
    LIGHT,
    Dots,
    End,
    Entry,
    Figure,
    Mark,
    Panel,
    Scale,
    Shade,
    Trace,
    end_room,
    frequency_scale,
    room,
    save_svg,
    scale_around,
    stacked,
    value_scale,
)

if TYPE_CHECKING:
    from livebode_design.matrix.result import MatrixDesign

_DASHES = ("", "dashed", "dotted", "mixed")
_INPUT, _BOUNDS = 76.0, 190.0


def save_matrix_excitation_picture(design: MatrixDesign, path: str | PathLike[str]) -> Path:
    """Write the picture as SVG."""
    return save_svg(matrix_excitation_figure(design), Path(path))


def matrix_excitation_figure(design: MatrixDesign) -> Figure:
    """Each excitation over one repetition, periods that are not used shaded; below, the bound of each entry by line."""
    used = design.excitation
    extent = [used.samples.ravel()]
    scales = [scale_around(extent, f"{name} in N m", 3) for name in design.excitations]
    left = room(*scales)
    parts = [(scale, _input(design, i, scale), _INPUT) for i, scale in enumerate(scales)]
    x = value_scale(0.0, used.samples.shape[1] / used.lines.rate_hz, "time in one repetition in s")
    panels, top = stacked(x, parts, left=left, width=588.0 - left)
    panels.append(_bounds(design, top + ABOVE))
    key = [Entry("transient, not used", LIGHT.muted, "band")]
    if design.spec.accuracy is not None:
        key.append(Entry("required", LIGHT.ink, "dotted"))
    title = f"{len(design.inputs)} inputs: {used.kind} experiments"
    return Figure(title, _facts(design), key, panels, top + ABOVE + _BOUNDS + BELOW)


def _facts(design: MatrixDesign) -> list[str]:
    used = design.excitation
    return [
        f"{len(used.spectra)} experiments of {used.dwell} periods, {used.settle} of them for the transient",
        f"{design.repetitions} repetitions", f"{design.time_s:.4g} s",
        f"{used.lines.window} samples at {used.lines.rate_hz:g} Hz",
    ]  # fmt: skip


def _input(design: MatrixDesign, i: int, scale: Scale) -> list[Mark]:
    used = design.excitation
    period_s = used.lines.window / used.lines.rate_hz
    begins = period_s * used.dwell * np.arange(len(used.spectra), dtype=np.float64)
    marks: list[Mark] = [Shade("transient", begins, begins + used.settle * period_s, LIGHT.nothing, 0.45)]
    ends = np.array([scale.low, scale.high])
    marks += [Trace("experiment", np.full(2, begin), ends, LIGHT.ink, 1.0) for begin in begins[1:]]
    seconds = np.arange(used.samples.shape[1]) / used.lines.rate_hz
    marks.append(Trace("excitation", seconds, used.samples[i], LIGHT.traces[i % len(LIGHT.traces)], 0.9))
    return marks


def _bounds(design: MatrixDesign, top: float) -> Panel:
    f = design.excitation.lines.frequency_hz
    marks: list[Mark] = []
    ends = []
    for o, output in enumerate(design.outputs):
        for i, input in enumerate(design.inputs):
            percent, colour = 100 * design.bound[:, o, i], LIGHT.traces[o % len(LIGHT.traces)]
            marks.append(Trace(f"{o}-{i}", f, percent, colour, 1.2, _DASHES[i % len(_DASHES)]))
            marks.append(Dots(f"{o}-{i}", f, percent, colour, 3.6))
            ends.append(End(f"{output}/{input}", float(percent[-1]), colour))
    if design.spec.accuracy is not None:
        required = np.full(2, 100 * design.spec.accuracy)
        marks.append(Trace("required", f[[0, -1]], required, LIGHT.ink, 1.2, "dotted"))
    drawn = [mark.y for mark in marks if isinstance(mark, Trace)]
    y = scale_around(drawn, "95 % bound in % of the largest response", 5, 0.0)
    left, right = room(y), 588.0 - end_room(ends)
    return Panel(left, top, right - left, _BOUNDS, frequency_scale(f), y, marks, ends)
