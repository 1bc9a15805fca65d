"""Errors that repeat with the excitation, so that no scatter shows them: distortion, mains hum, sensor steps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Flags, Floats
from livebode.core import Block, Event, Lines, QuantityKind, Stage, step_of
from livebode.dataclass import dataclass
from livebode.estimation.hum import SilentHum, may_disturb
from livebode.estimation.levels import DistortionLevels
from livebode.estimation.movement import PLACES, Movement
from livebode.estimation.moving_periods import MovingPeriods, MovingVerdicts, PeriodClock
from livebode.estimation.periods import PeriodCutter, PeriodMoments, Periods
from livebode.estimation.silence_search import HumSpan, SilenceSearch, SilentStretch, updated
from livebode.estimation.spectra import SpectraRows
from livebode.estimation.tracker_settings import Settings
from livebode.estimation.verdicts import DISTORTED, HUM, KINDS, Verdict, by_chance, judge_of, reason
from livebode.kernel import ADDED, FORGOTTEN, NEWS, NEWS_GONE, PeriodSpectra, PeriodState, PeriodVerdicts
from livebode.language import Message

_LOOKS_S = 2.0, 4.0, 8.0, 16.0  # of silence, after which it is searched: the last one limits memory and time


@dataclass(frozen=True, eq=False)
class RepeatingVerdicts:
    """Verdicts on lines: before the first period of some samples, and after each that ends in them.

    Attributes
    ----------
    distortion, invalid
        Of numerator/denominator, and lines that do not count, shape (verdicts, lines).
    verdict
        Which one is that of a window: of the periods before it, shape (rows,).
    dof
        Degrees of freedom of `distortion`.
    in_motion
        The verdicts that apply where the machine moves.
    """

    distortion: Floats
    invalid: Flags
    verdict: NDArray[np.int64]
    dof: float
    in_motion: MovingVerdicts

    def of(self, moving: Flags | None) -> tuple[Floats, Flags, NDArray[np.int64]]:
        """Verdicts, and which one is that of each window; `moving`: in which windows the machine moves, if known."""
        moves = self.in_motion.moves[self.verdict] if moving is None else moving
        if not moves.any():
            return self.distortion, self.invalid, self.verdict
        distortion = np.concatenate([self.distortion, self.in_motion.distortion])
        invalid = np.concatenate([self.invalid, self.in_motion.invalid])
        return distortion, invalid, self.verdict + np.where(moves, len(self.distortion), 0)


class RepeatingErrors(PeriodCutter):
    """Detects in whole periods of the signals what repeats with the excitation but is not a linear response.

    One DFT a period, of the samples between the multiples of N. Periods with a sample that is left out do not count; a
    start, a gap, a pause or another phase of the excitation and a movement restart the mean over periods. A verdict
    applies from the next window on and is never averaged; after a gap or a pause the previous verdict applies until the
    next one. Periods in which the machine moves have verdicts of their own, of distortion alone (`MovingPeriods`).

    The periods of a Block are computed together, with the same results as one by one.

    Hum in two seconds of silence or more is that which `find_hum` finds there.

    Parameters
    ----------
    settings
        Lines, signals and estimator.
    in_motion
        Whether periods in which the machine moves are judged.

    Attributes
    ----------
    levels
        Even and odd distortion.
    """

    _stage = Stage("repeating-errors", 5)
    _STATE = (
        *PeriodCutter._STATE, "_output", "_told", "_largest", "_step", "_moments",
        "_movement", "_silence", "levels", "_silent_hum", "_search", "_in_motion",
    )  # fmt: skip

    def __init__(self, settings: Settings, events: list[Event] | None = None, *, in_motion: bool = True) -> None:
        lines = settings.lines
        super().__init__(lines.window, np.array(settings.differenced_roles))
        self._settings, self._judge = settings, judge_of(settings, None)
        self._largest, self._step = 0.0, 0.0
        self._looked = slice(0, None, -(-lines.window // PLACES))
        self._movement = Movement(self._position[self._looked].size)
        self.levels = DistortionLevels(settings)
        self._moments = PeriodMoments(1, len(self._judge.bins), 1.0)
        self._output = np.zeros(self._judge.mains.bins.size, dtype=np.complex128)
        self._now = Verdict.nothing(len(lines))
        self._silence = SilentHum(len(lines))
        self._reference = settings.roles.index(settings.method.reference)
        looks = [int(np.ceil(s * lines.rate_hz)) for s in _LOOKS_S]
        self._search = SilenceSearch(len(settings.roles), lines.rate_hz, looks)
        self._searches = may_disturb(lines)
        self._silent_hum = np.zeros(len(lines))  # shortest silence in samples that shows hum at each line
        self._spans: Sequence[HumSpan] | None = None
        self._told = np.zeros((len(KINDS), len(lines)), dtype=np.bool_)
        self._events = [] if events is None else events
        self._dof = self._judge.distortion.dof if self._judge.distortion else np.inf
        self._in_motion = MovingPeriods(settings, self._events, enabled=in_motion)

    def _state(self) -> dict[str, Any]:
        return super()._state() | {
            "periods": int(self._moments.now.weights.one[0]),
            "distortion": self._now.distortion,
            "invalid": self._now.against,
        }

    def _load(self, state: dict[str, Any]) -> None:
        super()._load(state)
        self._now = Verdict(state["distortion"], state["invalid"])

    def judged(self) -> dict[str, Any]:
        """For a record: the lines with a reason against them, and the newest distortion at each."""
        f = self._settings.lines.frequency_hz
        told = self._told.copy()
        told[HUM] |= self._known_hum()
        told[DISTORTED] |= self._in_motion.told
        reasons = {kind: f[told[i]].tolist() for i, kind in enumerate(KINDS) if told[i].any()}
        now, moving = (
            [None if np.isnan(d) else float(d) for d in row]
            for row in (self._now.distortion * self._judge.to_output, self._in_motion.distortion)
        )
        return {
            "distortion": None if self._judge.distortion is None else now,
            "distortion_in_motion": moving,
            "invalid_lines_hz": reasons,
            "mains_lines_hz": f[self._judge.mains.lines.any(axis=0)].tolist(),
        } | ({"levels": levels} if (levels := self.levels.plain()) else {})

    def _known_hum(self) -> Flags:
        """Lines that contain hum by the long silences, shape (lines,)."""
        known = self._silent_hum > 0
        known[[span.line for span in self._spans or ()]] = True
        return known

    def know_hum(self, spans: Sequence[HumSpan]) -> None:
        """Where all silences of a recording show hum, so that no other silence of two seconds is searched."""
        self._spans = spans

    def finish(self, sample: int, time_s: float) -> None:
        """Report hum in the last silence, and the levels of even and odd distortion, at the end of the samples."""
        for stretch in self._search.interrupt():
            self._process_silence(stretch, time_s)
        if message := self.levels.sentence():
            self._events.append(Event("distortion-levels", sample, time_s, message))

    def restart(self, sample: int, time_s: float) -> None:
        """The next sample has this number and this time and does not follow the previous one."""
        for stretch in self._search.interrupt():
            self._process_silence(stretch, time_s)
        self._begin_at(sample)
        self.levels.end_stretch()
        self._in_motion.end_stretch()
        self._moments.forget()
        self._output[:] = 0
        self._silence.interrupt()

    def process(
        self, data: Floats, rows: SpectraRows, schedule: Floats | None, block: Block, aside: NDArray[np.intp]
    ) -> RepeatingVerdicts:
        """The verdicts for the windows of these rows.

        Parameters
        ----------
        data
            Signals, shape (channels, samples), in the order of the settings' roles.
        rows
            The windows that end in these samples, and which samples are left out.
        schedule
            Shape (samples,); None without one.
        block
            The Block of the samples: their numbers, times and channels.
        aside
            Positions of the samples that are set aside.
        """
        left_out = [one for one in (rows.not_finite, rows.implausible, rows.spikes, rows.left_out, aside) if one.size]
        cut = self._cut(data, schedule, np.concatenate(left_out) if left_out else aside)
        which = (rows.sample - block.start + self._at) // self._window  # so many periods end before
        kind = next((c.stated_kind for c in block.channels if c.name == self._settings.output), None)
        self._judge = judge_of(self._settings, kind)
        self._in_motion.begin()
        begun, verdicts = self._now, [self._verdicts(periods, block, kind) for periods in cut]
        if not verdicts:
            now = begun.distortion[np.newaxis], np.logical_or.reduce(begun.against, axis=0, keepdims=True)
        elif len(verdicts) == 1:
            now = verdicts[0].distortion, verdicts[0].invalid
        else:
            now = _joined([part.distortion for part in verdicts]), _joined([part.invalid for part in verdicts])
        in_motion = self._in_motion.verdicts()
        hum = self._hum_of_windows(data, rows.sample, block, aside)
        if hum is None or not hum.any():
            return RepeatingVerdicts(now[0] * self._judge.to_output, now[1], which, self._dof, in_motion)
        distortion, invalid = now[0][which] * self._judge.to_output, now[1][which] | hum
        return RepeatingVerdicts(distortion, invalid, np.arange(which.size), self._dof, in_motion.at(which))

    def _hum_of_windows(
        self, data: Floats, sample: NDArray[np.int64], block: Block, aside: NDArray[np.intp]
    ) -> Flags | None:
        """Lines that contain hum by the long silences, for each window by its newest sample, (rows, lines)."""
        if not self._searches:
            return None
        if self._spans is not None:
            of_spans = np.zeros((sample.size, self._silent_hum.size), dtype=np.bool_)
            for span in self._spans:
                before_stop = True if span.stop is None else sample - self._window + 1 < span.stop
                of_spans[:, span.line] |= (sample >= span.first) & before_stop
            return of_spans
        hum: Flags | None = (
            np.tile(self._silent_hum > 0, (sample.size, 1)) if np.count_nonzero(self._silent_hum) else None
        )
        for stretch in self._search.process(data, data[self._reference], block.start, aside):
            self._process_silence(stretch, block.origin_s + (stretch.stop - 1) / block.rate_hz)
            hum = np.zeros((sample.size, self._silent_hum.size), dtype=np.bool_) if hum is None else hum
            hum[sample >= stretch.stop] = self._silent_hum > 0
        return hum

    def _process_silence(self, stretch: SilentStretch, time_s: float) -> None:
        """What a silence shows; an Event for each line that it makes invalid, or valid again."""
        before, told = self._silent_hum > 0, self._told[HUM]
        self._silent_hum = updated(self._silent_hum, stretch, self._settings.lines, withdraw=not self._settings.average)
        now = self._silent_hum > 0
        for line in np.flatnonzero((now != before) & ~told).tolist():
            self._events.append(
                hum_event(self._settings.lines, line, stretch.stop - 1, time_s, gone=bool(before[line]))
            )

    def _verdicts(self, periods: Periods, block: Block, kind: QuantityKind | None) -> PeriodVerdicts:
        """Verdicts before and after each of these periods."""
        moves = self._moves(periods)
        unit = next((channel.unit for channel in block.channels if channel.name == self._settings.schedule), "")
        clock = PeriodClock(block.start + periods.stop - 1, block.origin_s, unit)
        self._in_motion.process(periods, moves, clock)
        now = PeriodSpectra(
            periods.spectra,
            periods.complete,
            moves,
            self._now.distortion,
            self._now.against,
            lambda period: step_of(periods.signals[0, period]),
            by_chance,
        )
        moments = self._moments.arrays
        state = PeriodState(self._largest, self._step, *moments[:3], self._output, *self._silence.arrays, self._told)
        verdicts, self._largest, self._step = self._judge.process(state, now)
        self._now = Verdict(verdicts.distortion[-1].copy(), verdicts.against[-1].copy())
        happened = verdicts.happened.tolist()
        if self.levels.bins.size:
            self._add_levels(periods.spectra, happened)
        for period in (number for number, change in enumerate(happened) if change & NEWS):
            self._report(verdicts, period, block, block.start + periods.stop + period * self._window - 1, kind)
        return verdicts

    def _moves(self, periods: Periods) -> Flags:
        """In which periods the machine moves."""
        if periods.schedule is None:
            return np.zeros(len(periods.complete), dtype=np.bool_)
        looked = periods.schedule[:, self._looked]
        return np.asarray(self._movement.process(0, looked.ravel()).reshape(looked.shape).any(axis=1))

    def _add_levels(self, spectra: Complex, happened: Sequence[int]) -> None:
        for period, change in enumerate(happened):
            if change & FORGOTTEN:
                self.levels.end_stretch()
            if change & ADDED:
                self.levels.process(spectra[:, period])

    def _report(
        self, verdicts: PeriodVerdicts, period: int, block: Block, sample: int, output: QuantityKind | None
    ) -> None:
        time_s, known = block.origin_s + sample / block.rate_hz, self._known_hum()
        for i, line in zip(*np.nonzero(verdicts.news[period])):
            f = self._settings.lines.frequency_hz[line]
            if i == HUM:
                if not known[line]:
                    gone = bool(verdicts.news[period, i, line] == NEWS_GONE)
                    self._events.append(hum_event(self._settings.lines, int(line), sample, time_s, gone=gone))
                continue
            message, value = reason(verdicts, period, int(i), int(line), f, output, self._judge.to_output)
            message, details = (
                Message("{verdict}; the line is not valid", verdict=message),
                {"line_hz": float(f)} | value,
            )
            self._events.append(Event(KINDS[i], sample, time_s, message, details))


def hum_event(lines: Lines, line: int, sample: int, time_s: float, *, gone: bool = False) -> Event:
    """A line contains hum, or does so no longer."""
    f = float(lines.frequency_hz[line])
    message = Message("mains hum detected at or near {line_hz:g} Hz; use other lines; the line is not valid", line_hz=f)
    if gone:
        message = Message(
            "mains hum at {line_hz:g} Hz is no longer detected without excitation; the line is valid again", line_hz=f
        )
    return Event("hum-gone" if gone else "hum", sample, time_s, message)


def hum_events(spans: Sequence[HumSpan], lines: Lines, begins: int) -> list[Event]:
    """Events of the lines of a recording that is tracked from sample `begins` on."""
    events = []
    for span in spans:
        for sample, gone in ((max(span.first, begins), False), (span.stop, True)):
            if sample is not None:
                events.append(hum_event(lines, span.line, sample, sample / lines.rate_hz, gone=gone))
    return events


def _joined(rows: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Rows of consecutive periods: the first one of each is the last one of those before."""
    return np.concatenate([rows[0], *(part[1:] for part in rows[1:])])
