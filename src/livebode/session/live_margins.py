"""Margins with the fits of a run, during the run."""

from __future__ import annotations

from livebode.core import Loop, Parameters, Responses
from livebode.fitting import Fitter
from livebode.margins import OpenLoop, against_lines, margins


def live_margins(fits: Parameters, responses: Responses, fitter: Fitter, loop: Loop) -> tuple[Parameters, ...]:
    """Rows for parameters.parquet: each margin at each fit that the lines of its response do not contradict."""
    grid = fitter.grid
    band_hz = float(grid.frequency_hz[0]), float(grid.frequency_hz[-1])
    found = margins(fits, OpenLoop(fitter.model, loop, grid.rate_hz, grid.hold), band_hz)
    return against_lines(found, responses, loop).parameters()
