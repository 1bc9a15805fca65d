"""Stabilisation chart: the poles of models of increasing order over frequency, and the modes of a fit."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from livebode.arrays import Floats
from livebode.core import decibels
from livebode.language import tr, trn
from livebode.pictures._style import LIGHT
from livebode.pictures.figure import (
    Dots,
    Entry,
    Figure,
    Mark,
    Panel,
    Trace,
    frequency_scale,
    room,
    stacked,
    value_scale,
)
from livebode.pictures.vector import save_svg

if TYPE_CHECKING:
    from livebode.fitting import CommonPoles

_HEIGHT = 330.0


def save_stabilisation(poles: CommonPoles, directory: str | PathLike[str], *, title: str = "") -> Path:
    """Write stabilisation.svg to an existing directory."""
    return save_svg(stabilisation_figure(poles, title=title), Path(directory) / "stabilisation.svg")


def stabilisation_figure(poles: CommonPoles, *, title: str = "") -> Figure:
    """Order over frequency: a dot where the next orders have the pole too, else a small cross.

    Behind them is the magnitude of the first output, over the full height; vertical lines are the modes of the fit.
    """
    chart, f = poles.chart, poles.grid.frequency_hz
    x = frequency_scale(f)
    top = float(max(chart.orders, default=2))
    y = value_scale(0.0, top + 2.0, tr("order of the model (number of poles)"))
    at = [np.abs(of) / (2 * np.pi) for of in chart.poles]
    hz, order = np.concatenate([*at, []]), np.repeat(np.array(chart.orders, dtype=float), [part.size for part in at])
    stable = np.concatenate([*chart.stable, np.zeros(0, dtype=bool)])
    inside = (hz >= x.low) & (hz <= x.high)
    modes = [poles[name] for name in poles.parameters.names if name.startswith("frequency_")]
    marks: list[Mark] = [
        Trace("magnitude", f, _over(decibels(poles.magnitude), y.low, y.high), LIGHT.muted, 1.0),
        *(Trace("mode", np.full(2, at_hz), np.array([y.low, y.high]), LIGHT.newest, 0.9, "dashed") for at_hz in modes),
        Dots("other", hz[inside & ~stable], order[inside & ~stable], LIGHT.muted, 6.0, "plus", 0.7),
        Dots("stable", hz[inside & stable], order[inside & stable], LIGHT.run, 4.0),
    ]
    key = (
        Entry(tr("pole that stays from order to order"), LIGHT.run, "dot"),
        Entry(tr("other pole"), LIGHT.muted, "plus"),
        Entry(tr("mode of the fit"), LIGHT.newest, "dashed"),
        Entry(tr("magnitude of {output}, without scale", output=poles.outputs[0]), LIGHT.muted),
    )
    left = room(y)
    panels: list[Panel]
    panels, height = stacked(x, [(y, marks, _HEIGHT)], left=left, width=588.0 - left)
    return Figure(title or tr("Stabilisation chart"), (trn("{n} mode", "{n} modes", poles.order),), key, panels, height)


def _over(values: Floats, low: float, high: float) -> Floats:
    """The values over the full height."""
    known = values[np.isfinite(values)]
    least, most = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    return low + (high - low) * (0.05 + 0.9 * (values - least) / (most - least or 1.0))
