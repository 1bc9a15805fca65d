"""Check that a batch belongs to the stream: its channels, units and rate are compared with those of the first."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import Any

import numpy as np

from livebode.core import Channel, SpectraLayout, Stage, StatefulBase
from livebode.language import Message
from livebode.sources.live.batch_state import channels_of, layout_of
from livebode.sources.live.source_events import SourceEvents
from livebode.sources.live.spectra_batch import AnyBatch, SpectraBatch

SAME_RATE = 1e-9


class StreamSchema(StatefulBase):
    """Channels and rate of a stream. A batch with others is skipped, because its values have another meaning.

    Channels in another order, or with new ones among them, are sorted and used. Spectra must have the same layout. The
    first batch determines whether the stream contains samples or spectra.

    Parameters
    ----------
    source_events
        Collector of Events; receives each change once.
    rate_hz
        Required rate, if it is known in advance.
    """

    _stage = Stage("stream-schema", 1)

    def __init__(self, source_events: SourceEvents, rate_hz: float | None = None) -> None:
        self._events = source_events
        self.channels: tuple[Channel, ...] = ()
        self.rate_hz = rate_hz
        self.spectra: SpectraLayout | None = None
        """Layout of the stream's spectra; None for samples."""
        self._seen: tuple[SpectraLayout | tuple[Channel, ...], float] | None = None
        self._rows: list[int] | None = None

    def announce(self, channels: tuple[Channel, ...], rate_hz: float) -> None:
        """Set the stream's channels, known before its first batch."""
        if not self.channels:
            self.rate_hz = self.rate_hz or rate_hz
            self.channels = channels

    def aligned(self, batch: AnyBatch) -> AnyBatch | None:
        """The batch with the stream's channels; None if it does not belong to the stream."""
        stated = (_layout(batch) or batch.channels, batch.rate_hz)
        if not self.channels:
            self.channels, self.spectra = batch.channels, _layout(batch)
            self.rate_hz = self.rate_hz or batch.rate_hz
        if stated != self._seen:
            self._seen = stated
            self._rows = self._compared(batch)
        if self._rows is None:
            return None
        if isinstance(batch, SpectraBatch) or batch.channels == self.channels:
            return batch
        return replace(batch, data=np.ascontiguousarray(batch.data[self._rows]), channels=self.channels)

    def is_same(self, batch: AnyBatch) -> bool:
        """Whether `aligned` would return the batch as it is, because the one before was like it."""
        if self._rows is None or (_layout(batch) or batch.channels, batch.rate_hz) != self._seen:
            return False
        return isinstance(batch, SpectraBatch) or batch.channels == self.channels

    def _compared(self, batch: AnyBatch) -> list[int] | None:
        """Rows of the stream's channels in the batch; None if it cannot be used. Reports what changed."""
        assert self.rate_hz is not None
        if abs(batch.rate_hz / self.rate_hz - 1) > SAME_RATE:
            self._events.report(
                "wrong-rate",
                Message(
                    "the sender states {stated_hz:.9g} Hz instead of {rate_hz_expected:.9g} Hz; its samples are "
                    "skipped",
                    stated_hz=batch.rate_hz,
                    rate_hz_expected=self.rate_hz,
                ),
            )
            return None
        if (layout := _layout(batch)) != self.spectra:
            now = Message("spectra of another layout")
            if layout is None or self.spectra is None:
                now = Message("samples") if layout is None else Message("spectra")
            self._events.report(
                "layout-changed",
                Message("the sender now sends {layout}; they are skipped until the first layout is back", layout=now),
            )
            return None
        units = {channel.name: channel.unit for channel in batch.channels}
        names = list(units)
        if missing := [channel.name for channel in self.channels if channel.name not in units]:
            self._events.report(
                "layout-changed",
                Message(
                    "the sender no longer has channel {channel}; its samples are skipped until it is back",
                    channel=repr(missing[0]),
                ),
                channels=names,
            )
            return None
        for channel in self.channels:
            if channel.unit != units[channel.name]:
                self._events.report(
                    "unit-changed",
                    Message(
                        "the unit of channel {of_channel} changed from {before} to {after}; its samples are skipped",
                        of_channel=repr(channel.name),
                        before=repr(channel.unit),
                        after=repr(units[channel.name]),
                    ),
                    channel=channel.name,
                    unit=units[channel.name],
                )
                return None
        if names != [channel.name for channel in self.channels]:
            self._events.report(
                "layout-changed",
                Message("the sender's channels changed; the first ones are used, by name"),
                channels=names,
            )
        return [names.index(channel.name) for channel in self.channels]

    def _state(self) -> dict[str, Any]:
        return {
            "channels": [asdict(channel) for channel in self.channels],
            "rate_hz": self.rate_hz,
            "spectra": None if self.spectra is None else asdict(self.spectra),
            "seen": None if self._seen is None else _seen_to_plain(*self._seen),
            "rows": self._rows,
        }

    def _load(self, state: dict[str, Any]) -> None:
        self.channels, self.rate_hz = channels_of(state["channels"]), state["rate_hz"]
        self.spectra = layout_of(state["spectra"])
        self._seen = None if state["seen"] is None else _seen_of(state["seen"])
        self._rows = state["rows"]


def _seen_to_plain(seen: SpectraLayout | tuple[Channel, ...], rate_hz: float) -> dict[str, Any]:
    if isinstance(seen, SpectraLayout):
        return {"layout": asdict(seen), "rate_hz": rate_hz}
    return {"layout": None, "channels": [asdict(channel) for channel in seen], "rate_hz": rate_hz}


def _seen_of(plain: dict[str, Any]) -> tuple[SpectraLayout | tuple[Channel, ...], float]:
    return layout_of(plain["layout"]) or channels_of(plain["channels"]), plain["rate_hz"]


def _layout(batch: AnyBatch) -> SpectraLayout | None:
    return batch.layout if isinstance(batch, SpectraBatch) else None
