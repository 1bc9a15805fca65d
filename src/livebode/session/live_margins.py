"""Margins beside the fits of a run, as they come."""

from __future__ import annotations

from livebode.fitting import Fitter
from livebode.margins import OpenLoop, margins
from livebode.nouns import Loop, Parameters


def live_margins(fits: Parameters, fitter: Fitter, loop: Loop) -> tuple[Parameters, ...]:
    """Rows for parameters.parquet: each margin at each fit."""
    grid = fitter.grid
    band_hz = float(grid.frequency_hz[0]), float(grid.frequency_hz[-1])
    return margins(fits, OpenLoop(fitter.model, loop, grid.rate_hz, grid.hold), band_hz).parameters()
