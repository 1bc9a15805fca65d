"""Replayable: a log of a sender's samples that can be read again from any of them; and the live source of one."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar, NamedTuple, Protocol

from livebode.core import Channel, RunClock
from livebode.sources.live.address import Address
from livebode.sources.live.settings import SourceSettings
from livebode.sources.live.source import LiveSource
from livebode.sources.live.spectra_batch import AnyBatch


class SenderSample(NamedTuple):
    """A sample by its sender's own count: its number in an epoch."""

    epoch: int
    number: int


class Replayable(Protocol):
    """A log of what a sender sent: samples recorded by a run, or a stream that a server stores.

    A machine sends a sample once, and a recording has no epochs. A log has the sender's epochs and numbers, and gives
    the same samples each time, from any of them on.
    """

    @property
    def channels(self) -> tuple[Channel, ...]: ...

    @property
    def rate_hz(self) -> float: ...

    @property
    def samples(self) -> int | None:
        """Number of samples in it; None if it still grows."""

    @property
    def clock(self) -> RunClock:
        """Time of day of its samples, where second 0 is that of the sender's number 0; empty if it is not known."""

    def batches(self, begin: SenderSample | None = None) -> Iterator[AnyBatch]:
        """The batches in the order of the log, from the one that contains sample `begin`; from the first by default.

        Without that sample, which may be lost: from the next one of its epoch.

        Raises
        ------
        LivebodeError
            If the log cannot be read, or has no sample of this epoch.
        OSError
            If it cannot be read now; the source tries again.
        """


class ReplaySource(LiveSource):
    """A log as a live source, as fast as its samples are tracked.

    The Blocks have the numbers that the sender gave its samples, wherever reading begins. After a restart of the sender
    its numbers can begin again: those of the Blocks continue, and `LiveBlock.origin` relates the two.
    """

    format: ClassVar[str] = "replay"
    waits: ClassVar[bool] = True
    on_demand: ClassVar[bool] = True
    paced: ClassVar[bool] = False
    sender_numbers: ClassVar[bool] = True

    def __init__(self, settings: SourceSettings, address: Address, log: Replayable) -> None:
        super().__init__(settings, address)
        self._replayed = log

    @property
    def samples(self) -> int | None:
        return self._replayed.samples

    @property
    def clock(self) -> RunClock:
        """Time of day of its Blocks."""
        return self._replayed.clock

    def _receive(self) -> bool:
        left = self._resumed
        log = self._replayed
        self._announce(log.channels, log.rate_hz)
        self._connected = True
        for batch in log.batches(None if left is None else SenderSample(left.epoch, left.number)):
            if self._stop.is_set():
                return False
            self._deliver(batch)
        return True
