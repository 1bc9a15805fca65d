"""A recording whose channels have clocks of their own as a source of Spectra."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.core import LEFT_OUT, NOT_WHOLE, Channel, SignalError, Spectra, SpectraLayout, rms
from livebode.dataclass import dataclass
from livebode.estimation import LineStage, Settings, UnevenSpectra, UnevenWindow
from livebode.preparation.uneven_segments import segments
from livebode.sources import ClockGroup, Resampler, UnevenLog

_TYPICAL = 16  # windows that show the usual variance
_INSEPARABLE = 10.0
"""Variance at a line, in that of as many even samples, above which the samples do not separate the lines."""
_THIN = 2.0
"""Variance in the usual one above which a window has too few samples."""
_NAMED = 8
_ROWS = 64  # spectra in a block


@dataclass(frozen=True, eq=False)
class _Clock:
    """Channels of one clock and their usual variance, shape (channels, lines)."""

    group: ClockGroup
    fit: UnevenSpectra
    usual: Floats


class UnevenSource:
    """Spectra of a recording, by least squares at the times of its samples, window after window.

    Parameters
    ----------
    log
        The recording, on a grid in which `settings.lines` are those of its window.
    settings
        Of the tracker.
    values
        Channels whose value at the centre of each window is in the spectra.
    drifting
        Channels that are fitted with a linear trend.

    Raises
    ------
    SignalError
        If the samples of a channel do not separate the lines.
    """

    def __init__(self, log: UnevenLog, settings: Settings, values: Sequence[str], drifting: Sequence[str]) -> None:
        self._log, self._settings = log, settings
        lines = settings.lines
        signals = list(dict.fromkeys(name for role in settings.roles if (name := settings.channel(role))))
        labels = {channel.name: channel for channel in log.naming([*signals, *values]).channels}
        self.layout = SpectraLayout(
            tuple(labels[name] for name in signals),
            tuple(labels[name] for name in values),
            lines.window,
            settings.step,
            lines.bins,
            tuple(sorted({int(k) for k in LineStage(settings).bins} - set(lines.bins))),
        )
        self._step = min(settings.step, lines.window)
        self.first, self.left_out = log.first, np.zeros(0, dtype=np.int64)
        groups = log.clocks(signals)
        order = [name for group in groups for name in group.channels]
        self._rows = [order.index(name) for name in signals]
        self._clocks = [self._clock(group, drifting) for group in groups]

    @property
    def channels(self) -> tuple[Channel, ...]:
        return self.layout.channels

    @property
    def samples(self) -> int:
        """Samples of the grid."""
        return self._log.stop - self.first

    def _clock(self, group: ClockGroup, drifting: Sequence[str]) -> _Clock:
        """The clock with its usual variance; SignalError if that is too large."""
        lines, log = self._settings.lines, self._log
        trend = [name in drifting for name in group.channels]
        expected = group.stamps.rate_hz * lines.window / lines.rate_hz
        whole = UnevenSpectra(lines.bins, (), lines.window, 1, expected, trend)
        first = -(-log.first // lines.window)
        parts = self._segments(group, whole, first, min(log.stop // lines.window, first + _TYPICAL), lines.window)
        found = [window.inflation for window in whole.windows(parts, first, 1)]
        if not found:
            raise SignalError(
                "too-short",
                f"the channels have {log.samples} samples of the grid of {lines.rate_hz:.6g} Hz in common, less than "
                f"two windows of {lines.window}",
                "choose a shorter window, or record more",
                samples=log.samples,
                window=lines.window,
            )
        usual = np.median(found, axis=0)
        _check_separable(group, usual, lines.frequency_hz, expected)
        places = lines.window // self._step
        return _Clock(group, UnevenSpectra(lines.bins, self.layout.quiet, lines.window, places, expected, trend), usual)

    def _segments(self, group: ClockGroup, fit: UnevenSpectra, first: int, stop: int, step: int) -> Iterator[Complex]:
        """Sums of segments `first` … `stop` − 1, each of `step` samples of the grid."""
        for at, data in segments(self._log, group.channels, first, stop, step):
            yield fit.segment(at / self._settings.lines.window, data)

    def blocks(self, _channels: Sequence[str] | None = None) -> Iterator[Spectra]:
        """The spectra of all windows in the recording from its first sample on."""
        hop, log = self._settings.step, self._log
        first = -(-self.first // self._step)
        stop = log.stop // self._step
        windows = [
            clock.fit.windows(self._segments(clock.group, clock.fit, first, stop, self._step), first, hop // self._step)
            for clock in self._clocks
        ]
        # The first window that is complete, and ends at a hop.
        begin = -(-(first * self._step + self.layout.window) // hop) * hop
        values = _Values(log, [channel.name for channel in self.layout.values])
        held: list[tuple[UnevenWindow, ...]] = []
        for together in zip(*windows):
            held.append(together)
            if len(held) == _ROWS:
                yield self._block(held, begin, values)
                begin, held = begin + len(held) * hop, []
        if held:
            yield self._block(held, begin, values)

    def _block(self, held: list[tuple[UnevenWindow, ...]], end: int, values: _Values) -> Spectra:
        """Spectra whose first window ends before sample `end`."""
        layout, log, settings = self.layout, self._log, self._settings
        sums = np.array([np.concatenate([one.sums for one in together]) for together in held])
        thin = np.array(
            [
                any(np.any(one.inflation > _THIN * clock.usual) for one, clock in zip(together, self._clocks))
                for together in held
            ]
        )
        sums = np.moveaxis(sums[:, self._rows], 0, 1)
        stops = end + layout.hop * np.arange(len(held))
        left = np.searchsorted(self.left_out, stops) > np.searchsorted(self.left_out, stops - layout.window)
        state = np.where(thin, NOT_WHOLE, 0) | np.where(left, LEFT_OUT, 0)
        rows = dict(zip((one.name for one in layout.signals), rms(sums, layout)))
        centre_s = (stops - 1 - (layout.window - 1) / 2) / settings.lines.rate_hz
        rows |= values.at(np.asarray(centre_s))
        return Spectra(
            np.array([rows[one.name] for one in layout.channels]),
            layout.channels,
            settings.lines.rate_hz,
            start=end - layout.hop,
            origin_s=log.origin_s,
            layout=layout,
            sums=sums,
            state=state.astype(np.uint32),
            place=end % layout.window,
        )


class _Values:
    """Interpolated values of channels at increasing times."""

    def __init__(self, log: UnevenLog, names: Sequence[str]) -> None:
        self._clocks = [
            (group.channels, Resampler(log.pieces(group.channels), group.stamps.step_s)) for group in log.clocks(names)
        ]

    def at(self, time_s: Floats) -> dict[str, Floats]:
        """Each channel's values, seconds from sample 0 of the grid."""
        return {name: row for names, one in self._clocks for name, row in zip(names, one.at(time_s))}


def _check_separable(group: ClockGroup, usual: Floats, frequency_hz: Floats, expected: float) -> None:
    """SignalError if the times of the samples do not determine the amplitudes at all lines."""
    worst = usual.max(axis=0)
    if np.all(worst <= _INSEPARABLE):
        return
    lines = frequency_hz[~(worst <= _INSEPARABLE)]
    named = ", ".join(f"{f:g}" for f in lines[:_NAMED]) + (" …" if len(lines) > _NAMED else "")
    name, rate_hz = group.channels[0], group.stamps.rate_hz
    raise SignalError(
        "lines-inseparable",
        f"the samples of {name!r} ({rate_hz:.4g} per second, {expected:.4g} in a window) do not separate the lines at "
        f"{named} Hz from the others",
        f"choose fewer lines, or lines below {rate_hz / 2:.4g} Hz, or a longer window",
        channel=name,
        rate_hz=rate_hz,
        frequencies_hz=[float(f) for f in lines],
    )
