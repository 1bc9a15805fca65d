"""Checks of the signals of a live run: doubtful roles, a transient at the start, phase slips."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache

import numpy as np
from numpy.typing import NDArray

from livebode.core import Block, Channel, Event
from livebode.dataclass import dataclass
from livebode.estimation import Settings
from livebode.language import Message
from livebode.preparation import (
    ROLES,
    ChannelTrend,
    SlipSearch,
    TrendSearch,
    bridged,
    live_trend_message,
    role_spectra,
    suspicions,
    transient_event,
    transient_periods,
)

_WINDOWS, _SECONDS, _SAMPLES_MAX = 32, 10.0, 1 << 22  # length of a stretch that is judged, whichever is longer
_EXCITED_MIN = 16  # windows with power in it, to distinguish noise from a response
_SLIP_PERIODS = 32  # that are searched at a time
_JUDGING_S = 0.5  # from the beginning of a judgement, in a thread of its own, to its findings


class LiveChecks:
    """Judges stretches of the signals until one is excited, and always searches the excitation for phase slips.

    It stops and changes nothing; findings are events.

    Parameters
    ----------
    settings
        Settings of the follower.
    channels
        Channels of the Blocks that are used.
    roles, transient
        Whether the roles are judged, and whether the run may begin with a transient.
    trends
        Whether signals that drift are reported, with the roles.
    judged
        Called once, when a stretch was judged.
    phase
        Part of an interval by which the axis differs from another one: they do not examine their signals at the same
        moment.
    """

    def __init__(
        self,
        settings: Settings,
        channels: list[str],
        *,
        roles: bool,
        transient: bool,
        trends: bool = True,
        judged: Callable[[], None] = lambda: None,
        phase: float = 0.0,
    ) -> None:
        self._settings, self._channels, self._report_judged = settings, channels, judged
        self._roles, self._transient = roles and settings.periodic, transient and settings.periodic
        self._trends = trends
        lines = settings.lines
        self._size = min(max(_WINDOWS * lines.window, round(_SECONDS * lines.rate_hz)), _SAMPLES_MAX) + 1
        self._stretch = _Stretch()
        self._complete: _CompleteStretch | None = None
        self._judgement: Future[_Judgement] | None = None
        self._known_at = 0  # sample behind which the findings of the judgement are due
        self._delay = int(phase * self._size)
        self._begun: int | None = None
        repeats = settings.periodic and settings.method.reference == "excitation"
        self._reference = settings.excitation if repeats else None
        self._slips = SlipSearch(lines.window)
        self._searched = _Stretch()
        self._search_size = lines.window * round(_SLIP_PERIODS * (1 - phase / 2))

    def take_ready(self, block: Block, ready: list[Block]) -> Iterator[Event]:
        """Findings with the parts of this Block in which the machine is ready; others may hide a restart of a phase."""
        stop = block.start
        for part in ready:
            if part.start != stop:
                self._interrupt()
            yield from self.take(part)
            stop = part.stop
        if stop != block.stop:
            self._interrupt()

    def _interrupt(self) -> None:
        """Search for slips from the next sample on, without those before it."""
        self._slips, self._searched = SlipSearch(self._settings.lines.window), _Stretch()

    def take(self, block: Block) -> Iterator[Event]:
        """Findings with this Block."""
        if not len(block):
            return
        self._begun = block.start if self._begun is None else self._begun
        if self._roles or self._transient:
            if self._stretch.add(block, self._channels, self._size):
                self._transient = False  # the excitation may have begun in samples that are not judged
            if self._stretch.samples >= self._size:
                start, data = self._stretch.hand_out()
                judged_at = block.stop + self._delay
                time_s = _time_s(block, start)
                self._complete = _CompleteStretch(start, time_s, data, block.channels, self._transient, judged_at)
            if self._complete is not None and block.stop >= self._complete.judged_at:
                yield from self._findings()
                self._begin_judging(block.stop)
            if block.stop >= self._known_at:
                yield from self._findings()
        if self._reference is not None:
            yield from self._slipped(block, self._reference)

    def finish(self) -> Iterator[Event]:
        """Findings in the stretches that are complete, at the end of the run."""
        yield from self._findings()
        if self._complete is not None:
            self._begin_judging(0)
            yield from self._findings()

    def _begin_judging(self, sample: int) -> None:
        """Judge the complete stretch beside the axis: it takes as long as many Blocks."""
        stretch, self._complete = self._complete, None
        if stretch is not None and (self._roles or self._transient):
            begun = stretch.start if self._begun is None else self._begun
            self._judgement = _thread().submit(
                _judged, stretch, self._settings, self._channels, self._roles, self._roles and self._trends, begun
            )
            self._known_at = sample + round(_JUDGING_S * self._settings.lines.rate_hz)

    def _findings(self) -> Iterator[Event]:
        """Those of the judgement that has begun, always behind the same sample."""
        if self._judgement is None:
            return
        judgement, self._judgement = self._judgement.result(), None
        self._transient &= not judgement.excited
        if judgement.final:
            yield from judgement.events
            self._roles = self._transient = False
            self._report_judged()

    def _slipped(self, block: Block, name: str) -> Iterator[Event]:
        size = _SLIP_PERIODS * self._settings.lines.window
        if self._searched.add(block, [name], 2 * size):
            self._slips = SlipSearch(self._settings.lines.window)
        if self._searched.samples < self._search_size:
            return
        self._search_size = size
        start, data = self._searched.hand_out()
        if self._slips.begins_at is None:
            self._slips.begins_at = start
        for slip in self._slips.take(bridged(data[0])):
            forward = slip.missing > 0
            message = Message(
                "the phase of {channel} jumps {way} by {samples} at sample {at_sample}, where the source reports no "
                "gap: {what}, or the generator was restarted; the responses of the windows around it are wrong; do not "
                "restart the generator, and let the sender number each sample when it is taken",
                channel=repr(name),
                way=Message("forward") if forward else Message("back"),
                samples=Message("1 sample")
                if abs(slip.missing) == 1
                else Message("{samples} samples", samples=abs(slip.missing)),
                at_sample=slip.sample,
                what=Message("samples are missing") if forward else Message("samples are repeated"),
            )
            details = {"missing_samples": slip.missing}
            yield Event("phase-slip", slip.sample, _time_s(block, slip.sample), message, details)


@dataclass(frozen=True, eq=False)
class _CompleteStretch:
    """Samples from `start` on that are judged at sample `judged_at`; `transient`: they may begin with a transient."""

    start: int
    time_s: float
    data: NDArray[np.float64]
    channels: tuple[Channel, ...]
    transient: bool
    judged_at: int


@dataclass(frozen=True)
class _Judgement:
    """What was found; `excited`: a stretch with excitation, `final`: with enough of it, so that no other is judged."""

    events: tuple[Event, ...] = ()
    excited: bool = True
    final: bool = True


def _judged(
    stretch: _CompleteStretch, settings: Settings, channels: list[str], roles: bool, trends: bool, begun: int
) -> _Judgement:
    """The judgement of a stretch of a run that began with sample `begun`."""
    start, time_s = stretch.start, stretch.time_s
    signals = dict(zip(channels, stretch.data))
    by_role = {role: signals[name] for role in ROLES if (name := settings.channel(role))}
    spectra = role_spectra(by_role, settings)
    if spectra is None:
        return _Judgement(excited=False, final=False)  # the next stretch is judged
    if spectra.windows < _EXCITED_MIN:
        return _Judgement(final=False)  # the excitation began in this stretch, not with the next one
    doubts = suspicions(by_role, settings, stretch.channels) if roles else []
    events = [Event("roles-doubtful", start, time_s, one.sentence) for one in doubts]
    periods = transient_periods(signals, settings)
    if stretch.transient and periods:
        events.append(transient_event(periods, settings, first=start, time_s=time_s, begun=begun))
    if trends and (drifting := _drifting(stretch, settings, channels, periods)):
        events.append(Event("signal-drifts", start, time_s, live_trend_message(drifting, stretch.channels)))
    return _Judgement(tuple(events))


def _drifting(stretch: _CompleteStretch, settings: Settings, channels: list[str], transient: int) -> list[ChannelTrend]:
    """The channels that drift in a stretch behind its transient; its periods begin anywhere."""
    search = TrendSearch(settings, 0)
    search.process(Block(stretch.data, tuple(map(Channel, channels)), settings.lines.rate_hz))
    return search.finish(transient)


@cache
def _thread() -> ThreadPoolExecutor:
    """One for all axes, not before the first judgement: a process that is forked has no threads of its parent."""
    return ThreadPoolExecutor(1, "livebode checks")


class _Stretch:
    """Consecutive samples, NaN for missing ones."""

    def __init__(self) -> None:
        self.start = self.samples = 0
        self._begun = False
        self._parts: list[NDArray[np.float64]] = []

    def hand_out(self) -> tuple[int, NDArray[np.float64]]:
        """Number of the first sample, and all samples; the next sample is expected directly after them."""
        start, data = self.start, np.concatenate(self._parts, axis=1)
        self._begin(start + self.samples)
        return start, data

    def add(self, block: Block, channels: list[str], samples_max: int) -> bool:
        """Append; True if it begins again instead, after a loss that is too long or of unknown length."""
        missing = block.start - self.start - self.samples
        again = self._begun and (not 0 <= missing <= samples_max or (block.gap and not missing))
        if again or not self._begun:
            self._begin(block.start)
            missing = 0
        if missing:
            self._parts.append(np.full((len(channels), missing), np.nan))
        self._parts.append(np.array([block[name] for name in channels]))
        self.samples += missing + len(block)
        return again

    def _begin(self, start: int) -> None:
        self.start, self.samples, self._parts, self._begun = start, 0, [], True


def _time_s(block: Block, sample: int) -> float:
    return block.origin_s + sample / block.rate_hz
