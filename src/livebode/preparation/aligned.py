"""A recording on one grid of periods: dropped samples become gaps, a known transient is excluded."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from livebode.core import Block, Channel, Event
from livebode.dataclass import dataclass
from livebode.estimation import Settings
from livebode.excitation import Slip, find_slips
from livebode.language import Message
from livebode.sources import Log

_PART = 1 << 18  # samples per search
_OVERLAP = 8  # periods common to two parts, so that a phase slip at their border is detected
_LISTED_MAX = 1000


def slips_of(log: Log, settings: Settings) -> tuple[Slip, ...]:
    """Phase slips of the excitation at the period of the lines; none if the reference is not an excitation."""
    name, period = settings.excitation, settings.lines.window
    if settings.method.reference != "excitation" or name is None or not settings.periodic:
        return ()
    search, size = SlipSearch(period, log.first), max(_PART // period, 4 * _OVERLAP) * period
    return tuple(slip for part in _whole_parts(log, name, size) for slip in search.take(bridged(part)))


class SlipSearch:
    """Finds the phase slips of a signal that arrives in parts, each once.

    Parameters
    ----------
    period
        Period of the signal, in samples.

    Attributes
    ----------
    begins_at
        Number of its first sample; None until it is known.
    """

    def __init__(self, period: int, begins_at: int | None = None) -> None:
        self.begins_at = begins_at
        self._period, self._held = period, np.zeros(0)
        self._first = 0
        self._newest = -2 * period

    def take(self, part: np.ndarray) -> list[Slip]:
        """The phase slips in this part, whose samples are all finite."""
        period, found, begins = self._period, list[Slip](), self.begins_at or 0
        self._held = np.concatenate([self._held, part])
        for slip in find_slips(self._held, period):
            at = self._first + slip.sample
            if at > self._newest + 2 * period:
                self._newest = at
                found.append(Slip(begins + at, slip.missing))
        # The next part begins on the grid of this one.
        done = max(self._held.size - _OVERLAP * period, 0) // period * period
        self._first, self._held = self._first + done, self._held[done:].copy()  # a view would hold all of it
        return found


def _whole_parts(log: Log, channel: str, size: int) -> Iterator[np.ndarray]:
    """The samples of a channel in parts of about this size, NaN for missing ones."""
    parts: list[np.ndarray] = []
    held, stop = 0, log.first
    for block in log.blocks([channel]):
        parts += [np.full(block.start - stop, np.nan), block[channel]]
        held, stop = held + block.stop - stop, block.stop
        if held >= size:
            whole = np.concatenate(parts)
            parts, held = [], 0  # first: a part is several megabytes
            yield whole
            del whole
    if parts:
        yield np.concatenate(parts)


def bridged(x: np.ndarray) -> np.ndarray:
    """The same, 0 for missing samples."""
    known = np.isfinite(x)
    return x if known.all() else np.where(known, x, 0.0)


@dataclass(frozen=True, eq=False)
class AlignedLog:
    """A recording from one sample on, with phase slips as gaps: numbers count missing samples, not repeated ones."""

    log: Log
    slips: tuple[Slip, ...]
    first: int = 0

    @property
    def channels(self) -> tuple[Channel, ...]:
        return self.log.channels

    @property
    def samples(self) -> int | None:
        known = self.log.samples
        left_out = self.first - self.log.first
        return None if known is None else known - left_out - sum(max(-slip.missing, 0) for slip in self.slips)

    def blocks(self, channels: Sequence[str] | None = None) -> Iterator[Block]:
        """The Blocks of the recording after its first samples, cut at the phase slips."""
        for block in self._aligned(channels):
            if block.stop > self.first:
                yield block.cut(max(self.first - block.start, 0), len(block))

    def _aligned(self, channels: Sequence[str] | None) -> Iterator[Block]:
        shift, again, ahead, leapt = 0, 0, list(self.slips), False
        for block in self.log.blocks(channels):
            while len(block):
                if again:
                    drop = min(again, len(block))
                    block, again = block.cut(drop, len(block)), again - drop
                    continue
                if ahead and ahead[0].sample <= block.start:
                    slip = ahead.pop(0)
                    shift, leapt = shift + slip.missing, True
                    again = max(-slip.missing, 0)
                    continue
                stop = min(ahead[0].sample - block.start if ahead else len(block), len(block))
                piece = block.cut(0, stop)
                yield replace(piece, start=piece.start + shift, gap=piece.gap or leapt)
                block, leapt = block.cut(stop, len(block)), False


def slip_event(slips: Sequence[Slip], settings: Settings) -> Event:
    """One Event for all phase slips, at the first of them."""
    first = slips[0]
    missing, again = (sum(max(sign * slip.missing, 0) for slip in slips) for sign in (1, -1))
    lacking = (
        Message("1 sample missing") if missing == 1 else Message("{samples} samples missing", samples=missing),
        Message("1 sample repeated") if again == 1 else Message("{samples} samples repeated", samples=again),
    )
    message = Message(
        "the phase of {channel} jumps {times}, first at sample {at_sample}: {samples} without a gap in the recording; "
        "each is realigned and treated as a gap",
        channel=repr(settings.excitation),
        times=Message("1 time") if len(slips) == 1 else Message("{times} times", times=len(slips)),
        at_sample=first.sample,
        samples=Message.conjunction(one for one, many in zip(lacking, (missing, again)) if many),
    )
    details = {"count": len(slips), "slips": [[slip.sample, slip.missing] for slip in slips[:_LISTED_MAX]]}
    return Event("phase-slips", first.sample, first.sample / settings.lines.rate_hz, message, details)
