"""The steady part of a recording: without the transient at its start, spikes and differing periods."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Flags, Floats
from livebode.core import Event
from livebode.estimation import PLACES, Movement, Settings, SpikeGate
from livebode.excitation import cut, filled, leading, medians, unlike
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


def leading_transient(log: AlignedLog, settings: Settings) -> int:
    """Periods at the beginning that differ from the steady state in a signal of the estimate, as `inspect` finds them.

    0 for a machine that moves, by its schedule, whose periods differ anyway; for fewer than eight periods; and if
    more than a quarter would be excluded.
    """
    window = settings.lines.window
    names = [name for role in ROLES if role in settings.roles and (name := settings.channel(role))]
    channels = list(dict.fromkeys(names + ([settings.schedule] if settings.schedule else [])))
    return transient_periods(
        dict(zip(channels, beginnings(log, channels, min(EXAMINED * window, EXAMINED_SAMPLES_MAX)))), settings
    )


def transient_periods(signals: Mapping[str, Floats], settings: Settings) -> int:
    """The same in signals by the names of their channels, of which the first 64 periods count."""
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


def outlying_periods(log: AlignedLog, settings: Settings) -> tuple[int, ...]:
    """Numbers of the periods that differ from those around them in a signal of the estimate, counted from `log.first`.

    Each is compared with the 64 periods around it. A pause of the excitation always differs. Other periods count only
    if the later ones are as the earlier ones: else they are another state of the machine. None for a machine that
    moves, by its schedule; for fewer than eight periods; and where more than a quarter differs. Channels that are
    checked for spikes are left to that check.
    """
    window = settings.lines.window
    names = [name for role in ROLES if role in settings.roles and (name := settings.channel(role))]
    channels = list(dict.fromkeys(names + ([settings.schedule] if settings.schedule else [])))
    count = min(EXAMINED, EXAMINED_SAMPLES_MAX // window)
    found: list[int] = []
    if count < EXAMINED_MIN:
        return ()
    judged = 0
    for first, rows, last in _stretches(log, channels, window, count):
        flags = _outlying(dict(zip(channels, rows)), settings, last)
        # Of a run of periods near the end of a stretch, the next one shows how it ends.
        stop = len(flags) if last else len(flags) - len(flags) // 4
        found += [first + int(m) for m in np.flatnonzero(flags[:stop]) if first + m >= judged]
        judged = first + stop
    return tuple(found)


def _stretches(log: AlignedLog, channels: Sequence[str], window: int, count: int) -> Iterator[tuple[int, Floats, bool]]:
    """First period, samples, and whether it is the last, of stretches of `count` periods, each half of that later."""
    held, stop, first = [np.zeros((len(channels), 0))], log.first, 0
    for block in log.blocks(channels):
        missing = np.full((len(channels), block.start - stop), np.nan)
        held, stop = [*held, missing, np.array([block[name] for name in channels])], block.stop
        while stop - log.first >= (first + count + count // 2) * window:
            rows = np.concatenate(held, axis=1)
            yield first, rows[:, : count * window], False
            held, first = [rows[:, count // 2 * window :]], first + count // 2
    rows = np.concatenate(held, axis=1)
    begins = max(rows.shape[1] // window - count, 0)
    if begins:
        yield first, rows[:, : count * window], False
    yield first + begins, rows[:, begins * window : (begins + count) * window], True


def _outlying(signals: Mapping[str, Floats], settings: Settings, last: bool) -> Flags:
    """Which periods of a stretch are left out, shape (periods,)."""
    window = settings.lines.window
    count = next(iter(signals.values())).size // window
    if count < EXAMINED_MIN or (settings.schedule and moves(signals[settings.schedule], window)):
        return np.zeros(count, dtype=np.bool_)
    names = [name for role in settings.roles if (name := settings.channel(role)) and name not in settings.spikes]
    strange = np.zeros(count, dtype=np.bool_)
    reference = settings.excitation if settings.method.reference == "excitation" else None
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


def steady(source: AlignedLog, settings: Settings) -> Steady:
    """What is steady in a recording, whose periods count from `source.first`."""
    window, begins, noticed = settings.lines.window, source.first, []
    if transient := leading_transient(source, settings):
        noticed.append(replace(transient_event(transient, settings), sample=begins))
    outlying = [m for m in outlying_periods(source, settings) if m >= transient]
    if outlying:
        noticed.append(outlying_event(outlying, settings, begins))
    return Steady(begins + transient * window, outlying_samples(outlying, window, begins), noticed)
