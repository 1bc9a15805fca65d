"""The steady part of a recording: without the transient at its start and periods that differ from the others."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Flags, Floats
from livebode.core import Event
from livebode.estimation import Settings
from livebode.excitation import medians
from livebode.language import Message
from livebode.preparation.aligned import AlignedLog
from livebode.preparation.roles import ROLES
from livebode.preparation.transients import (
    EXAMINED,
    EXAMINED_MIN,
    EXAMINED_SAMPLES_MAX,
    SHARE_MAX,
    CutPeriods,
    excited_bins,
    leading_transient,
    left_out,
    moves,
    transient_event,
)

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
