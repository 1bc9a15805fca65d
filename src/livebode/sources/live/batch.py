"""Batch: the samples that a sender delivers at once. LiveBlock: a Block with its time of arrival."""

from __future__ import annotations

from dataclasses import replace
from math import nan

import numpy as np
from numpy.typing import NDArray

from livebode.core import Block, Channel, SourceError
from livebode.dataclass import dataclass
from livebode.sources.live.position import Mark, Origin
from livebode.sources.quantities import DeclaredQuantities, in_si

CHANNELS_MAX = 1024
VALUES_MAX = 1 << 20
"""Most values in one batch; a batch with more is treated as damaged."""
SAMPLE_MAX = 1 << 62
NAME_MAX = 256
_newest: list[tuple[Channel, ...]] = [()]  # channels that were checked


@dataclass(frozen=True, eq=False)
class Batch:
    """Consecutive samples from one sender, numbered by the sender.

    Parameters
    ----------
    first_sample
        The sender's number of the first sample; losses, repeats and reordering are detected from it.
    data
        float64, shape (channels, samples).
    channels, rate_hz
        As the sender states them.
    epoch
        A number that the sender draws at its start, so that a restart is detected; 0 for a sender without one.
    stamp_s
        The sender's clock at the first sample, seconds since 1970; None where it has none.
    arrived_s
        `time.monotonic()` when the batch was received.
    mark
        Position at which the source can read it again; None if it cannot.
    delivery
        Number of the delivery that brought it, ascending, of a source whose sender waits for an acknowledgement.
    again
        Whether the sender may have delivered it before.

    Raises
    ------
    SourceError
        If it has no samples or too many, shapes disagree, or a number or a name is invalid.
    """

    first_sample: int
    data: NDArray[np.float64]
    channels: tuple[Channel, ...]
    rate_hz: float
    epoch: int = 0
    stamp_s: float | None = None
    arrived_s: float = nan
    mark: Mark | None = None
    delivery: int = 0
    again: bool = False

    def __post_init__(self) -> None:
        if self.data.ndim != 2 or len(self.data) != len(self.channels) or not 0 < self.data.size <= VALUES_MAX:
            raise SourceError(
                "batch-shape",
                f"a batch of {len(self.channels)} channels has data of shape {self.data.shape}",
                f"send (channels, samples), at most {VALUES_MAX} values",
                shape=list(self.data.shape),
                channels=len(self.channels),
            )
        check_numbers(self.first_sample, self.rate_hz, self.stamp_s)
        if self.channels is not _newest[0]:  # a sender's batches share them
            check_channels(self.channels)
            _newest[0] = self.channels

    @property
    def samples(self) -> int:
        return int(self.data.shape[1])

    @property
    def stop(self) -> int:
        """Number of the sample that would follow the last one."""
        return self.first_sample + self.samples

    @property
    def nbytes(self) -> int:
        return int(self.data.nbytes)

    def in_si(self, quantities: DeclaredQuantities) -> Batch:
        """The same in SI units, from those of the sender."""
        channels = quantities.of(self.channels)
        return self if channels == self.channels else replace(self, data=in_si(self.data, channels), channels=channels)

    def block(self, number: int, start: int, gap: bool) -> LiveBlock:
        """The samples from the sender's number `start` on, as a Block that begins at `number`."""
        data, origin = self.data[:, start - self.first_sample :], Origin(self.epoch, start - number, self.mark)
        return LiveBlock(
            data, self.channels, self.rate_hz, start=number, gap=gap, arrived_s=self.arrived_s, origin=origin
        )


def check_numbers(first_sample: int, rate_hz: float, stamp_s: float | None) -> None:
    """SourceError if a sender's number, rate or stamp is invalid."""
    if not 0 <= first_sample < SAMPLE_MAX:
        raise wrong_value("first_sample", first_sample, "is not between 0 and 2^62")
    if not 0 < rate_hz < 1e9:
        raise wrong_value("rate_hz", rate_hz, "is not a number of samples per second between 0 and 1e9")
    if stamp_s is not None and not abs(stamp_s) < 1e11:
        raise wrong_value("stamp_s", stamp_s, "is not a number of seconds since 1970")


def wrong_value(key: str, value: float, wrong: str) -> SourceError:
    return SourceError("value-invalid", f"{key}={value} {wrong}", "correct the sender", key=key, value=value)


def check_channels(channels: tuple[Channel, ...], at_least: int = 1) -> None:
    """SourceError if a channel name of the sender is missing, duplicated, too long or not printable."""
    if not at_least <= len(channels) <= CHANNELS_MAX:
        raise SourceError(
            "channels-invalid",
            f"the sender has {len(channels)} channels, not {at_least} to {CHANNELS_MAX}",
            "correct the sender",
            channels=len(channels),
        )
    names = {channel.name for channel in channels}
    if len(names) != len(channels):
        raise SourceError("channels-invalid", "two channels of the sender have the same name", "rename one of them")
    for channel in channels:
        text = channel.name + channel.unit
        if not channel.name or len(channel.name) > NAME_MAX or len(channel.unit) > NAME_MAX or not text.isprintable():
            raise SourceError(
                "channels-invalid",
                f"channel name {channel.name[:40]!r} is empty, too long or not printable",
                f"give a name and a unit of at most {NAME_MAX} printable characters",
                channel=channel.name[:40],
            )


@dataclass(frozen=True, eq=False)
class LiveBlock(Block):
    """A Block from a live source.

    `arrived_s` is `time.monotonic()` when its last sample was received, `origin` how its sender numbers its samples;
    other parameters as in `Block`.
    """

    arrived_s: float = nan
    origin: Origin | None = None
