"""Average and overview of a run, read once and in parts, so that memory does not depend on the length of the run."""

from __future__ import annotations

import threading
from math import inf
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from livebode import fitting
from livebode.analysis.matrix_average import entry_average
from livebode.core import PlantKinds, Response, Responses
from livebode.dataclass import dataclass
from livebode.estimation import Movement
from livebode.language import Message

if TYPE_CHECKING:
    from livebode.records import RunRecord

ROWS_MAX = 2048
LIVE_VALUES_MAX = 1 << 13
"""Responses × lines of a live run, about 0.5 MB: a process may have many axes."""
_ROWS_MIN = 256
_PARTS_MAX = 16  # a one-row part takes three times the memory of its data


class Overview:
    """Every n-th response, evenly over the run; n is doubled whenever there are too many.

    It contains at most 2,048 rows in at most 16 parts, for any size of batches. The tracking thread adds rows; any
    other thread may read at the same time.

    Parameters
    ----------
    values_max
        Largest number of values (responses × lines), but at least 256 responses are permitted. Default: no limit.
    """

    def __init__(self, values_max: float = inf) -> None:
        self._values_max = values_max
        self._parts: list[Responses] = []
        self._stride = 1
        self._seen = 0
        self._rows = 0
        self._lock = threading.Lock()

    def add(self, responses: Responses) -> None:
        with self._lock:
            self._add(responses)

    def responses(self) -> Responses:
        """The rows, oldest first."""
        with self._lock:
            return Responses.join(self._parts)

    def _add(self, responses: Responses) -> None:
        first = -self._seen % self._stride
        self._seen += len(responses)
        if self._parts and first >= len(responses):
            return  # nearly always, in a long run; one empty part is enough to name the lines
        self._append(responses if self._stride == 1 else responses[first :: self._stride])
        most = min(ROWS_MAX, max(_ROWS_MIN, self._values_max / len(responses.lines)))
        while self._rows > most:
            thinned = Responses.join(self._parts)[::2]
            self._parts, self._rows = [], 0
            self._append(thinned)
            self._stride *= 2

    def _append(self, responses: Responses) -> None:
        # Joining copies: a view would keep the omitted rows in memory.
        self._parts.append(responses if self._stride == 1 else Responses.join([responses]))
        self._rows += len(responses)
        if len(self._parts) > _PARTS_MAX:
            self._parts = [Responses.join(self._parts)]


@dataclass(frozen=True, eq=False)
class RunMean:
    """The average response of a run, and a description of what was averaged.

    Attributes
    ----------
    response
        The mean of all responses; for a run with tracking.average the newest valid one.
    kinds
        Kinds of the plant's output and input.
    words
        Description of the average.
    overview
        Responses of the whole run, thinned to at most 2048.
    count, valid
        Number of responses, and number of valid ones at each line, (lines,).
    incomplete
        Number of responses with an invalid line.
    spans_s, spans
        The first and last time, and the lowest and highest schedule, at a valid response; NaN without one.
    moved
        Whether the machine moved at a valid response, as `Movement` finds it.
    """

    response: Response
    kinds: PlantKinds
    words: str
    overview: Responses
    count: int
    valid: np.ndarray
    incomplete: int
    spans_s: tuple[float, float]
    spans: tuple[float, float]
    moved: bool


def averaged(run: RunRecord) -> RunMean:
    """Read the run.

    Raises
    ------
    SignalError, RecordError
        If no line is ever valid, or the run cannot be read.
    """
    mean, overview, counted = running_mean(run), Overview(), _RunProperties(run)
    for part in run.steady_batches():
        mean.add(part)
        overview.add(part)
        counted.add(part)
    response, words = _response(run, mean)[0], Message("the mean of {responses} responses", responses=mean.rows)
    if isinstance(mean, fitting.RecordingsMean):
        words = Message("{mean} in {recordings} recordings", mean=words, recordings=len(run.found["recordings"]))
    if mean.averages:
        end_s = counted.begin_s + (response.sample + 1) / run.lines.rate_hz
        words = Message("the average up to {end_s:.6g} s", end_s=end_s)
    result = RunMean(
        response,
        run.kinds,
        words,
        overview.responses(),
        counted.rows,
        counted.valid,
        counted.incomplete,
        counted.spans_s,
        counted.spans,
        counted.moved,
    )
    if not result.moved:
        return result
    words = Message(
        "{mean} from {low:.4g} to {high:.4g} of the schedule, whose change is in the bounds",
        mean=words,
        low=result.spans[0],
        high=result.spans[1],
    )
    return RunMean(**{**result.__dict__, "words": words})


