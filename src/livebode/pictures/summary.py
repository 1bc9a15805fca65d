"""The result of a run at each line: median, range, and newest response.

The median over the valid responses is taken separately for magnitude and phase. The response of a machine in motion
changes; the complex mean would flatten a moving peak, the more the sharper it is, and a single spike shifts it. The
median avoids both and is always within the drawn range. It is biased upwards where the noise is as large as the
response itself; the bound shows this.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log, sqrt

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Response, Responses, decibels
from livebode.pictures.curves import circular, near, quantiles, unwrapped

# The probability of ±3 standard deviations of a normal variable, used for the circle around a complex response.
PROBABILITY = 0.9973
BOUND_C = sqrt(-log(1 - PROBABILITY))
MEAN_PROBABILITY = 0.95
MEAN_C = sqrt(-log(1 - MEAN_PROBABILITY))


@dataclass(frozen=True)
class Summary:
    """5 %, 50 % and 95 % quantiles over the run, each of shape (3, lines); NaN for a line that was never valid.

    `magnitude_db` in dB, `phase_deg` unwrapped along frequency, `coherence` between 0 and 1. `newest` is the last row
    in which any line is valid, or None; `newest_phase_deg` is on the branch of the median.
    """

    responses: Responses
    count: int
    magnitude_db: Floats
    phase_deg: Floats
    coherence: Floats
    newest: Response | None
    newest_value: NDArray[np.complex128]
    newest_bound: Floats
    newest_phase_deg: Floats


def summarised(responses: Responses, mean: Response | None = None) -> Summary:
    """Compute median, range and newest response of a run; never raises, whatever is missing.

    A `mean` of the run replaces the newest response, with its 95 % bound.
    """
    use = usable(responses)
    value = np.where(use, responses.value, np.nan)
    rows = np.flatnonzero(use.any(axis=1))
    newest = responses[int(rows[-1])] if rows.size else None
    newest_value = value[rows[-1]] if rows.size else np.full(len(responses.lines), complex(np.nan))
    bound = responses[int(rows[-1])].bound(BOUND_C) if rows.size else np.full(len(responses.lines), np.nan)
    if mean is not None:
        newest, bound = mean, mean.bound(MEAN_C)
        newest_value = np.where(mean.valid & np.isfinite(mean.value) & (mean.value != 0), mean.value, np.nan)
    magnitude_db = quantiles(decibels(value))
    middle_deg, deviation_deg = circular(value)
    weak = np.isfinite(bound) & (bound > np.abs(newest_value))
    phase = unwrapped(middle_deg, weak)
    return Summary(
        responses=responses,
        count=int(rows.size),
        magnitude_db=magnitude_db,
        phase_deg=phase + deviation_deg - deviation_deg[1],
        coherence=quantiles(np.where(use & np.isfinite(responses.coherence), responses.coherence, np.nan)),
        newest=newest,
        newest_value=newest_value,
        newest_bound=np.where(np.isfinite(newest_value), bound, np.nan),
        newest_phase_deg=near(np.degrees(np.angle(newest_value)), phase),
    )


def usable(responses: Responses) -> NDArray[np.bool_]:
    """Mask of the values that can be drawn: valid, finite and not zero, shape (rows, lines)."""
    return np.asarray(responses.valid & np.isfinite(responses.value) & (responses.value != 0))
