"""Lines of the time in the torque of strokes: the same frequency at every speed, such as the hum of the mains."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import log_sum_exceeded
from livebode.dataclass import dataclass
from livebode.motion import Stroke

_WINDOWS_MIN = 8
_SAMPLES_MIN = 64
_AROUND = 16  # bins on each side, whose median is the noise
_LOWEST = 8  # bins: below, the friction's error is not noise
_APART = 4.0  # bins by which an order differs between two groups of strokes
_FALSE = 1e-3  # probability of any false line
_OVERLAP = 1.06  # windows that overlap by a half count as so many times fewer (Hann)


@dataclass(frozen=True)
class TimeLine:
    """A line of constant frequency: frequency in Hz, and amplitude (peak) in the unit of the torque."""

    frequency_hz: float
    amplitude: float


def time_lines(strokes: Sequence[Stroke], highest_hz: float, orders: Sequence[float] = ()) -> list[TimeLine]:
    """Lines of the first signal of strokes that are there in slow and in fast strokes alike.

    An order is at another frequency at another speed. So the strokes are divided by their speed, and a frequency whose
    power is above the noise in each group is a line of the time. The noise is the larger median of the bins on both
    sides; the sum of power over noise is Gamma distributed. By chance, a recording has a line with a probability of at
    most 0.1 %. Empty if the speeds differ too little to tell a line from an order, or the strokes are too short.

    Parameters
    ----------
    strokes
        Torque without the orders that are known.
    highest_hz
        Highest frequency that is searched.
    orders
        Cycles of known orders in one turn of the motor. Where one meets a frequency, the window does not count:
        what is left of order 24 at one speed is at the frequency of order 12 at twice that speed.

    Notes
    -----
    Power of an unknown order at the slow speeds and of another at the fast ones, at the same frequency, is found as a
    line.
    """
    groups = _by_speed(strokes)
    window = _window(groups)
    if len(groups) < 2 or window < _SAMPLES_MIN:
        return []
    rate_hz = strokes[0].rate_hz
    frequency_hz = np.arange(window // 2 + 1) * rate_hz / window
    use = (np.arange(frequency_hz.size) >= _LOWEST) & (frequency_hz < highest_hz)
    # Where the groups' speeds differ by less, an order could be at one frequency in both.
    speeds = [np.mean([_turns_per_s(stroke) for stroke in group]) for group in groups]
    use &= frequency_hz * (speeds[1] / speeds[0] - 1) > _APART * rate_hz / window
    both = [_ratios(group, window, orders) for group in groups]
    if not use.any() or min(len(ratio) for ratio, _ in both) < _WINDOWS_MIN // 2:
        return []
    limit = np.log(_FALSE / np.count_nonzero(use)) / 2  # each group alone has the root of the probability
    for ratio, _ in both:
        count = np.isfinite(ratio).sum(axis=0)
        use &= count >= _WINDOWS_MIN // 2
        chance = log_sum_exceeded(np.maximum(count, 2) / _OVERLAP, np.nansum(ratio, axis=0) / _OVERLAP)
        use &= chance < limit
    ratio, power = (np.concatenate([part[i] for part in both]) for i in (0, 1))
    mean = np.nansum(ratio, axis=0) / np.maximum(np.isfinite(ratio).sum(axis=0), 1)
    above = np.maximum(power * (1 - 1 / np.maximum(mean, 1.0)), 0.0).mean(axis=0)
    return [TimeLine(*_peak(k, mean, above, rate_hz, window)) for k in _peaks(mean, use)]


def _turns_per_s(stroke: Stroke) -> float:
    return abs(float(stroke.angle[-1] - stroke.angle[0])) * stroke.rate_hz / (2 * np.pi * (stroke.angle.size - 1))


def _by_speed(strokes: Sequence[Stroke]) -> list[list[Stroke]]:
    """The slow and the fast strokes, divided at the largest step of the speed; one group of strokes at one speed."""
    ordered = sorted(strokes, key=_turns_per_s)
    if len(ordered) < 2:
        return [list(ordered)]
    speed = [_turns_per_s(stroke) for stroke in ordered]
    cut = int(np.argmax([fast / slow for slow, fast in pairwise(speed)])) + 1
    return [ordered[:cut], ordered[cut:]]


def _window(groups: list[list[Stroke]]) -> int:
    """The longest power of two with which each group has enough windows."""
    longest = max((stroke.angle.size for group in groups for stroke in group), default=0)
    window = 1 << max(longest.bit_length() - 1, 0)
    while window >= _SAMPLES_MIN:
        many = [sum(max(2 * stroke.angle.size // window - 1, 0) for stroke in group) for group in groups]
        if min(many) >= _WINDOWS_MIN:
            return window
        window //= 2
    return 0


def _ratios(group: list[Stroke], window: int, orders: Sequence[float]) -> tuple[Floats, Floats]:
    """Power over the noise around, NaN where an order is, and squared amplitude, of each window, (windows, bins)."""
    hann = np.hanning(window + 1)[:-1]
    places = [(stroke, begin) for stroke in group for begin in range(0, stroke.angle.size - window + 1, window // 2)]
    cuts = [stroke.torque[0, begin : begin + window] for stroke, begin in places]
    power = np.array([np.abs(np.fft.rfft((cut - cut.mean()) * hann)) ** 2 for cut in cuts])
    noise = _noise(power.mean(axis=0), len(power))
    ratio = power / np.maximum(noise, np.finfo(float).tiny)
    for row, (stroke, begin) in enumerate(places):
        turned = np.abs(np.diff(stroke.angle[begin : begin + window : window // _SAMPLES_MIN]))
        low, high = (f(turned) / (2 * np.pi) * _SAMPLES_MIN for f in (np.min, np.max))  # turns in a window: bins
        for order in orders:
            ratio[row, max(int(low * order - _APART), 0) : int(high * order + _APART) + 2] = np.nan
    return ratio, power * (2 / hann.sum()) ** 2


def _noise(power: Floats, many: int) -> Floats:
    """Noise beside each bin of a mean of so many windows: the larger median of both sides, for a slope is no line."""
    padded = np.pad(power, _AROUND + 1, mode="symmetric")
    medians = np.median(np.lib.stride_tricks.sliding_window_view(padded, _AROUND), axis=1)
    left, right = medians[: power.size], medians[_AROUND + 3 :][: power.size]
    # Median of a Gamma distribution over its mean (Wilson and Hilferty).
    return np.asarray(np.maximum(left, right) / (1 - 1 / (9 * max(many / _OVERLAP, 1.0))) ** 3)


def _peaks(mean: Floats, use: NDArray[np.bool_]) -> list[int]:
    """Highest bins of those that are used, three bins apart."""
    peaks = list[int]()
    for k in sorted(np.flatnonzero(use), key=lambda k: -mean[k]):
        if all(abs(int(k) - other) > 3 for other in peaks):
            peaks.append(int(k))
    return sorted(peaks)


def _peak(k: int, mean: Floats, above: Floats, rate_hz: float, window: int) -> tuple[float, float]:
    """Frequency by a parabola through the logarithm, and amplitude; the Hann window has 1.5 bins of a tone's power."""
    low, mid, high = np.log(mean[k - 1 : k + 2])
    curve = low - 2 * mid + high
    shift = 0.5 * (low - high) / curve if curve < 0 else 0.0
    amplitude = np.sqrt(above[k - 1 : k + 2].sum() / 1.5)
    return float((k + shift) * rate_hz / window), float(amplitude)
