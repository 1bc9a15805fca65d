"""What a run averages to, read once and in parts, so that a long one needs no more memory than a short one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from livebode.fitting import RunningMean
from livebode.nouns import Response, Responses
from livebode.records import Run
from livebode.session.overview import Overview

_STILL = 0.01  # of the schedule's largest value: a machine that stays where it is


@dataclass(frozen=True, eq=False)
class Averaged:
    """A run in one response, and what it is the average of.

    Attributes
    ----------
    response
        The mean of all responses; of a run that averages by itself the newest valid one.
    words
        What that is, for people.
    overview
        Responses of the whole run, thinned to at most 2048.
    count, valid
        How many responses there are, and how many of them at each line are valid, (lines,).
    incomplete
        How many have a line that is not valid.
    spans_s, spans
        The first and last moment; lowest and highest schedule at a valid response, NaN without one.
    """

    response: Response
    words: str
    overview: Responses
    count: int
    valid: np.ndarray
    incomplete: int
    spans_s: tuple[float, float]
    spans: tuple[float, float]

    @property
    def moved(self) -> bool:
        """Whether the schedule changed along the run."""
        low, high = self.spans
        return bool(high - low > _STILL * max(abs(low), abs(high)))


def averaged(run: Run) -> Averaged:
    """Read the run.

    Raises
    ------
    InputError
        If no line is ever valid, or the run cannot be read.
    """
    mean, overview, counted = RunningMean(), Overview(), _Counted(len(run.lines))
    for part in run.steady_batches():
        mean.add(part)
        overview.add(part)
        counted.add(part)
    one, words = mean.response()[0], f"the mean of {mean.rows} responses"
    if mean.averages:
        words = f"the average up to {one.time_s:.6g} s"
    found = Averaged(
        one,
        words,
        overview.responses(),
        counted.rows,
        counted.valid,
        counted.incomplete,
        counted.spans_s,
        counted.spans,
    )
    if not found.moved:
        return found
    words += f" from {found.spans[0]:.4g} to {found.spans[1]:.4g} of the schedule, whose change is in the bounds"
    return Averaged(**{**found.__dict__, "words": words})


class _Counted:
    """What else there is to know of a run's responses."""

    def __init__(self, lines: int) -> None:
        self.rows, self.incomplete = 0, 0
        self.valid = np.zeros(lines, dtype=np.int64)
        self.spans_s, self.spans = (np.nan, np.nan), (np.nan, np.nan)

    def add(self, part: Responses) -> None:
        self.rows += len(part)
        self.valid += np.count_nonzero(part.valid, axis=0)
        self.incomplete += int(np.count_nonzero(~part.valid.all(axis=1)))
        self.spans_s = _wider(self.spans_s, part.time_s)
        rows = np.flatnonzero(part.valid.any(axis=1))
        if rows.size:
            self.spans = _wider(self.spans, part.schedule[rows])


def _wider(span: tuple[float, float], values: np.ndarray) -> tuple[float, float]:
    known = values[np.isfinite(values)]
    if not known.size:
        return span
    return float(np.fmin(span[0], known.min())), float(np.fmax(span[1], known.max()))
