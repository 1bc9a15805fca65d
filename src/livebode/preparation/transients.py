"""Number of periods at the beginning of a recording that differ from the later ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Event
from livebode.estimation import PLACES, Movement, Settings
from livebode.excitation import cut, filled, leading, unlike
from livebode.language import Message
from livebode.preparation.aligned import AlignedLog
from livebode.preparation.plan import beginnings
from livebode.preparation.roles import ROLES

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
