"""The trend of signals that drift: whether it matters at the lines, and what a Tracker subtracts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from livebode.arrays import Complex, Flags, Floats, Integers
from livebode.core import Block, Channel, Event, Lines
from livebode.dataclass import dataclass
from livebode.estimation import Settings, SignalTrend, TrendStretch
from livebode.excitation import LOWEST_LINES, filled, slow_part, spectra
from livebode.language import Message
from livebode.preparation._steady import excited_bins, moves
from livebode.preparation.aligned import AlignedLog
from livebode.preparation.plan import SEARCHED, RecordedSource

_SPECTRA = 64  # periods whose lines are compared with the trend
_OF_SCATTER = 0.5  # what wanders: part of the scatter of a period above which it widens the bounds by a tenth
_OF_SIGMA = 0.2  # what creeps: part of the mean's sigma above which its 98 % bound covers less than 97.7 %
_SIGNIFICANT = 3.0  # sigma of the drift itself, as noise alone shows it
_OF_LINE = 1e-4  # of the line itself: less is none of a simulation's rounding, and of no interest
_LARGEST = 0.1  # part of the steps between periods that a disturbance may have, and that do not count
_PER_PERIOD = 8  # values of the trend in a period of its fastest part, between which it is a cubic
_TOGETHER = 16  # periods
_MARGIN = 2  # periods at the ends of what is computed together that depend on what is beyond it


@dataclass(frozen=True)
class ChannelTrend:
    """What a channel drifts by.

    Attributes
    ----------
    channel
        Its name.
    step
        Mean step from period to period, in the unit of the channel.
    wander
        Root mean square of the steps.
    share
        What the drift adds to the line that it disturbs most, relative to that line.
    line_hz
        That line.
    """

    channel: str
    step: float
    wander: float
    share: float
    line_hz: float


class _Periods(NamedTuple):
    """Whole periods: their numbers, which of them follow the one before, and means of the channels (periods, names)."""

    number: Integers
    follows: Flags
    means: Floats


class TrendSearch:
    """Finds the channels of a recording that drift so that it matters at a line.

    A drift of d from one period to the next adds d/(e^{−2πik/N} − 1) to the line k of a window of N samples: the same
    in every window if it is steady, so that their scatter does not show it. It matters where that is more than a fifth
    of the sigma of the mean, or if it varies more than half of the scatter.

    Parameters
    ----------
    settings
        Lines and signals. Channels that are differenced are left out.
    first
        Number of the recording's first sample, from which its periods count.
    """

    def __init__(self, settings: Settings, first: int) -> None:
        named = [name for role in settings.roles if (name := settings.channel(role))]
        self.names = [name for name in dict.fromkeys(named) if name not in settings.differenced]
        self.channels = list(dict.fromkeys([*self.names, *([settings.schedule] if settings.schedule else [])]))
        self._settings, self._first, self._window = settings, first, settings.lines.window
        self._excited = excited_bins(settings)
        self._periods: list[_Periods] = []
        self._lines: list[Complex] = []  # of the first periods, (names, lines)
        self._rows, self._stop = np.zeros((len(self.channels), 0)), first
        self._unused, self._follows = 0, False  # samples of `_rows` before a period; whether one was just before it
        self._schedule: list[Floats] = []

    def process(self, block: Block) -> None:
        """Add the next samples of `channels`."""
        if block.gap or block.start != self._stop:
            self._begin((self._first - block.start) % self._window)
        self._rows, self._stop = np.concatenate([self._rows, block.rows(self.channels)], axis=1), block.stop
        count = max(self._rows.shape[1] - self._unused, 0) // self._window
        if not count:
            return
        used = self._rows[:, self._unused : self._unused + count * self._window]
        number = (self._stop - self._rows.shape[1] + self._unused - self._first) // self._window
        self._rows, self._unused = self._rows[:, self._unused + count * self._window :], 0
        self._add(number, used.reshape(len(self.channels), count, self._window).swapaxes(0, 1))

    def _begin(self, unused: int) -> None:
        self._rows, self._unused, self._follows = self._rows[:, :0], unused, False

    def _add(self, number: int, periods: Floats) -> None:
        """Add consecutive periods, (periods, channels, samples)."""
        examined = periods[:, : len(self.names)]
        known = np.asarray(np.isfinite(examined).all(axis=(1, 2)))
        follows = np.append(self._follows, known[:-1])[known]
        self._follows = bool(known[-1])
        examined = examined[known]
        self._periods.append(_Periods(number + np.flatnonzero(known), follows, examined.mean(axis=2)))
        few = _SPECTRA - len(self._lines)
        self._lines += [spectra(period, self._excited) for period in examined[:few]]
        if self._settings.schedule and self._settings.schedule not in self.names:
            self._schedule += list(periods[known][:few, -1])

    def finish(self, transient: int = 0) -> list[ChannelTrend]:
        """The channels whose drift matters behind the transient, in periods; none for a machine that moves."""
        if self._schedule and moves(np.concatenate(self._schedule), self._window):
            return []
        if not self._periods:
            return []
        number, follows, means = (np.concatenate(parts) for parts in zip(*self._periods))
        steady = number >= transient
        lines = np.array(self._lines)[steady[: len(self._lines)]]
        means, follows = means[steady], follows[steady][1:]
        steps = np.diff(means, axis=0)
        if not follows.any() or len(lines) < 2:
            return []
        own, near = steps[: len(lines) - 1], follows[: len(lines) - 1]
        found = (
            self._judged(name, steps[follows, i], own[:, i], lines[:, i], near, len(means))
            for i, name in enumerate(self.names)
        )
        return [one for one in found if one is not None]

    def _judged(
        self, name: str, steps: Floats, own: Floats, lines: Complex, follows: Flags, periods: int
    ) -> ChannelTrend | None:
        """Judge a channel by the steps of its level, and the lines of its first periods between which `own` are."""
        ordinary = np.sort(np.abs(steps))[: max(1, round((1 - _LARGEST) * len(steps)))]
        step, wander = float(steps.mean()), float(np.sqrt(np.mean(ordinary**2)))
        leak = 2 / self._window / (1 / self._settings.lines.z - 1)
        gain = np.abs(leak)
        around = (np.append(own[:1], own) + np.append(own, own[-1:])) / 2
        plain = lines - around[:, np.newaxis] * leak
        apart = np.abs(np.diff(plain, axis=0)[follows]) ** 2
        scatter = np.sqrt(apart.mean(axis=0) / 2) if len(apart) else np.zeros(gain.size)
        size = np.median(np.abs(plain), axis=0)
        # Of white noise alone, by the means of the first and the last period.
        chance = gain / np.sqrt(2) * np.sqrt(periods) / (periods - 1)
        creeps = abs(step) * gain > np.maximum(_OF_SIGMA, _SIGNIFICANT * chance) * scatter / np.sqrt(periods)
        wanders = (wander * gain > _OF_SCATTER * scatter) & (len(steps) > 2)
        matters = (creeps | wanders) & (max(abs(step), wander) * gain > _OF_LINE * size)
        if not matters.any():
            return None
        with np.errstate(divide="ignore"):
            share = np.where(matters, max(abs(step), wander) * gain / size, 0.0)
        worst = int(np.argmax(share))
        return ChannelTrend(name, step, wander, float(share[worst]), float(self._settings.lines.frequency_hz[worst]))


def drifting_channels(log: RecordedSource, settings: Settings) -> list[ChannelTrend]:
    """The channels that drift so that it matters, in the beginning of a recording."""
    search = TrendSearch(settings, log.first)
    for block in log.blocks(search.channels):
        search.process(block)
        if block.stop - log.first >= SEARCHED:
            break
    return search.finish()


def trend_of(source: AlignedLog, names: Sequence[str], lines: Lines) -> SignalTrend:
    """The trend of these channels over a recording, from its first sample on."""
    stretches: list[TrendStretch] = []
    now: _Stretch | None = None
    for block in source.blocks(list(names)):
        if now is None or block.gap or block.start != now.stop:
            stretches += [] if now is None else now.finish()
            now = _Stretch(len(names), lines, block.start)
        now.add(block.rows(names))
    stretches += [] if now is None else now.finish()
    return SignalTrend(tuple(names), stretches)


class _Stretch:
    """Trend of consecutive samples of some channels, from the sample `first` on, computed some periods at a time."""

    def __init__(self, channels: int, lines: Lines, first: int) -> None:
        self.stop = first
        self._first = self._begins = self._next = first  # of the stretch, the held rows, and the values that follow
        self._window, self._lowest = lines.window, lines.bins[0]
        fastest = min(self._lowest, LOWEST_LINES[1]) if self._lowest >= LOWEST_LINES[0] else 1
        self._step = max(1, lines.window // (_PER_PERIOD * fastest))
        self._rows, self._values = np.zeros((channels, 0)), list[Floats]()

    def add(self, rows: Floats) -> None:
        """Add the next samples."""
        self._rows, self.stop = np.concatenate([self._rows, rows], axis=1), self.stop + rows.shape[1]
        if self._rows.shape[1] >= (_TOGETHER + 2 * _MARGIN) * self._window:
            self._compute(self.stop - _MARGIN * self._window)

    def _compute(self, stop: int) -> None:
        """Add the values before this sample, and forget the samples that no later value needs."""
        trend = np.array([slow_part(_whole(x, self._window), self._window, self._lowest) for x in self._rows])
        places = np.arange(self._next, stop, self._step)
        self._values.append(trend[:, places - self._begins])
        self._next += places.size * self._step
        unused = max(self._next - _MARGIN * self._window - self._begins, 0)
        self._rows, self._begins = self._rows[:, unused:], self._begins + unused

    def finish(self) -> list[TrendStretch]:
        """The stretch at its end; none if it is too short to drift visibly."""
        self._compute(self.stop)
        values = np.concatenate(self._values, axis=1)
        if not values.any() or values.shape[1] < _PER_PERIOD:
            return []
        return [TrendStretch(self._first, self.stop, self._step, values)]


def _whole(x: Floats, window: int) -> Floats:
    """The samples, those that are missing from a period earlier or later, or between their neighbours."""
    missing = np.flatnonzero(~np.isfinite(x))
    if missing.size == x.size:
        return np.zeros(x.size)
    if not missing.size:
        return x
    x = x.copy()
    for shift in (-window, window):
        other = missing[(missing + shift >= 0) & (missing + shift < x.size)]
        x[other] = np.where(np.isfinite(x[other]), x[other], x[other + shift])
    return filled(x)


def trend_event(
    found: Sequence[ChannelTrend],
    settings: Settings,
    channels: Sequence[Channel],
    first: int,
    *,
    straight: bool = False,
) -> Event:
    """One Event for the channels whose trend is subtracted; `straight`: a line that is fitted to each window."""
    drifts = trend_text(found, channels)
    message = Message(
        "{drifts}: this trend, which is below the lines, is subtracted; --trend keep leaves it in", drifts=drifts
    )
    if straight:
        message = Message(
            "{drifts}: this trend is fitted as a straight line in each window; --trend keep leaves it in", drifts=drifts
        )
    return Event("trend-subtracted", first, first / settings.lines.rate_hz, message, {"channels": trend_facts(found)})


def trend_facts(found: Sequence[ChannelTrend]) -> dict[str, dict[str, float]]:
    """Entry of run.json."""
    return {
        one.channel: {
            "step_per_window": one.step,
            "wander_per_window": one.wander,
            "share_of_line": one.share,
            "line_hz": one.line_hz,
        }
        for one in found
    }


def live_trend_message(found: Sequence[ChannelTrend], channels: Sequence[Channel]) -> Message:
    """The message for a live source, which cannot look ahead."""
    return Message(
        "{drifts}, and the bounds do not contain it; in a live run it is taken out by naming the channel in "
        "tracking.differenced",
        drifts=trend_text(found, channels),
    )


def trend_text(found: Sequence[ChannelTrend], channels: Sequence[Channel]) -> str:
    """What drifts, by how much, and what that adds to which line."""
    units = {channel.name: channel.unit for channel in channels}
    return Message.conjunction(_sentence(one, f" {unit}" if (unit := units.get(one.channel)) else "") for one in found)


def _sentence(drift: ChannelTrend, unit: str) -> Message:
    facts = {
        "channel": repr(drift.channel),
        "step": max(abs(drift.step), drift.wander),
        "unit": unit,
        "line_hz": drift.line_hz,
    }
    if drift.share > 1:
        return Message(
            "{channel} drifts by {step:.3g}{unit} from window to window, which adds {times:.3g} times its size to the "
            "line at {line_hz:.6g} Hz",
            times=drift.share,
            **facts,
        )
    return Message(
        "{channel} drifts by {step:.3g}{unit} from window to window, which adds {share_percent:.2g} % to the line at "
        "{line_hz:.6g} Hz",
        share_percent=100 * drift.share,
        **facts,
    )