def running_mean(run: RunRecord) -> fitting.RunningMean | fitting.RecordingsMean:
    """A mean for all responses of the run: of several recordings that of their means."""
    recordings = run.found.get("recordings") or ()
    if not recordings:
        return fitting.RunningMean()
    starts = [recording["first"] for recording in recordings]
    return fitting.RecordingsMean(starts, realisations=bool(run.found.get("realisations")))


def mean_of(run: RunRecord) -> Responses:
    """Mean of all responses as a batch of one; SignalError if no line is ever valid."""
    mean = running_mean(run)
    for part in run.steady_batches():
        mean.add(part)
    return _response(run, mean)


def _response(run: RunRecord, mean: fitting.RunningMean | fitting.RecordingsMean) -> Responses:
    return entry_average(run, mean.response()) if mean.averages else mean.response()


class _RunProperties:
    """Further properties of a run's responses."""

    def __init__(self, run: RunRecord) -> None:
        self._window, self._hop = run.lines.window, int(run.found.get("hop", run.lines.window))
        self._movement, self.moved = Movement(max(1, self._window // self._hop)), False
        self._rate_hz, self.begin_s = run.lines.rate_hz, np.nan
        self._experiments = run.found.get("experiments")
        self.rows, self.incomplete = 0, 0
        self.valid = np.zeros(len(run.lines), dtype=np.int64)
        self.spans_s, self.spans = (np.nan, np.nan), (np.nan, np.nan)

    def add(self, part: Responses) -> None:
        self._find_begin(part)
        self.rows += len(part)
        self.valid += np.count_nonzero(part.valid, axis=0)
        self.incomplete += int(np.count_nonzero(~part.valid.all(axis=1)))
        rows = np.flatnonzero(part.valid.any(axis=1))
        if rows.size:
            # The windows of the first responses begin before the recording, and so may their effective times.
            self.spans_s = _wider(self.spans_s, part.time_s[rows])
            self.spans = _wider(self.spans, part.schedule[rows])
            self._follow(part.sample[rows], part.schedule[rows])

    def _find_begin(self, part: Responses) -> None:
        """The time of sample 0. A response's time is the centre of its windows, whose extent a later average hides."""
        if self._experiments is None and not self.rows and len(part):
            self.begin_s = float(part.time_s[0] - (part.first[0] + part.sample[0]) / 2 / self._rate_hz)
        if self._experiments is None or np.isfinite(self.begin_s):
            return
        # Of a matrix, the first valid one is of a window of each experiment.
        for row in np.flatnonzero(part.valid.any(axis=1))[:1]:
            between = self._experiments["dwell_periods"] * self._window * (self._experiments["number"] - 1)
            centre = part.sample[row] - (self._window - 1) / 2 - between / 2
            self.begin_s = float(part.time_s[row] - centre / self._rate_hz)

    def _follow(self, sample: NDArray[np.int64], schedule: NDArray[np.float64]) -> None:
        places = max(1, self._window // self._hop)
        place = ((sample + 1) % self._window // self._hop - 1) % places
        follows = (np.diff(place) % places == 1 % places) & (np.diff(sample) <= 2 * self._hop)
        cuts = np.flatnonzero(~follows) + 1
        for samples, values in zip(np.split(place, cuts), np.split(schedule, cuts)):
            self.moved |= bool(self._movement.process(int(samples[0]), values).any())


def _wider(span: tuple[float, float], values: np.ndarray) -> tuple[float, float]:
    known = values[np.isfinite(values)]
    if not known.size:
        return span
    return float(np.fmin(span[0], known.min())), float(np.fmax(span[1], known.max()))
