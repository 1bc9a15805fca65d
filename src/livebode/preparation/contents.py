"""What the channels of a recording contain: range, samples that are not finite, gaps, text among the numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace

import numpy as np

from livebode.core import Block, Channel, QuantityKind, RecordingError
from livebode.dataclass import dataclass
from livebode.preparation.plan import RecordedSource
from livebode.sources import Log, Skipped, UnevenLog

_UNREADABLE_MAX = 16
"""Channels with text further down that are left out, each after another reading of the file."""


@dataclass
class ChannelSummary:
    """One channel over the whole recording: range of its finite samples, and number of others.

    `source_unit` is the unit in the file where the samples are in another one, else empty.
    """

    name: str
    unit: str
    kind: QuantityKind
    source_unit: str = ""
    minimum: float = float("inf")
    maximum: float = float("-inf")
    not_finite: int = 0

    @classmethod
    def of(cls, channel: Channel) -> ChannelSummary:
        """Of a channel, before its samples."""
        return cls(channel.name, channel.unit, channel.kind, channel.source_unit if channel.factor != 1 else "")

    def take(self, block: Block) -> None:
        samples = block[self.name]
        finite = samples[np.isfinite(samples)]
        self.not_finite += samples.size - finite.size
        if finite.size:
            self.minimum = min(self.minimum, float(finite.min()))
            self.maximum = max(self.maximum, float(finite.max()))


@dataclass(frozen=True)
class Contents:
    """Result of `read_contents`; `unreadable`: the channels that have text further down."""

    samples: int = 0
    channels: list[ChannelSummary] = field(default_factory=list)
    gaps: int = 0
    missing: int = 0
    unreadable: tuple[Skipped, ...] = ()


def read_contents(log: Log, names: Sequence[str], required: Sequence[str]) -> Contents:
    """The contents of the channels; one that has text further down is left out, except if it is `required`."""
    unreadable: list[Skipped] = []
    while True:
        try:
            return replace(contents_of(log, names), unreadable=tuple(unreadable))
        except RecordingError as error:
            heading = error.facts.get("channel", "")
            name = log.aliases.get(heading, heading)
            left = [other for other in names if other != name]
            wrong = not error.code.endswith("cell-not-a-number")
            if wrong or {name, heading} & set(required) or not left or len(unreadable) == _UNREADABLE_MAX:
                raise
            unreadable.append(Skipped(name, f"line {error.facts['line']} has the text {error.facts['value']!r}"))
            names = left


def contents_of(log: RecordedSource, names: Sequence[str]) -> Contents:
    if isinstance(log, UnevenLog):
        return _uneven_contents(log, names)
    summaries: dict[str, ChannelSummary] = {}
    samples, gaps, missing, stop = 0, 0, 0, None
    for block in log.blocks(names):
        for channel in block.channels:
            summaries.setdefault(channel.name, ChannelSummary.of(channel)).take(block)
        samples += len(block)
        if stop is not None and (block.gap or block.start != stop):
            gaps, missing = gaps + 1, missing + block.start - stop
        stop = block.stop
    return Contents(samples, list(summaries.values()), gaps, missing)


def _uneven_contents(log: UnevenLog, names: Sequence[str]) -> Contents:
    """The same of the samples at their own times, in the common time of the channels."""
    labels = {channel.name: channel for channel in log.naming(names).channels}
    found = {name: ChannelSummary.of(labels[name]) for name in names}
    begin_s, end_s = log.first / log.rate_hz, log.stop / log.rate_hz
    for clock in log.clocks(names):
        channels = tuple(labels[name] for name in clock.channels)
        for time_s, data in log.pieces(clock.channels):
            inside = (time_s >= begin_s) & (time_s < end_s)
            for name in clock.channels:
                found[name].take(Block(data[:, inside], channels, log.rate_hz))
    return Contents(log.samples, list(found.values()))
