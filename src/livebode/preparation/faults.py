"""Faults of a sensor that are the same in every period, so that no scatter shows them: spikes and flat parts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from livebode.arrays import Flags, Floats, Integers
from livebode.core import Block, Event, SignalError, step_of
from livebode.dataclass import dataclass
from livebode.estimation import RepeatedSpikes, SensorSpikes, Settings, TurningSpikes
from livebode.excitation import cut, filled
from livebode.language import Message
from livebode.preparation._steady import EXAMINED_SAMPLES_MAX, moves
from livebode.preparation.aligned import AlignedLog

_PERIODS_MIN = 4
_RUN = 3  # equal samples in a row: fewer are by chance
_AROUND = 5.5  # steps around a value
_PILED, _PILED_HIGH = 5.0, 12.0  # times the samples there: at a parabola's top 7
_ABRUPT = 1.5  # step at the end of a run over that at the top of a parabola with such a run
_LEAST, _LEAST_SHARE = 4, 0.01  # samples of a period, and of all, at zero that are no run
_LEVELS = 0.8  # rms over peak: of a sine 0.7, of a binary sequence 1
_LEVELS_MIN = 40  # steps in the range: of fewer, one is often that of many samples
_IN_PERIODS = 0.6  # of the periods have such samples
_HIGH, _OF_LINE = 7.0, 0.3  # robust standard deviations of the mean period beside the lines, and those at a line
_SMALL = 3.5  # robust standard deviations of what is explained by spikes, beside larger ones
_OF_SIGNAL = 1e-5  # smaller spikes change no digit that is shown
_MOST, _MOST_TRIED, _SHARE_MAX = 24, 64, 1 / 50  # samples of a period, and of all: more are no spikes
_ROW_MAX, _LONGER = 4, 0.1  # samples in a row, and what each more has to explain, relative to the first
_MEDIAN, _NOISY, _ABOVE = 1.25, 3.0, 5.0  # noise of a median over a mean's, and what remains over it; spikes over that
_IN_MEAN = 0.3  # of a spike of the median, in the mean: it is in at least half of the periods
_FREE_MIN = 0.25  # of the bins: with fewer beside the lines, a spike cannot be told from the response
_GAUSS_90 = 1.645  # of a Gaussian, |x| in standard deviations that nine of ten samples are below
_NEAR, _HIGH_OF_ONE = 4, 8.0  # samples on each side to compare with, and robust standard deviations of a sample
_SUDDEN = 4.0  # times the median deviation of the samples around: at the top of a parabola 1, of noise 12
_FEW = 0.25  # of the periods: so many are left out as a whole, if one differs


@dataclass(frozen=True)
class FlatPart:
    """A value at which an output stands still.

    Attributes
    ----------
    value
        In the unit of the channel.
    share
        Of the samples.
    run
        Samples in a row, on average.
    limit
        Whether it is the largest or the smallest value.
    """

    value: float
    share: float
    run: float
    limit: bool


class FaultSearch:
    """Finds spikes at the same places of every period, and an output that is cut off or has a dead band.

    Parameters
    ----------
    settings
        Lines and signals.
    first
        Number of the recording's first sample, from which its periods count.
    """

    def __init__(self, settings: Settings, first: int) -> None:
        self._settings, self._first = settings, first
        self.names = list(dict.fromkeys(name for role in settings.roles if (name := settings.channel(role))))
        self.channels = list(dict.fromkeys([*self.names, *([settings.schedule] if settings.schedule else [])]))
        self._parts: list[Floats] = []
        self._count = 0

    def process(self, block: Block) -> None:
        """Add the next samples of `channels`, of the first stretch without a gap."""
        if self._count >= EXAMINED_SAMPLES_MAX or block.start != self._first + self._count:
            return
        self._parts.append(block.rows(self.channels)[:, : EXAMINED_SAMPLES_MAX - self._count])
        self._count += self._parts[-1].shape[1]

    def finish(self, transient: int = 0) -> list[SensorSpikes]:
        """The spikes behind the transient, in periods; SignalError for an output that is cut off or has a dead band."""
        window = self._settings.lines.window
        rows = np.concatenate(self._parts, axis=1)[:, transient * window :] if self._parts else np.zeros((1, 0))
        count = rows.shape[1] // window
        if count < _PERIODS_MIN or not self._settings.periodic:
            return []
        rows = rows[:, : count * window]
        if self._settings.schedule and (moves(rows[-1], window) or _changes_place(rows[-1].reshape(count, window))):
            return []
        output = self.names.index(self._settings.output)
        reference = rows[self.names.index(str(self._settings.channel(self._settings.method.reference)))]
        if not _has_levels(reference) and (flat := flat_part(rows[output], window)):
            raise _flat_error(self._settings.output, flat)
        found: list[SensorSpikes] = []
        for name, x in zip(self.names, rows):
            if name not in self._settings.differenced and np.isfinite(x).any():
                whole = np.isfinite(x).reshape(-1, window).all(axis=1)
                found += self._spikes(name, cut(filled(x), window), whole, self._first + transient * window)
        return found

    def _spikes(self, name: str, blocks: Floats, whole: Flags, first: int) -> list[SensorSpikes]:
        """The spikes of a channel in those of these periods that are whole; the first sample has this number."""
        window = blocks.shape[1]
        together = 2 if len(blocks) >= 2 * _PERIODS_MIN else 1  # a spike at every second period is in half of them
        long = together * window
        excited = np.zeros(long // 2 + 1, dtype=np.bool_)
        excited[together * np.asarray(self._settings.lines.bins)] = True
        used = len(blocks) // together * together
        pairs = blocks[:used].reshape(-1, long)[whole[:used].reshape(-1, together).all(axis=1)]
        found: list[SensorSpikes] = []
        if len(pairs) * together < _PERIODS_MIN:
            return found
        places, sizes = repeated_spikes(pairs, excited)
        if places.size:
            repeated = RepeatedSpikes(name, sizes, (places + first) % long, long)
            found.append(repeated)
            blocks = blocks - repeated.of(first, first + blocks.size).reshape(blocks.shape)
        samples, sizes = turning_spikes(blocks[whole])
        samples = np.flatnonzero(whole)[samples // window] * window + samples % window
        return [*found, TurningSpikes(name, sizes, samples + first)] if samples.size else found


def _changes_place(schedule: Floats) -> bool:
    """Whether the places of the periods differ by more than the machine moves within one, shape (periods, window)."""
    known = schedule[np.isfinite(schedule).all(axis=1)]
    return known.size > 0 and float(np.ptp(known.mean(axis=1))) > float(np.median(np.ptp(known, axis=1)))


def _has_levels(reference: Floats) -> bool:
    """Whether an excitation stands still at its own limits, as a binary sequence, so that the output may do so, too."""
    centred = np.abs(reference - np.nanmedian(reference))
    return float(np.sqrt(np.nanmean(centred**2))) > _LEVELS * float(np.nanquantile(centred, 0.999))


def flat_part(x: Floats, window: int) -> FlatPart | None:
    """The value at which a periodic signal stands still in most of its periods, although it moves up to it.

    A signal with steps has equal samples, too: at the top of a parabola, and where it is slow. Such runs end with a
    small step, and there are others at the values around. Where it is cut off, or has a dead band, neither is the case.
    """
    x = x[np.isfinite(x)]
    periods = x.size // window
    if periods < _PERIODS_MIN or not np.ptp(x):
        return None
    edges = np.concatenate([[0], np.flatnonzero(np.diff(x)) + 1, [x.size]])
    length, begin = np.diff(edges), edges[:-1]
    held = max(float(np.median(length)), 1.0)
    values, which = np.unique(x[begin], return_inverse=True)
    samples = np.bincount(which, weights=length)
    most = int(np.argmax(samples))
    value, runs = float(values[most]), which == most
    limit, step = value in (float(x.min()), float(x.max())), step_of(x[: 8 * window])
    apart = np.abs(values - value)
    beside = float(samples[(apart > 0) & (apart <= _AROUND * step)].sum()) / ((1 if limit else 2) * int(_AROUND))
    if samples[most] <= _PILED * beside or np.unique(begin[runs] // window).size < _IN_PERIODS * periods:
        return None
    run, many = float(length[runs].mean()) / held, samples[most] >= held * max(_LEAST * periods, _LEAST_SHARE * x.size)
    usual = limit or abs(value) <= step  # places of a fault
    if many and usual and np.ptp(x) > _LEVELS_MIN * step > 0 and (samples[most] > _PILED_HIGH * beside or run < _RUN):
        is_flat = True
    elif run < _RUN:
        is_flat = False
    else:
        inner = np.flatnonzero(runs & (length >= _RUN * held) & (begin > 0) & (begin + length < x.size))
        ends = np.concatenate([x[begin[inner] - 1], x[begin[inner] + length[inner]]])
        is_flat = float(np.median(np.abs(ends - value))) > _ABRUPT * step * (1 + 2 / run) ** 2
    return FlatPart(value + 0.0, float(samples[most] / x.size), run * held, limit) if is_flat else None


def repeated_spikes(blocks: Floats, excited: np.ndarray) -> tuple[Integers, Floats]:
    """Places in the period, and sizes, of spikes that are in every period, shape (periods, window).

    The median period without its lines contains of a spike all but the share of the lines. Short rows of samples are
    taken one after the other, each time the one that explains most of what remains, with the sizes of all by least
    squares (orthogonal matching pursuit), until no sample is far from the others.
    """
    window, nothing = blocks.shape[1], (np.zeros(0, dtype=np.int64), np.zeros(0))
    typical = np.median(blocks, axis=0)
    spectrum = np.fft.rfft(typical)
    free = np.ones(spectrum.size, dtype=np.bool_)
    free[: excited.size] = ~excited
    free[0] = False
    if np.count_nonzero(free) < _FREE_MIN * free.size:
        return nothing
    rest = np.fft.irfft(np.where(free, spectrum, 0), window)
    least = _OF_SIGNAL * float(typical.std())
    kernel = np.fft.irfft(free.astype(np.float64), window)
    most, places, sizes, left = min(max(_MOST, round(_SHARE_MAX * window)), _MOST_TRIED), nothing[0], nothing[1], rest
    noise = _MEDIAN * _usual(blocks - typical) * float(np.sqrt(free.mean() / len(blocks)))
    least_found = np.inf
    while True:
        row, size = _row(left, kernel)
        if size <= max(_high(window) * _deviation(left), least):
            break
        least_found = min(least_found, size)
        before, places = places.size, np.union1d(places, row)
        if places.size == before or places.size > most:
            return nothing
        sizes, left = _fitted(rest, places, kernel)
    # What a nonlinear machine distorts has peaks of all sizes, and no noise below them.
    if _deviation(left) > _NOISY * noise and least_found <= _ABOVE * np.abs(left).max():
        return nothing
    large = np.abs(sizes) > max(_SMALL * _deviation(left), least / 10)
    # The median of different machines, or places, has peaks that their mean has not.
    mean = np.fft.irfft(np.where(free, np.fft.rfft(blocks.mean(axis=0)), 0), window)
    large &= np.sign(sizes) * _fitted(mean, places, kernel)[0] > _IN_MEAN * np.abs(sizes)
    return (places[large], _fitted(rest, places[large], kernel)[0]) if large.any() else nothing


def _row(left: Floats, kernel: Floats) -> tuple[Integers, float]:
    """The row of samples that explains most of what remains, a longer one only if it explains clearly more; its size.

    The size is the root of what it explains of the sum of squares.
    """
    found = []
    for length in range(1, _ROW_MAX + 1):
        within = np.lib.stride_tricks.sliding_window_view(np.concatenate([left, left[: length - 1]]), length)
        alike = kernel[np.subtract.outer(np.arange(length), np.arange(length))]
        powers = np.einsum("ij,jk,ik->i", within, np.linalg.pinv(alike), within)
        first = int(np.argmax(powers))
        found.append((float(powers[first]) / (1 + _LONGER * (length - 1)), first, length))
    explained, first, length = max(found)
    return (first + np.arange(length)) % left.size, float(np.sqrt(max(explained, 0.0)))


def _fitted(rest: Floats, places: Integers, kernel: Floats) -> tuple[Floats, Floats]:
    """Sizes of spikes at these places by least squares, and what remains."""
    sizes = np.asarray(np.linalg.lstsq(kernel[np.subtract.outer(places, places)], rest[places])[0], dtype=np.float64)
    impulses = np.zeros(rest.size)
    impulses[places] = sizes
    return sizes, rest - np.fft.irfft(np.fft.rfft(impulses) * np.fft.rfft(kernel), rest.size)


def _high(window: int) -> float:
    """Robust standard deviations above which a sample of the mean period is a spike that a line would show."""
    return max(_HIGH, _OF_LINE * float(np.sqrt(window)))


def turning_spikes(blocks: Floats) -> tuple[Integers, Floats]:
    """Samples, and sizes, of spikes that are in many of the periods, each at another place; shape (periods, window)."""
    apart = (blocks - np.median(blocks, axis=0)).ravel()
    near = np.lib.stride_tricks.sliding_window_view(np.pad(apart, _NEAR, mode="edge"), 2 * _NEAR + 1)
    apart = apart - np.median(near, axis=1)
    deviation = _usual(apart)
    samples = np.flatnonzero(np.abs(apart) > _HIGH_OF_ONE * deviation)
    # A slow signal differs from its median at its tops only, where its neighbours do, too.
    beside = near[samples] - np.median(near[samples], axis=1, keepdims=True)
    samples = samples[np.abs(apart[samples]) > _SUDDEN * np.median(np.abs(beside), axis=1)]
    periods = np.unique(samples // blocks.shape[1]).size
    if deviation == 0 or periods <= _FEW * len(blocks) or samples.size > _SHARE_MAX * apart.size:
        return np.zeros(0, dtype=np.int64), np.zeros(0)
    return samples, apart[samples]


def _usual(x: Floats) -> float:
    """Standard deviation without the largest tenth; with wide steps, most of the values are 0."""
    return float(np.quantile(np.abs(x), 0.9)) / _GAUSS_90


def _deviation(x: Floats) -> float:
    """Robust standard deviation."""
    return float(1.4826 * np.median(np.abs(x)))


def _flat_error(name: str, flat: FlatPart) -> SignalError:
    shown = (
        f"{name!r} stands still at {flat.value:.6g} in {100 * flat.share:.2g} % of the samples, {flat.run:.3g} in a row"
    )
    facts = {"channel": name, "value": flat.value, "share": flat.share, "run": flat.run}
    if flat.limit:
        return SignalError(
            "output-cut-off",
            f"{shown}, which is its {'largest' if flat.value > 0 else 'smallest'} value: the sensor or its channel is "
            "at a limit, and every response is wrong",
            "reduce the excitation, or increase the range of the channel",
            **facts,
        )
    return SignalError(
        "output-dead-band",
        f"{shown}, between values that move: the sensor or the machine has a dead band, and every response is wrong",
        "add an offset or a slow motion that keeps the output outside of it, or increase the excitation",
        **facts,
    )


def spikes_event(found: Sequence[SensorSpikes], source: AlignedLog, settings: Settings) -> Event:
    """One Event for the spikes that are subtracted."""
    units = {channel.name: channel.unit for channel in source.channels}
    spikes = Message.conjunction(
        _sentence(one, f" {unit}" if (unit := units.get(one.channel)) else "") for one in found
    )
    message = Message("{spikes}: they are subtracted", spikes=spikes)
    facts = [{"channel": one.channel, "samples": one.sizes.size, "size": one.largest} for one in found]
    return Event("spikes-subtracted", source.first, source.first / settings.lines.rate_hz, message, {"spikes": facts})


def _sentence(spikes: SensorSpikes, unit: str) -> Message:
    name, count, size = repr(spikes.channel), spikes.sizes.size, spikes.largest
    if isinstance(spikes, RepeatedSpikes):
        return Message(
            "{channel} has spikes of up to {size:.3g}{unit} in {count} samples, the same in every {window} samples",
            channel=name,
            count=count,
            size=size,
            unit=unit,
            window=spikes.window,
        )
    return Message(
        "{channel} has spikes of up to {size:.3g}{unit} in {count} samples of many periods",
        channel=name,
        count=count,
        size=size,
        unit=unit,
    )
