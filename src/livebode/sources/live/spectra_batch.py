"""SpectraBatch: spectra that a drive delivers at once. LiveSpectra: Spectra with their time of arrival."""

from __future__ import annotations

from dataclasses import field, replace
from functools import cached_property
from math import nan

import numpy as np
from numpy.typing import NDArray

from livebode.core import Channel, SourceError, Spectra, SpectraLayout, rms
from livebode.dataclass import dataclass
from livebode.sources.live.batch import VALUES_MAX, Batch, LiveBlock, check_numbers
from livebode.sources.live.position import Mark, Origin
from livebode.sources.quantities import DeclaredQuantities, in_si

LATER: NDArray[np.float64] = np.zeros((0, 0))
"""In place of the data of LiveSpectra: they are computed when they are read."""


@dataclass(frozen=True, eq=False)
class LiveSpectra(Spectra, LiveBlock):
    """Spectra from a live source; `arrived_s` as in `LiveBlock`.

    Parameters
    ----------
    values
        Of the value channels of the layout, shape (values, spectra); with `LATER` as data, which nearly nobody reads.
    """

    values: NDArray[np.float64] = field(kw_only=True)

    def __post_init__(self) -> None:
        if self.__dict__["data"] is LATER:  # what it is made from was checked as a batch
            del self.__dict__["data"]
        else:
            super().__post_init__()

    @cached_property  # type: ignore[misc]  # a field that is computed late
    def data(self) -> NDArray[np.float64]:
        sums = dict(zip((channel.name for channel in self.layout.signals), self.sums))
        values = dict(zip((channel.name for channel in self.layout.values), self.values))
        data = np.array([values[n] if n in values else rms(sums[n], self.layout) for n in self.names])
        data.flags.writeable = False
        return data

    def cut(self, first: int, last: int) -> LiveSpectra:
        part = super().cut(first, last)
        assert isinstance(part, LiveSpectra)
        return part if part is self else replace(part, values=self.values[:, first:last])

    def of_channels(self, channels: tuple[Channel, ...]) -> LiveSpectra:
        """The same with the data of these channels, of the layout's."""
        part = object.__new__(LiveSpectra)  # `replace` takes longer than all else of a spectrum
        part.__dict__.update(self.__dict__, channels=channels)
        part.__dict__.pop("data", None)
        return part


@dataclass(frozen=True, eq=False)
class SpectraBatch:
    """Consecutive spectra from one sender; each represents the `hop` samples that end with its window's newest one.

    Parameters
    ----------
    first_sample
        The sender's number of the first of those samples.
    sums, state
        As in `Spectra`.
    values
        float64, shape (values, spectra).
    layout
        Signals, values and lines of the spectra.
    rate_hz, epoch, stamp_s, arrived_s, mark, delivery, again
        As in `Batch`.

    Raises
    ------
    SourceError
        If there are no spectra or too many, shapes disagree, or a number is invalid.
    """

    first_sample: int
    sums: NDArray[np.complex128]
    values: NDArray[np.float64]
    state: NDArray[np.uint32]
    layout: SpectraLayout
    rate_hz: float
    epoch: int = 0
    stamp_s: float | None = None
    arrived_s: float = nan
    mark: Mark | None = None
    delivery: int = 0
    again: bool = False

    def __post_init__(self) -> None:
        signals, values, bins = len(self.layout.signals), len(self.layout.values), len(self.layout.bins)
        spectra = len(self.state)
        if (
            self.sums.shape != (signals, spectra, bins)
            or self.values.shape != (values, spectra)
            or not 0 < 2 * self.sums.size + self.values.size <= VALUES_MAX
        ):
            raise SourceError(
                "batch-shape",
                f"a batch of {spectra} spectra has sums of shape {self.sums.shape} and values of shape "
                f"{self.values.shape}",
                f"send (signals, spectra, bins) and (values, spectra), at most {VALUES_MAX} numbers",
                spectra=spectra,
                shape=list(self.sums.shape),
                values_shape=list(self.values.shape),
            )
        check_numbers(self.first_sample, self.rate_hz, self.stamp_s)
        if self.first_sample % self.layout.hop:
            last, hop = self.first_sample + self.layout.hop - 1, self.layout.hop
            raise SourceError(
                "spectrum-misplaced",
                f"a spectrum ends at sample {last}, which is not one before a multiple of the hop {hop}",
                "correct the sender",
                sample=last,
                hop=hop,
            )

    @property
    def channels(self) -> tuple[Channel, ...]:
        return self.layout.channels

    @property
    def samples(self) -> int:
        """Number of samples that the spectra represent."""
        return len(self.state) * self.layout.hop

    @property
    def stop(self) -> int:
        """The sender's number of the newest sample, plus one."""
        return self.first_sample + self.samples

    @property
    def nbytes(self) -> int:
        return int(self.sums.nbytes + self.values.nbytes + self.state.nbytes)

    def in_si(self, quantities: DeclaredQuantities) -> SpectraBatch:
        """The same in SI units, from those of the sender."""
        layout = self.layout
        signals, values = quantities.of(layout.signals), quantities.of(layout.values)
        if (signals, values) == (layout.signals, layout.values):
            return self
        subtracted = tuple(constant * channel.factor for constant, channel in zip(layout.subtracted, signals))
        layout = replace(layout, signals=signals, values=values, subtracted=subtracted)
        return replace(self, sums=in_si(self.sums, signals), values=in_si(self.values, values), layout=layout)

    def block(self, number: int, start: int, gap: bool) -> LiveSpectra:
        """Spectra from sample `start` of the sender, which gets the number `number`."""
        skipped = (start - self.first_sample) // self.layout.hop
        layout = self.layout
        return LiveSpectra(
            LATER,
            self.channels,
            self.rate_hz,
            start=number,
            gap=gap,
            layout=layout,
            sums=self.sums[:, skipped:],
            values=self.values[:, skipped:],
            state=self.state[skipped:],
            place=(start + layout.hop) % layout.window,
            arrived_s=self.arrived_s,
            origin=Origin(self.epoch, start - number, self.mark),
        )


AnyBatch = Batch | SpectraBatch
