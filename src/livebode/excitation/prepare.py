"""Preparation of a recording before the search for its period."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Floats
from livebode.core import Block, SignalError, UsageError, fast_length

# A spike is clipped above four times the 99.5 % quantile of the samples. Periodic excitations have crest factors up to
# about 5, so their own peaks are not clipped, and a few spikes are less than 0.5 % of the samples.
_CLIP_QUANTILE, _CLIP_FACTOR = 0.995, 4.0
# Bands of a sixth of an octave follow the slope of a trajectory's spectrum; below four bins a median is meaningless.
_BAND_RATIO, _BAND_BINS = 2 ** (1 / 6), 4
# Content 60 dB below the mean power of the spectrum is rounding; amplified to the level of the lines, it would
# dominate the result. In power.
_WHITEN_FLOOR = 1e-6
# Noise passes ten times its median power in one bin of a thousand (exponential distribution: 2^-10).
_PROMINENT = 10.0
_STRAIGHT = 1e-12  # of the largest sample: the rounding of a ramp in double precision


def checked(samples: ArrayLike | Block, name: str) -> Floats:
    """The recording as float64, shape (samples,), NaN where it is not finite.

    Raises
    ------
    LivebodeError
        If it is not one-dimensional, empty, without a finite sample, or constant.
    """
    if isinstance(samples, Block):
        names = ", ".join(samples.names)
        raise UsageError(
            "wrong-shape",
            f"the {name} is a Block with the channels {names}",
            f"give the samples of one: block[{samples.names[0]!r}]",
            argument=name,
        )
    try:
        x = np.array(samples, dtype=np.float64)
    except (TypeError, ValueError):
        raise UsageError(
            "unreadable", f"the {name} cannot be read as numbers", "give one number for each sample", argument=name
        ) from None
    if x.ndim != 1:
        raise UsageError(
            "wrong-shape",
            f"the {name} has shape {x.shape}",
            "give one channel, shape (samples,)",
            argument=name,
            shape=list(x.shape),
        )
    if not x.size:
        raise SignalError("empty", f"the {name} is empty", "record at least two periods", role=name)
    x[~np.isfinite(x)] = np.nan
    known = x[np.isfinite(x)]
    if not known.size:
        raise SignalError(
            "channel-empty",
            f"the {name} has no finite sample among {x.size}",
            "choose another channel",
            role=name,
            samples=int(x.size),
        )
    if np.ptp(known) == 0:
        raise SignalError(
            "channel-constant",
            f"the {name} is constant at {known[0]:g}",
            "choose the channel with the signal; for hum in a recording without excitation, inspect it with lines",
            role=name,
            value=float(known[0]),
        )
    # A time column is a ramp except for rounding, and rounding repeats.
    n = np.flatnonzero(np.isfinite(x))
    deviation = known - (known[0] + (known[-1] - known[0]) * (n - n[0]) / max(n[-1] - n[0], 1))
    if np.ptp(deviation) <= _STRAIGHT * np.max(np.abs(known)):
        raise SignalError(
            "no-excitation",
            f"the {name} is a straight line",
            "choose the channel with the signal",
            role=name,
        )
    return x


def filled(x: Floats) -> Floats:
    """NaN replaced by a straight line between the finite neighbours, shape (samples,)."""
    known = np.isfinite(x)
    if known.all():
        return x
    return np.asarray(np.interp(np.arange(x.size), np.flatnonzero(known), x[known]))


def clipped(x: Floats) -> Floats:
    """The signal about its median, with spikes cut off, shape (samples,)."""
    centred = x - np.median(x)
    limit = _CLIP_FACTOR * float(np.quantile(np.abs(centred), _CLIP_QUANTILE))
    return np.clip(centred, -limit, limit) if limit > 0 else centred


def whitened(x: Floats) -> tuple[Floats, Floats]:
    """The signal filtered so that its background has a flat spectrum, and only the part above the background.

    Both have shape (samples,). A trajectory and its drift are far larger than the excitation at low frequencies and
    would dominate every comparison of one period with the next. The background is the median of the periodogram (Hann
    window) in bands of a sixth of an octave, so lines narrower than their band remain above it, with four periods or
    more. The filter is time-invariant: periodic components remain periodic. The ends of the recording are joined by
    subtracting the line between them, because the filter is circular.
    """
    level = _joined(x)
    size = fast_length(x.size)
    power = np.abs(np.fft.rfft(level * np.hanning(x.size), size)) ** 2
    background = _band_medians(power)
    background += _WHITEN_FLOOR * float(power[1:].mean())
    spectrum = np.fft.rfft(level, size)
    spectrum[0] = 0
    spectrum[1:] /= np.sqrt(background[1:])
    flat = np.fft.irfft(spectrum, size)[: x.size]
    spectrum[power < _PROMINENT * background] = 0
    return flat, np.fft.irfft(spectrum, size)[: x.size]


def _joined(x: Floats) -> Floats:
    # The mean of some samples at each end, so that one noisy sample does not tilt the whole recording.
    some = max(1, x.size // 100)
    slope = (x[-some:].mean() - x[:some].mean()) / (x.size - some)
    level = x - slope * np.arange(x.size)
    return np.asarray(level - level.mean())


def _band_medians(power: Floats) -> Floats:
    edges = [1]
    while edges[-1] < power.size:
        edges.append(max(edges[-1] + _BAND_BINS, int(edges[-1] * _BAND_RATIO)))
    edges[-1] = power.size
    edges = sorted(set(edges))
    median = [float(np.median(power[a:b])) for a, b in pairwise(edges)]
    centre = [(a + b - 1) / 2 for a, b in pairwise(edges)]
    smallest = np.finfo(np.float64).tiny
    return np.exp(np.interp(np.arange(power.size), centre, np.log(np.maximum(median, smallest))))
