"""The steady part of a recording: without the transient at its start, spikes and differing periods."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Flags, Floats
from livebode.core import Block, Event
from livebode.dataclass import dataclass
from livebode.estimation import PLACES, Movement, Settings, SpikeGate
from livebode.excitation import alike, cut, filled, leading, medians, spectra, unlike
from livebode.language import Message
from livebode.preparation.aligned import AlignedLog
from livebode.preparation.plan import beginnings
from livebode.preparation.roles import ROLES

_PERIODS, _PERIODS_MIN = 18, 12  # that are searched, backwards
_EARLY = 9  # periods after which the gate has learned the usual level


def early_spikes(log: AlignedLog, settings: Settings) -> NDArray[np.int64]:
    """Numbers of spikes in the first nine periods, by the same gate from the end to the beginning, ascending.

    None for fewer than twelve periods, or without `settings.spikes`.
    """
    window, none = settings.lines.window, np.zeros(0, dtype=np.int64)
    if not settings.spikes:
        return none
    held = beginnings(log, settings.spikes, _PERIODS * window)
    count = held.shape[1] // window
    if count < _PERIODS_MIN or not np.isfinite(held).any(axis=1).all():
        return none
    signals = np.array([_as_watched(name, x[: count * window], settings) for name, x in zip(settings.spikes, held)])
    gate = SpikeGate(np.ones(len(signals), dtype=np.bool_), window)
    found = np.sort(count * window - 1 - gate.process(signals[:, ::-1]))
    return np.asarray(log.first + found[found < _EARLY * window], dtype=np.int64)


def _as_watched(name: str, x: NDArray[np.float64], settings: Settings) -> NDArray[np.float64]:
    whole = filled(x)
    return np.diff(whole, prepend=whole[0]) if name in settings.differenced else whole


EXAMINED, EXAMINED_SAMPLES_MAX = 64, 1 << 20
"""Periods that are compared with each other, and samples in them, at most."""
EXAMINED_MIN = 8
SHARE_MAX = 1 / 4
"""Of the examined periods: more that differ are not a disturbance, but another state of the machine."""


def transient_periods(signals: Mapping[str, Floats], settings: Settings) -> int:
    """Periods at the beginning that differ from the steady state in a signal of the estimate, as `inspect` finds them.

    0 for a machine that moves, by its schedule, whose periods differ anyway; for fewer than eight periods; and if
    more than a quarter would be excluded.

    Parameters
    ----------
    signals
        By the names of their channels; the first 64 periods count.
    """
    window = settings.lines.window
    size = min(EXAMINED * window, EXAMINED_SAMPLES_MAX)
    found = {name: x[:size] for name, x in signals.items()}
    names = [name for role in ROLES if role in settings.roles and (name := settings.channel(role))]
    count = found[names[0]].size // window
    if count < EXAMINED_MIN or (settings.schedule and moves(found[settings.schedule], window)):
        return 0
    first = max(_transient(found[name], window, excited_bins(settings)) for name in names)
    return first if first <= SHARE_MAX * count else 0


@dataclass(frozen=True, eq=False)
class CutPeriods:
    """Periods of a signal without their drift, (periods, window), and the numbers of those without missing samples."""

    blocks: Floats
    whole: NDArray[np.intp]

    @classmethod
    def of(cls, x: Floats, window: int) -> CutPeriods:
        """Those of a signal, NaN for missing samples; none if less than one period is known."""
        known = np.isfinite(x)
        if np.count_nonzero(known) < window:
            return cls(np.zeros((x.size // window, window)), np.zeros(0, dtype=np.intp))
        blocks = cut(filled(x), window)
        # An interpolated period differs from the others, but not because of the machine.
        return cls(blocks, np.flatnonzero(known[: blocks.size].reshape(blocks.shape).all(axis=1)))

    def unlike(self, excited: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Which of the whole periods differ from the others."""
        blocks = self.blocks if len(self.whole) == len(self.blocks) else self.blocks[self.whole]
        return unlike(blocks, excited)


def _transient(x: Floats, window: int, excited: NDArray[np.bool_]) -> int:
    periods = CutPeriods.of(x, window)
    whole, strange = periods.whole, periods.unlike(excited)
    count = leading(strange) if whole.size else 0
    return int(whole[count - 1]) + 1 if count else 0


