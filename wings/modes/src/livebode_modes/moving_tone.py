"""A tone whose frequency moves, such as a sweep or a rotation that speeds up: it follows one line over time."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats
from livebode.core import needing
from livebode.dataclass import dataclass

with needing("SciPy", "analysis", "a run from the outputs alone"):
    import scipy  # its parts are loaded when they are first used

SHARE_MIN = 0.7
"""Least share of the power in the band that the tone has in a segment."""
_DIVISIONS = 4, 2  # a segment is this part of the window; the longer ones show slower tones
_MOVED_MIN = 3.0  # resolutions of a segment over the window: a mode stays
_OFF_MAX = 0.75  # resolutions from the line
_AGREEING_MIN = 0.7  # share of the segments
_TURNS_MAX = 16.0  # largest slope, in resolutions over a segment
_TURN_STEP = 1.0


@dataclass(frozen=True)
class MovingTone:
    """A line of frequency over time, at the begin and the end of a window."""

    from_hz: float
    to_hz: float


def moving_tone(x: Floats, rate_hz: float, band_hz: tuple[float, float]) -> MovingTone | None:
    """The moving tone that has most of the power in a band, if there is one.

    The signal is multiplied by chirps of many slopes. One of them makes a tone that moves steadily a line with all of
    the power, in every segment of the window, at frequencies that move by that slope. The power of a mode under noise
    is spread over its width, and its frequency does not move.

    Parameters
    ----------
    x
        Samples of a window.

    Examples
    --------
    >>> t = np.arange(1000) / 250
    >>> moving_tone(np.sin(2 * np.pi * (50 + t) * t), 250.0, (40.0, 100.0))
    MovingTone(from_hz=50.0, to_hz=58.0)
    """
    for divisions in _DIVISIONS:
        length = x.size // divisions
        starts = np.linspace(0, x.size - length, 2 * divisions - 1).astype(int)
        found = np.array([_strongest(x[start : start + length], rate_hz, band_hz) for start in starts])
        resolution_hz = rate_hz / length
        line = _line((starts + length / 2) / rate_hz, found, resolution_hz)
        if line is not None and abs(line[1]) * x.size / rate_hz > _MOVED_MIN * resolution_hz:
            ends = (line[0], line[0] + line[1] * x.size / rate_hz)
            return MovingTone(*(float(round(end, 3)) for end in ends))
    return None


def _strongest(x: Floats, rate_hz: float, band_hz: tuple[float, float]) -> tuple[float, float, float]:
    """Frequency at the centre and slope of the strongest chirp, and its share of the power in the band."""
    t = (np.arange(x.size) - (x.size - 1) / 2) / rate_hz
    weights = scipy.signal.windows.hann(x.size)
    slopes = np.arange(-_TURNS_MAX, _TURNS_MAX + _TURN_STEP / 2, _TURN_STEP) * (rate_hz / x.size) ** 2
    size = 2 * scipy.fft.next_fast_len(x.size)
    f = np.fft.fftfreq(size, 1 / rate_hz)
    inside = (band_hz[0] <= f) & (f <= band_hz[1])
    turned = weights * x * np.exp(-1j * np.pi * slopes[:, np.newaxis] * t**2)
    power = np.abs(scipy.fft.fft(turned, size, axis=1)[:, inside]) ** 2
    plain = power[slopes.size // 2].sum() / size * np.sum(weights) ** 2 / np.sum(weights**2)
    row, column = np.unravel_index(int(np.argmax(power)), power.shape)
    share = power[row, column] / plain if plain > 0 else 0.0
    return float(f[inside][column]), float(slopes[row]), float(share)


def _line(time_s: Floats, found: Floats, resolution_hz: float) -> tuple[float, float] | None:
    """Frequency at 0 and slope of the line that most segments agree on; None if there is none."""
    f, slopes, shares = found.T
    strong = shares >= SHARE_MIN
    if np.mean(strong) < _AGREEING_MIN:
        return None
    middle_s, slope = time_s.mean(), float(np.median(slopes[strong]))
    for _ in range(3):
        moved = f - slope * (time_s - middle_s)
        slope += float(np.polyfit(time_s[strong], moved[strong], 1)[0])
    centre_hz = float(np.median((f - slope * (time_s - middle_s))[strong]))
    off_hz = np.abs(f - centre_hz - slope * (time_s - middle_s))
    agrees = strong & (off_hz <= _OFF_MAX * resolution_hz)
    agrees &= np.abs(slopes - slope) <= 2 * _TURN_STEP * resolution_hz**2
    return (centre_hz - slope * middle_s, slope) if np.mean(agrees) >= _AGREEING_MIN else None
