"""Batches of one stream as bytes of a state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import Channel, SpectraLayout, Stage, decode, encode
from livebode.sources.live.batch import Batch
from livebode.sources.live.spectra_batch import AnyBatch, SpectraBatch

_STAGE = Stage("batches", 1)
_NUMBERS = ("first_sample", "rate_hz", "epoch", "stamp_s", "arrived_s")


def batches_to_state(batches: Sequence[AnyBatch]) -> bytes:
    """These batches, which have the same channels, or the same layout of spectra."""
    numbers = []
    arrays: dict[str, NDArray[Any]] = {}
    channels: list[dict[str, Any]] | None = None
    layout: dict[str, Any] | None = None
    for place, batch in enumerate(batches):
        row = {name: getattr(batch, name) for name in _NUMBERS}
        if isinstance(batch, SpectraBatch):
            layout = asdict(batch.layout)
            arrays[f"sums{place}"], arrays[f"values{place}"] = batch.sums, batch.values
            arrays[f"state{place}"] = batch.state.astype(np.int64)
        else:
            channels = [asdict(channel) for channel in batch.channels]
            arrays[f"data{place}"] = batch.data
            row["mark"] = None if batch.mark is None else dict(batch.mark)
        numbers.append(row)
    return encode(_STAGE, {"numbers": numbers, "channels": channels, "layout": layout, **arrays})


def batches_from_state(state: bytes) -> list[AnyBatch]:
    """The batches; StateError or ValueError where they cannot be restored."""
    values = decode(_STAGE, state)
    numbers, layout = values["numbers"], layout_of(values["layout"])
    if layout is None:
        channels = channels_of(values["channels"] or ())
        return [Batch(data=values[f"data{place}"], channels=channels, **row) for place, row in enumerate(numbers)]
    return [
        SpectraBatch(
            sums=values[f"sums{place}"],
            values=values[f"values{place}"],
            state=values[f"state{place}"].astype(np.uint32),
            layout=layout,
            **row,
        )
        for place, row in enumerate(numbers)
    ]


def channels_of(plain: Sequence[Mapping[str, Any]]) -> tuple[Channel, ...]:
    """Channels from plain data, as `asdict` gives it."""
    return tuple(Channel(**channel) for channel in plain)


def layout_of(plain: Mapping[str, Any] | None) -> SpectraLayout | None:
    """Layout from plain data, as `asdict` gives it; None for samples."""
    if plain is None:
        return None
    lists = {name: tuple(plain[name]) for name in ("lines", "quiet", "subtracted", "differenced")}
    signals, values = (channels_of(plain[name]) for name in ("signals", "values"))
    return SpectraLayout(signals, values, plain["window"], plain["hop"], **lists)