def excited_bins(settings: Settings) -> NDArray[np.bool_]:
    """Which bins of a period are lines, shape (bins,)."""
    excited = np.zeros((settings.lines.window + 1) // 2, dtype=np.bool_)
    excited[list(settings.lines.bins)] = True
    return excited


def moves(schedule: np.ndarray, window: int) -> bool:
    """Whether the machine moves after the longest possible transient, in which it may settle."""
    settled = schedule[int(SHARE_MAX * schedule.size) // window * window :]
    step = max(1, window // PLACES)
    periods = settled[: settled.size // window * window].reshape(-1, window)[:, : window // step * step : step]
    return bool(Movement(periods.shape[1]).process(0, periods.ravel()).any())


def left_out(finding: Message, samples: int, seconds: float, *, also_before: bool = False) -> Message:
    """What was found, and the samples that are therefore left out; `also_before`: with those before the excitation."""
    excluded = Message("{samples} samples ({seconds:.4g} s) are excluded", samples=samples, seconds=seconds)
    if also_before:
        excluded = Message("with the samples before them, {excluded}", excluded=excluded)
    return Message("{finding}: {excluded}; --all-periods includes them", finding=finding, excluded=excluded)


def transient_event(periods: int, settings: Settings, first: int = 0, time_s: float = 0.0, *, begun: int = 0) -> Event:
    """Event for the excluded samples up to the steady state, at sample `first`, where the excitation begins.

    `begun` is the number of the first sample. The event's `samples` is the number of the first sample that is used.
    """
    stop = first + periods * settings.lines.window
    samples = stop - begun
    finding = Message("the first period differs from the steady state")
    if periods > 1:
        finding = Message("the first {periods} periods differ from the steady state", periods=periods)
    message = left_out(finding, samples, samples / settings.lines.rate_hz, also_before=first > begun)
    return Event("transient", first, time_s, message, {"periods": periods, "samples": stop})


_SILENT = 0.5  # of the typical excitation: below it does not run, as in `extent`
_AT_END = 2  # periods at the end of a recording that may differ without a return to the others
_LISTED_MAX = 1000


def _outlying(signals: Mapping[str, Floats], settings: Settings, same: Container[str], last: bool) -> Flags:
    """Which periods of a stretch are left out, shape (periods,); none differs in the channels `same`."""
    window = settings.lines.window
    count = next(iter(signals.values())).size // window
    names = [name for role in settings.roles if (name := settings.channel(role)) and name not in settings.spikes]
    reference = settings.excitation if settings.method.reference == "excitation" else None
    names = [name for name in names if name not in same]
    reference = None if reference in same else reference
    if count < EXAMINED_MIN or not (names or reference):
        return np.zeros(count, dtype=np.bool_)
    if settings.schedule and moves(signals[settings.schedule], window):
        return np.zeros(count, dtype=np.bool_)
    strange = np.zeros(count, dtype=np.bool_)
    periods = {
        name: CutPeriods.of(signals[name], window) for name in dict.fromkeys([*names, *filter(None, [reference])])
    }
    for name in names:
        strange[periods[name].whole[periods[name].unlike(excited_bins(settings))]] = True
    silent = np.zeros(count, dtype=np.bool_)
    if reference:
        silent = _silent(periods[reference])
    returning = bounded(strange | silent, last)
    return silent | (returning if np.count_nonzero(returning & ~silent) <= SHARE_MAX * count else silent)


def _silent(excitation: CutPeriods) -> Flags:
    """Periods in which the excitation does not run."""
    blocks = excitation.blocks
    typical = medians(blocks, axis=0)
    return np.asarray(blocks @ typical < _SILENT * typical @ typical)


def bounded(flags: Flags, last: bool) -> Flags:
    """The runs of flags with other periods on both sides; at the end of a recording also short ones without."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(np.int8), [0]])))
    found = np.zeros_like(flags)
    for first, stop in zip(edges[::2], edges[1::2]):
        ends = stop == flags.size
        if first > 0 and (not ends or (last and stop - first <= _AT_END)):
            found[first:stop] = True
    return found


def outlying_samples(periods: Sequence[int], window: int, first: int) -> NDArray[np.int64]:
    """First and last sample of each period from sample `first` on: every window that overlaps it contains one."""
    begins = first + np.asarray(periods, dtype=np.int64) * window
    return np.sort(np.concatenate([begins, begins + window - 1]))


def outlying_event(periods: Sequence[int], settings: Settings, first: int) -> Event:
    """One Event for all periods that are left out, at the first of them."""
    lines, numbers = settings.lines, ", ".join(map(str, periods[:20])) + " …" * (len(periods) > 20)
    finding = Message("periods {numbers} differ from the others", numbers=numbers)
    if len(periods) == 1:
        finding = Message("period {number} differs from the others", number=periods[0])
    samples = len(periods) * lines.window
    message = left_out(finding, samples, samples / lines.rate_hz)
    at = first + periods[0] * lines.window
    details = {"periods": list(periods[:_LISTED_MAX]), "count": len(periods), "samples": samples}
    return Event("outlying-periods", at, at / lines.rate_hz, message, details)


@dataclass(frozen=True, eq=False)
class Steady:
    """First sample behind the transient, numbers of the samples to leave out, and the events."""

    first: int
    left_out: NDArray[np.int64]
    noticed: list[Event]


class SteadySearch:
    """Finds the transient at the beginning of a recording, and its outlying periods, in its Blocks.

    Each period is compared with the 64 periods around it. A pause of the excitation always differs. Other periods count
    only if the later ones are as the earlier ones: else they are another state of the machine. None is found for a
    machine that moves, by its schedule; for fewer than eight periods; and where more than a quarter differs. Channels
    that are checked for spikes are left to that check.

    Parameters
    ----------
    settings
        Lines and signals.
    first
        Number of the recording's first sample, from which its periods count.
    """

    def __init__(self, settings: Settings, first: int) -> None:
        names = [name for role in ROLES if role in settings.roles and (name := settings.channel(role))]
        self.channels = list(dict.fromkeys(names + ([settings.schedule] if settings.schedule else [])))
        self._settings, self._first, self._window = settings, first, settings.lines.window
        self._together = min(EXAMINED, EXAMINED_SAMPLES_MAX // self._window)
        self._same = _AlikeChannels(settings, names)
        self._rows, self._stop = np.zeros((len(self.channels), 0)), first
        self._begins = 0  # period of the first sample that is held
        self._transient: int | None = None
        self._found, self._judged = list[int](), 0

    def process(self, block: Block) -> None:
        """Judge the stretches of 64 periods that end in this Block, each half of that later."""
        if self._together < EXAMINED_MIN:
            return
        missing = np.full((len(self.channels), block.start - self._stop), np.nan)
        self._rows = np.concatenate([self._rows, missing, block.rows(self.channels)], axis=1)
        self._stop, half = block.stop, self._together // 2
        while self._rows.shape[1] >= (self._together + half) * self._window:
            self._judge(self._rows, last=False)
            self._begins, self._rows = self._begins + half, self._rows[:, half * self._window :]

    def finish(self) -> Steady:
        """What is steady, at the end of the recording."""
        begins = max(self._rows.shape[1] // self._window - self._together, 0)
        if begins:
            self._judge(self._rows, last=False)
        self._begins += begins
        self._judge(self._rows[:, begins * self._window :], last=True)
        window, first, settings, transient = self._window, self._first, self._settings, self._transient or 0
        noticed = [replace(transient_event(transient, settings), sample=first)] if transient else []
        outlying = [m for m in self._found if m >= transient]
        if outlying:
            noticed.append(outlying_event(outlying, settings, first))
        return Steady(first + transient * window, outlying_samples(outlying, window, first), noticed)

    def _judge(self, rows: Floats, *, last: bool) -> None:
        """Judge the first periods of these samples."""
        signals = dict(zip(self.channels, rows[:, : self._together * self._window]))
        same = self._same.names(signals, self._begins)
        if self._transient is None:
            whole = dict(zip(self.channels, rows))
            self._transient = 0 if self._same.all(same) else transient_periods(whole, self._settings)
        flags = _outlying(signals, self._settings, same, last)
        # Of a run of periods near the end of a stretch, the next one shows how it ends.
        stop = len(flags) if last else len(flags) - len(flags) // 4
        self._found += [m for m in (self._begins + np.flatnonzero(flags[:stop])).tolist() if m >= self._judged]
        self._judged = self._begins + stop


class _AlikeChannels:
    """Finds channels in which certainly no period of a stretch differs, before all of it is computed."""

    def __init__(self, settings: Settings, names: Sequence[str]) -> None:
        self._names, self._window, self._bins = names, settings.lines.window, settings.lines.bins
        self._reference = settings.excitation if settings.method.reference == "excitation" else None
        self._excited = excited_bins(settings)
        self._spectra: dict[str, tuple[int, Complex]] = {}

    def all(self, same: Container[str]) -> bool:
        """Whether these are all channels of the estimate."""
        return all(name in same for name in self._names)

    def names(self, signals: Mapping[str, Floats], first: int) -> set[str]:
        """Those in a stretch that begins with this period."""
        return {name for name in self._names if self._alike(name, signals[name], first)}

    def _alike(self, name: str, x: Floats, first: int) -> bool:
        periods = x[: x.size // self._window * self._window].reshape(-1, self._window)
        if len(periods) < EXAMINED_MIN:
            return False
        if np.array_equal(periods[0], periods[1]) and np.all(periods == periods[0]):
            return True
        if name == self._reference:  # it may pause, too
            return False
        with np.errstate(all="ignore"):
            return alike(periods, lambda: self._lines(name, periods, first), self._bins)

    def _lines(self, name: str, periods: Floats, first: int) -> Complex:
        """Spectra at the lines, of which a part is known from the previous stretch."""
        begun, known = self._spectra.get(name, (first, np.zeros((0, len(self._bins)), dtype=np.complex128)))
        known = known[first - begun :]
        found = np.concatenate([known, spectra(periods[len(known) :], self._excited)])
        self._spectra[name] = first, found
        return found


def steady(source: AlignedLog, settings: Settings) -> Steady:
    """What is steady in a recording, whose periods count from `source.first`."""
    search = SteadySearch(settings, source.first)
    for block in source.blocks(search.channels):
        search.process(block)
    return search.finish()
