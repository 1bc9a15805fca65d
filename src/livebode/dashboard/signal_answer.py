"""Answer to a page that asks for raw signals or their spectrum.

A u32 with the length of a JSON object, the object, spaces up to a multiple of 4 bytes, then for each channel its arrays
of `points` values: over time u32 sample numbers from the first one and f32 values; of a spectrum f32 frequencies in Hz,
f32 largest and f32 smallest amplitudes of a column of the plot. Numbers are little endian; unknown values are NaN.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable
from dataclasses import asdict
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from livebode.core import Block, Channel, Lines
from livebode.dashboard.signal_tap import WINDOWS
from livebode.dataclass import dataclass
from livebode.records import to_json

HANN_BANDWIDTH_BINS = 1.5
"""Equivalent noise bandwidth of the Hann window."""


@dataclass(frozen=True, eq=False)
class AmplitudeSpectrum:
    """Amplitudes of the sines in a signal.

    Attributes
    ----------
    amplitude
        Peak value of a sine at each bin, in the unit of the signal, shape (samples // 2 + 1,).
    samples
        Number of samples, a whole number of windows.
    rate_hz
        Samples per second.
    """

    amplitude: NDArray[np.float64]
    samples: int
    rate_hz: float

    @property
    def frequency_hz(self) -> NDArray[np.float64]:
        """Frequency of each bin."""
        return np.asarray(np.arange(len(self.amplitude)) * (self.rate_hz / self.samples), dtype=np.float64)

    @property
    def resolution_hz(self) -> float:
        """Equivalent noise bandwidth: 1.5 bins."""
        return HANN_BANDWIDTH_BINS * self.rate_hz / self.samples

    def at(self, bins: NDArray[np.int64], window: int) -> NDArray[np.float64]:
        """Amplitudes at bins of the run's window."""
        return self.amplitude[bins * (self.samples // window)]


def amplitude_spectrum(x: NDArray[np.float64], rate_hz: float, window: int) -> AmplitudeSpectrum | None:
    """Amplitude spectrum of the newest samples without a gap, with a Hann window; None if they are too few.

    The mean is removed. With the periodic Hann window w of M samples, M a multiple of `window`, the amplitude is
    2·|Σ w(n)·x(n)·e^(−j2πkn/M)| / Σ w(n), half of that at 0 and at rate/2. A sine at a bin has its exact amplitude
    there and half of it at both neighbours; between two bins it appears up to 15 % (1.42 dB) too small. Noise of
    variance v has the mean square amplitude 4·v·1.5/M, so its level depends on M.

    Parameters
    ----------
    x
        Samples, shape (samples,), NaN where one is missing.
    rate_hz
        Samples per second.
    window
        Window of the run, samples. Two of them are required, so that neighbouring lines do not overlap.

    Examples
    --------
    >>> t = np.arange(4000) / 4000
    >>> found = amplitude_spectrum(5.0 + 0.3 * np.cos(2 * np.pi * 50 * t), 4000, 400)
    >>> found.samples, round(float(found.amplitude[50]), 6), found.resolution_hz
    (4000, 0.3, 1.5)
    """
    broken = np.flatnonzero(~np.isfinite(x))
    edges = np.concatenate([[-1], broken, [len(x)]])
    whole = (np.diff(edges) - 1) // window * window
    enough = np.flatnonzero(whole >= WINDOWS * window)
    if not enough.size:
        return None
    longest = int(enough[-1])
    stop, samples = int(edges[longest + 1]), int(whole[longest])
    piece = x[stop - samples : stop]
    weight = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(samples) / samples)
    amplitude = 2 * np.abs(np.fft.rfft((piece - piece.mean()) * weight)) / weight.sum()
    amplitude[0] /= 2
    if samples % 2 == 0:
        amplitude[-1] /= 2
    return AmplitudeSpectrum(amplitude, samples, rate_hz)


POINTS_MAX = 1500
COLUMNS = POINTS_MAX // 3
_LEVELS_MIN = 16  # a signal with fewer values is quantised: its highest value is no limit
_FLAT_MIN = 3

Indices = NDArray[np.int64]


def extremes(x: NDArray[np.float64]) -> Indices:
    """Indices of at most 1,500 samples, in order.

    All of them, or of each of at most 500 columns the lowest and the highest value and the first that is not finite.

    >>> extremes(np.array([1.0, 2.0])).tolist()
    [0, 1]
    """
    n = len(x)
    if n <= POINTS_MAX:
        return np.arange(n)
    width = -(-n // COLUMNS)
    used = -(-n // width)
    cells = np.append(x, np.full(used * width - n, x[-1])).reshape(used, width)
    first = np.arange(used) * width
    known = np.isfinite(cells)
    if known.all():
        places = [cells.argmin(axis=1), cells.argmax(axis=1)]
    else:
        places = [
            np.where(known, cells, np.inf).argmin(axis=1),
            np.where(known, cells, -np.inf).argmax(axis=1),
            known.argmin(axis=1),
        ]
    return np.unique(np.minimum(np.concatenate([first + place for place in places]), n - 1))


def columns_of(amplitude: NDArray[np.float64], *, logarithmic: bool) -> tuple[Indices, NDArray[np.float64]]:
    """Index of the largest amplitude in each of at most 1,500 columns, and the smallest amplitude there.

    The columns have equal widths in frequency, or, from bin 1, in the logarithm of the frequency.
    """
    bins = np.arange(1, len(amplitude))
    if len(bins) <= POINTS_MAX:
        return bins, amplitude[bins]
    place = np.log(bins) if logarithmic else bins.astype(float)
    column = ((place - place[0]) / (place[-1] - place[0]) * (POINTS_MAX - 1)).astype(np.int64)
    starts = np.flatnonzero(np.diff(column, prepend=-1))
    inner = amplitude[bins]
    high = np.maximum.reduceat(inner, starts)
    largest = np.flatnonzero(inner == np.repeat(high, np.diff(starts, append=len(bins))))
    _, first = np.unique(column[largest], return_index=True)
    return bins[largest[first]], np.minimum.reduceat(inner, starts)


@dataclass(frozen=True)
class Remark:
    """What is conspicuous in a signal.

    Attributes
    ----------
    missing
        Samples that are missing or not a number.
    constant
        Whether all others are equal.
    limit, limited
        Highest or lowest value at which the signal is cut off, and the number of samples there; None and 0 without.
    """

    missing: int
    constant: bool
    limit: float | None
    limited: int


def remark_of(x: NDArray[np.float64]) -> Remark:
    """What a person should know about these samples.

    A signal counts as cut off if it has its highest (lowest) value in at least 3 samples in a row, and arrives there
    in steps of more than twice its smallest one: a quantised signal at its turning point arrives in the smallest step.

    >>> remark_of(np.minimum(np.sin(np.arange(400) / 10), 0.9)).limit
    0.9
    """
    finite = np.isfinite(x)
    known = x if finite.all() else x[finite]
    missing = len(x) - len(known)
    if not known.size:
        return Remark(missing, constant=False, limit=None, limited=0)
    low, high = float(known.min()), float(known.max())
    if low == high:
        return Remark(missing, constant=len(known) > 1, limit=None, limited=0)
    counts = {value: _cut_off(known, value) for value in (high, low)}
    limit = max(counts, key=lambda value: counts[value])
    limited = counts[limit]
    if limited and len(np.unique(known)) <= _LEVELS_MIN:
        limited = 0
    return Remark(missing, constant=False, limit=limit if limited else None, limited=limited)


def _cut_off(x: NDArray[np.float64], value: float) -> int:
    """Samples in flat pieces at this value whose edges are steep."""
    index = np.flatnonzero(x == value)
    if len(index) < _FLAT_MIN:
        return 0
    breaks = np.flatnonzero(np.diff(index) > 1)
    starts, stops = index[np.append(0, breaks + 1)], index[np.append(breaks, -1)] + 1
    flat = stops - starts >= _FLAT_MIN
    starts, stops = starts[flat], stops[flat]
    if not starts.size:
        return 0
    step = np.abs(np.diff(x))
    smallest = step[step > 0].min()
    before, after = np.abs(x[np.maximum(starts - 1, 0)] - value), np.abs(x[np.minimum(stops, len(x) - 1)] - value)
    steep = np.maximum(before, after) > 2 * smallest
    return int((stops - starts)[steep].sum())


Picture = Literal["time", "linear", "log"]
"""Over time, or a spectrum over a linear or logarithmic frequency axis."""
WhyNot = Literal["collecting", "spectra", "unrecorded", "outside"]
"""No sample has arrived yet; the source sends spectra; samples are not recorded; not those of the requested time."""
_Parts = list[NDArray[Any]]


def why_not(reason: WhyNot) -> bytes:
    """The answer without signals."""
    return _packed({"why_not": reason}, [])


def answer(block: Block, lines: Lines, picture: Picture) -> bytes:
    """The answer with all channels of these samples."""
    made = [_channel(channel, x, lines, picture) for channel, x in zip(block.channels, block.data)]
    head = {
        "why_not": "",
        "rate_hz": block.rate_hz,
        "from_s": block.origin_s + block.start / block.rate_hz,
        "to_s": block.origin_s + block.stop / block.rate_hz,
        "samples": len(block),
        "lines_hz": lines.frequency_hz.tolist(),
        "detection_hz": (np.array(lines.quiet) * lines.resolution_hz).tolist(),
        "channels": [about for about, _ in made],
    }
    return _packed(head, (array for _, arrays in made for array in arrays))


def _channel(channel: Channel, x: NDArray[np.float64], lines: Lines, picture: Picture) -> tuple[dict[str, Any], _Parts]:
    about: dict[str, Any] = {
        "name": channel.name,
        "unit": channel.unit,
        "source_unit": channel.source_unit,
        "factor": channel.factor,
        **asdict(remark_of(x)),
    }
    if picture == "time":
        points = extremes(x)
        return about | {"points": len(points)}, [points.astype("<u4"), x[points].astype("<f4")]
    spectrum = amplitude_spectrum(x, lines.rate_hz, lines.window)
    if spectrum is None:
        return about | {"points": 0, "seconds": 0.0, "resolution_hz": None}, []
    points, low = columns_of(spectrum.amplitude, logarithmic=picture == "log")
    about |= {
        "points": len(points),
        "seconds": spectrum.samples / spectrum.rate_hz,
        "resolution_hz": spectrum.resolution_hz,
        "lines": spectrum.at(np.array(lines.bins), lines.window).tolist(),
        "detection": spectrum.at(np.array(lines.quiet, dtype=np.int64), lines.window).tolist(),
    }
    return about, [v.astype("<f4") for v in (spectrum.frequency_hz[points], spectrum.amplitude[points], low)]


def _packed(head: dict[str, Any], arrays: Iterable[NDArray[Any]]) -> bytes:
    text = to_json(head).encode()
    text += b" " * (-len(text) % 4)
    return b"".join([struct.pack("<I", len(text)), text, *(array.tobytes() for array in arrays)])
