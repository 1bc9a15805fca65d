"""Tracker: samples in, frequency responses with bounds out, at the rate of the samples."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Integers
from livebode.core import Block, Emit, Event, Responses, Stage, StatefulBase, hand_over, ignore
from livebode.estimation.implausible import SpikeGate
from livebode.estimation.line_stage import LineStage
from livebode.estimation.repeating import RepeatingErrors
from livebode.estimation.ripple import RippleSpeed, ripple_power
from livebode.estimation.silence_search import HumSpan
from livebode.estimation.spectra import LineSpectra
from livebode.estimation.stream_estimator import Centre, InputStatistics, StreamEstimator, signals_of
from livebode.estimation.tracker_settings import Settings
from livebode.estimation.trend import SensorSpikes, SignalTrend

NOTHING: Integers = np.zeros((0, 2), dtype=np.int64)
"""No stretch is set aside."""
_NO_POSITIONS = np.zeros(0, dtype=np.intp)


def contains(spans: Integers, first: Integers, last: Integers) -> NDArray[np.bool_]:
    """Which of the windows first … last contain a sample of a span, shape of `first`.

    Parameters
    ----------
    spans
        First sample of each stretch, and the one after its last, shape (spans, 2), ascending and apart.

    Examples
    --------
    >>> contains(np.array([[10, 12]]), np.array([5, 6, 11, 12]), np.array([9, 10, 15, 16])).tolist()
    [False, True, True, False]
    """
    begins = np.append(spans[:, 0], np.iinfo(np.int64).max)
    return np.asarray(begins[np.searchsorted(spans[:, 1], first, side="right")] <= last)


def positions(spans: Integers, start: int, stop: int) -> NDArray[np.intp]:
    """Positions of their samples among the samples start … stop − 1."""
    if not len(spans):  # of nearly every block, which a search would make 7 % dearer
        return _NO_POSITIONS
    every = np.arange(start, stop)
    return np.flatnonzero(contains(spans, every, every))


class Tracker(StreamEstimator[InputStatistics]):
    """Frequency responses of a machine in closed loop, sample by sample, from a sliding DFT at excited lines.

    The Responses do not depend on how the samples are cut into Blocks, and a restored Tracker continues as if it had
    never stopped. The effective time of a Response is its window's centre: it is (N − 1)/2 samples late, and changes
    within the window are averaged. The first valid one is N samples after a start, a gap or a non-finite sample.

    Parameters
    ----------
    settings
        Lines, signals, estimator and options.
    repeating
        Whether to detect errors that repeat with the excitation (`RepeatingErrors`); not for residuals of a model.
    in_motion
        Whether to detect them while the machine moves, too; not where a model of the motion shows them better.

    Examples
    --------
    A plant of gain 2 with a sample of delay:

    >>> import numpy as np
    >>> from livebode.core import Block, Lines
    >>> w = np.sin(2 * np.pi * 5 * np.arange(400) / 100)
    >>> block = Block(np.array([w, 2 * np.roll(w, 1)]), ("w", "y"), rate_hz=1000)
    >>> lines = Lines.parse("50", rate_hz=1000, window=100)
    >>> tracker = Tracker(Settings(lines=lines, estimator="direct", input="w", output="y"))
    >>> responses = tracker.process(block)
    >>> len(responses), responses.magnitude_db[-1].round(3)
    (80, array([6.021]))
    """

    _stage = Stage("tracker", 1)
    _lines: LineStage

    def __init__(self, settings: Settings, *, repeating: bool = True, in_motion: bool = True) -> None:
        self.settings = settings
        self._roles = settings.roles
        self._events: list[Event] = []
        self._lines = LineStage(settings, events=self._events)
        window = settings.lines.window
        self._spectra = LineSpectra(
            window,
            self._lines.bins,
            settings.step,
            np.array(settings.differenced_roles),
            np.array(settings.advanced_ticks),
            SpikeGate(self._checked_for_spikes(), window) if settings.spikes else None,
            settings.dtype,
        )
        self._centre = Centre(window)
        self._speed = RippleSpeed(settings.lines) if settings.ripple else None
        self._repeating = RepeatingErrors(settings, self._events, in_motion=in_motion) if repeating else None
        self._watch = InputStatistics(self._events, window)
        self._end, self._aside = (0, 0.0), NOTHING
        self._trend: SignalTrend | None = None
        self._sensor_spikes: Sequence[SensorSpikes] = ()
        self._parts = {
            "spectra": self._spectra,
            "lines": self._lines,
            "centre": self._centre,
            **({"repeating": self._repeating} if self._repeating else {}),
            **({"speed": self._speed} if self._speed else {}),
            "watch": self._watch,
        }

    def found(self) -> dict[str, Any]:
        """The basis of the responses as plain data for a record, and the lines that are invalid, with the reason."""
        result = super().found()
        return result | {"judged": result["judged"] | (self._repeating.judged() if self._repeating else {})}

    def _checked_for_spikes(self) -> NDArray[np.bool_]:
        return np.array([self.settings.channel(role) in self.settings.spikes for role in self._roles])

    @property
    def _identity(self) -> str:
        return self.settings.identity

    def know_spikes(self, samples: NDArray[np.int64]) -> None:
        """Numbers of further samples to exclude as spikes; no effect where no channel is checked."""
        self._spectra.known_spikes = samples

    def know_hum(self, spans: Sequence[HumSpan]) -> None:
        """Where the silences of a whole recording show hum: windows that overlap a span do not count at its line."""
        if self._repeating is not None:
            self._repeating.know_hum(spans)

    def know_trend(self, trend: SignalTrend) -> None:
        """The trend of a whole recording, which is subtracted from the signals; the schedule is not changed."""
        self._trend = trend

    def know_sensor_spikes(self, spikes: Sequence[SensorSpikes]) -> None:
        """Spikes in most of the periods of a whole recording, which are subtracted from the signals."""
        self._sensor_spikes = spikes

    def leave_out(self, samples: NDArray[np.int64]) -> None:
        """Numbers of samples, ascending: no window that contains one of them counts."""
        self._spectra.left_out = samples

    def set_aside(self, spans: Integers, /) -> None:
        """First sample of each stretch, and the one after its last, shape (spans, 2), as far as the next Block.

        Windows with these samples have responses, but do not enter the noise and the verdicts of later windows: the
        machine is off, or another one, there.
        """
        self._aside = spans

    def continue_levels(self, before: Tracker) -> None:
        """Add what `before` found of even and odd distortion in an earlier recording."""
        if self._repeating is not None and before._repeating is not None:
            self._repeating.levels.add(before._repeating.levels)

    def process(self, block: Block, emit: Emit = ignore) -> Responses:
        """Responses at the hops of this Block, which follows the previous one.

        `emit` receives each event in it: missing and excluded samples, and verdicts on lines.

        Raises
        ------
        SignalError
            If the rate is not that of the lines, a channel is missing, or samples come twice.
        """
        s = self.settings
        channels, schedule = signals_of(block, s)
        stop = block.stop
        if self._trend is not None:
            channels = channels - self._trend.of([s.channel(role) for role in self._roles], block.start, stop)
        for spikes in self._sensor_spikes:
            spoiled = [[s.channel(role) == spikes.channel] for role in self._roles]
            channels = channels - np.where(spoiled, spikes.of(block.start, stop), 0.0)
        if self._watch.starts(block):
            self._spectra.restart(block.start)
            self._centre.restart()
            if self._speed is not None:
                self._speed.restart()
            if self._repeating is not None:
                self._repeating.restart(block.start, block.origin_s + block.start / block.rate_hz)
        rows = self._spectra.process(channels)
        self._watch.count(block, rows)
        centre = np.empty((2, len(rows.sample)))
        centre[0] = block.origin_s + (rows.sample - (s.lines.window - 1) / 2) / block.rate_hz
        centre[1] = self._centre.at(schedule, rows.sample - block.start)
        repeating = None
        if self._repeating is not None:
            excluded = positions(self._aside, block.start, stop)
            repeating = self._repeating.process(channels, rows, schedule, block, excluded)
        place = (rows.sample + 1) % s.lines.window
        ripple = None
        if self._speed is not None and schedule is not None:
            ripple = ripple_power(s.ripple, s.lines, self._speed.at(schedule, rows.sample - block.start))
        aside = contains(self._aside, rows.sample - s.lines.window + 1, rows.sample) if len(self._aside) else None
        responses = self._lines.process(rows, place, centre, block.channels, repeating, ripple, aside)
        self._ends_with(responses)
        self._end = stop - 1, block.origin_s + (stop - 1) / block.rate_hz
        hand_over(self._events, emit)
        return responses

    def finish(self, emit: Emit = ignore, /) -> Responses | None:
        """An empty batch, None where no samples came; reports even and odd distortion, if the lines show them."""
        if self._repeating is not None:
            self._repeating.finish(*self._end)
        hand_over(self._events, emit)
        return super().finish()


class SuccessiveTrackers(StatefulBase):
    """Follower of several recordings, each with a Tracker of its own, so that none continues the one before it.

    Parameters
    ----------
    trackers
        One for each recording, all with the same settings.
    starts
        Number of the first sample of each recording, ascending.
    """

    _stage = Stage("successive-trackers", 1)
    _STATE = ("_now",)

    def __init__(self, trackers: Sequence[Tracker], starts: Sequence[int]) -> None:
        self.settings = trackers[0].settings
        self._trackers, self._starts, self._now = list(trackers), list(starts), 0

    def _state(self) -> dict[str, Any]:
        return super()._state() | {str(i): tracker for i, tracker in enumerate(self._trackers)}

    def _load(self, state: dict[str, Any]) -> None:
        super()._load(state)
        for i, tracker in enumerate(self._trackers):
            tracker.restore(state[str(i)])

    @property
    def _begun(self) -> list[Tracker]:
        return self._trackers[: self._now + 1]

    @property
    def counts(self) -> dict[str, int]:
        """Sums over the recordings."""
        each = [tracker.counts for tracker in self._begun]
        return {name: sum(counts[name] for counts in each) for name in each[0]}

    def found(self) -> dict[str, Any]:
        """Results of the newest recording, with the lines that are invalid in any of them."""
        each = [tracker.found() for tracker in self._begun]
        reasons: dict[str, set[float]] = {}
        for result in each:
            for kind, frequency_hz in result["judged"].get("invalid_lines_hz", {}).items():
                reasons.setdefault(kind, set()).update(frequency_hz)
        judged = each[-1]["judged"] | {"invalid_lines_hz": {kind: sorted(f) for kind, f in reasons.items()}}
        return each[-1] | {"judged": judged}

    def process(self, block: Block, emit: Emit = ignore, /) -> Responses:
        """Responses at the hops of this Block, which is in one recording."""
        while self._now + 1 < len(self._starts) and block.start >= self._starts[self._now + 1]:
            self._trackers[self._now + 1].continue_levels(self._trackers[self._now])
            self._now += 1
        return self._trackers[self._now].process(block, emit)

    def set_aside(self, spans: Integers, /) -> None:
        """See `Tracker.set_aside`."""
        for tracker in self._trackers:
            tracker.set_aside(spans)

    def finish(self, emit: Emit = ignore, /) -> Responses | None:
        """An empty batch, None where no samples came; reports the distortion in all recordings."""
        return self._trackers[self._now].finish(emit)

    def excitation_power(self) -> NDArray[np.float64]:
        """Mean over the recordings of `Tracker.excitation_power`."""
        return np.asarray(np.mean([tracker.excitation_power() for tracker in self._begun], axis=0))

    def repeatability(self) -> NDArray[np.float64]:
        """The least of the recordings' `Tracker.repeatability`."""
        return np.asarray(np.fmin.reduce([tracker.repeatability() for tracker in self._begun]))
