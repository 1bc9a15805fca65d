"""NonPeriodicTracker: responses of a machine whose excitation does not repeat, such as noise or a chirp."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Block, Emit, Event, Responses, Stage, StatefulBase, UsageError, hand_over, ignore
from livebode.estimation.nonperiodic_stage import NonPeriodicStage, Row
from livebode.estimation.spectra import SpectraRows
from livebode.estimation.stream_estimator import Centre, InputStatistics, StreamEstimator, signals_of
from livebode.estimation.tracker_settings import Settings


class NewestSamples(StatefulBase):
    """A ring of the newest samples of `signals` signals. `count` is the number since the last start."""

    _stage = Stage("newest-samples", 1)
    _STATE = ("_ring", "_at", "count")

    def __init__(self, signals: int, size: int) -> None:
        self._ring = np.zeros((signals, size))
        self._at = self.count = 0

    def add(self, data: Floats) -> None:
        """Add samples, shape (signals, samples)."""
        size, samples = self._ring.shape[1], data.shape[1]
        data = data[:, -size:]
        start = (self._at + samples - data.shape[1]) % size
        first = min(size - start, data.shape[1])
        self._ring[:, start : start + first] = data[:, :first]
        self._ring[:, : data.shape[1] - first] = data[:, first:]
        self._at = (self._at + samples) % size
        self.count += samples

    @property
    def window(self) -> Floats:
        """The newest samples, the oldest first, shape (signals, size)."""
        return np.concatenate([self._ring[:, self._at :], self._ring[:, : self._at]], axis=1)


class NonPeriodicTracker(StreamEstimator[InputStatistics]):
    """Frequency responses of a machine in open or closed loop, for any excitation, with the face of a Tracker.

    Every hop, a response is computed from the newest samples alone: a window with "lpm", eight with "welch". With
    `average`, responses a window (or eight) apart add up. With an excitation, output and input are both estimated from
    it, and their quotient is the plant, also in closed loop; without one, the plant is estimated from input to output,
    which feedback biases. Responses do not depend on how the samples are cut into Blocks.

    Hops count from the first sample, and again from the one after a gap or a sample that is not finite, so that the
    first valid response is complete with the window.

    "lpm" is biased where the response changes within 13 bins more than a parabola does, "welch" where it changes within
    four. The bounds do not contain that bias.

    Parameters
    ----------
    settings
        Lines, signals, estimator and options.

    Raises
    ------
    UsageError
        If the estimator is not for an excitation of any kind, or the window is too short for it.

    Examples
    --------
    A plant of gain 2 with a sample of delay, under noise:

    >>> import numpy as np
    >>> from livebode.core import Block, Lines
    >>> u = np.random.default_rng(1).standard_normal(500)
    >>> block = Block(np.array([u, 2 * np.roll(u, 1)]), ("u", "y"), rate_hz=1000)
    >>> lines = Lines.parse("50", rate_hz=1000, window=500)
    >>> response = NonPeriodicTracker(Settings(lines=lines, estimator="lpm", input="u", output="y")).process(block)[-1]
    >>> response.magnitude_db.round(2), response.dof
    (array([6.02]), 7.0)
    """

    _stage = Stage("nonperiodic-tracker", 1)
    _lines: NonPeriodicStage

    def __init__(self, settings: Settings) -> None:
        if settings.periodic:
            raise UsageError(
                "not-one-of",
                f"estimator={settings.estimator!r} needs an excitation that repeats",
                "choose 'lpm' or 'welch', or use a Tracker",
                argument="estimator",
                value=settings.estimator,
            )
        self.settings = settings
        self._events: list[Event] = []
        self._lines = NonPeriodicStage(settings)
        self._centre = Centre(settings.span)
        self._watch = InputStatistics(self._events, settings.span)
        self._newest = NewestSamples(len(settings.roles), settings.span)
        self._parts = {"lines": self._lines, "centre": self._centre, "watch": self._watch, "newest": self._newest}

    @property
    def _identity(self) -> str:
        return self.settings.identity

    def process(self, block: Block, emit: Emit = ignore) -> Responses:
        """Responses at the hops of this Block, which follows the previous one; `emit` receives each event in it.

        Raises
        ------
        SignalError
            If the rate is not that of the lines, a channel is missing, or samples come twice.
        """
        data, schedule = signals_of(block, self.settings)
        if self._watch.starts(block):
            self._restart()
        finite = np.isfinite(data.sum(axis=0))
        self._watch.count(block, _not_finite(finite))
        rows: list[Row] = []
        for stretch in _stretches(finite):
            if finite[stretch.start]:
                part = None if schedule is None else schedule[stretch]
                rows += self._process(data[:, stretch], part, block.start + stretch.start, block)
            else:
                self._restart()
        responses = self._lines.responses(rows, block.channels)
        self._ends_with(responses)
        hand_over(self._events, emit)
        return responses

    def _restart(self) -> None:
        self._newest.count = 0
        self._centre.restart()

    def _process(self, data: Floats, schedule: Floats | None, start: int, block: Block) -> list[Row]:
        """The rows at the hops of these samples, of which all are finite; the first one has the number `start`."""
        span, hop = self.settings.span, self.settings.step
        before = self._newest.count
        position = np.arange((span - before - 1) % hop, data.shape[1], hop)
        schedules = self._centre.at(schedule, position)
        rows, done = [], 0
        for last, value in zip(position.tolist(), schedules):
            self._newest.add(data[:, done : last + 1])
            done, sample = last + 1, start + last
            moment = np.array([block.origin_s + (sample - (span - 1) / 2) / block.rate_hz, value, sample - span + 1])
            whole = self._newest.count >= span
            hops = (self._newest.count - span) // hop
            rows.append(self._lines.process(self._newest.window if whole else None, hops, sample, moment))
        self._newest.add(data[:, done:])
        return rows


def _stretches(finite: NDArray[np.bool_]) -> list[slice]:
    """Stretches of samples that are all finite or all not."""
    edges = np.flatnonzero(np.diff(finite)) + 1
    return [slice(int(a), int(b)) for a, b in pairwise([0, *edges, finite.size])]


def _not_finite(finite: NDArray[np.bool_]) -> SpectraRows:
    """What is counted of samples that are not finite."""
    none = np.zeros(0, dtype=np.intp)
    no_row = np.zeros(0, dtype=np.bool_)
    return SpectraRows(
        np.zeros((0, 0, 0), dtype=np.complex128), none, no_row, no_row, np.flatnonzero(~finite), none, none
    )
