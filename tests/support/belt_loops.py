"""Margins and noisy responses of loops around two masses."""

from __future__ import annotations

import numpy as np

from livebode.analysis import Margins, margins
from livebode.core import Lines, Responses
from tools.loops import Case, parameters

LINES = Lines.parse("20:140:5", rate_hz=4000, window=800)
BAND_HZ = (20.0, 140.0)


def read(case: Case) -> Margins:
    return margins(parameters(case.belt[np.newaxis]), case.open, BAND_HZ)


def responses_of(truth: np.ndarray, sigma: float, runs: int, seed: int) -> Responses:
    """As many noisy responses with this truth at LINES, with known sigma."""
    rng = np.random.default_rng(seed)
    shape = (runs, len(LINES))
    noise = sigma * (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)
    row, ones, zeros = np.arange(runs), np.ones(shape), np.zeros(runs)
    return Responses(
        LINES, truth + noise, sigma * ones, zeros + np.inf, ones, ones > 0, row, row, zeros, zeros + np.nan
    )
