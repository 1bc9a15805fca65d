"""Hum of the mains: lines that it may disturb, and its frequencies and amplitudes without excitation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from math import gcd
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import MAINS_HZ, Lines, SignalError, Stage, StatefulBase
from livebode.dataclass import dataclass

_ON_BIN = 0.1  # bins: a tone this close to a bin has nearly all its power there
HARMONICS = 10
_MAINS_BESIDE = np.array([-4, -3, -2, -1, 1, 2, 3, 4])
_CHANCE = 1e-8  # of noise alone to be taken for a tone: (1 + r/n)^-n for a power of r times the mean of n neighbours

_MATTERS = 1e-8
"""Share of the strongest line's power: hum below a ten-thousandth of the response, and rounding, do not matter."""


class Mains:
    """Which lines are at multiples of a mains frequency, and whether the mains is seen at other multiples of it.

    A tone on a line cannot be separated from the response at that line. It is detected by harmonics on bins without
    excitation, or in a period without excitation. A permanent tone at one line only cannot be detected in a periodic
    recording.

    Attributes
    ----------
    lines
        Which lines are at a multiple of each mains frequency, shape (frequencies, lines).
    bins
        The bins whose power is needed, ascending; empty where no line is at a multiple.
    """

    def __init__(self, lines: Lines) -> None:
        bins, highest = np.asarray(lines.bins), (lines.window - 1) // 2
        self.lines = np.zeros((len(MAINS_HZ), len(bins)), dtype=np.bool_)
        free = []
        for i, mains_hz in enumerate(MAINS_HZ):
            self.lines[i] = np.isin(bins, _on_bins(mains_hz, lines, highest))
            tones = np.setdiff1d(_on_bins(mains_hz, lines, HARMONICS), bins)
            free.append(tones if self.lines[i].any() else tones[:0])
        self._any = np.asarray(self.lines.any(axis=0))
        # Distortion is at multiples of the lines' common divisor, and of odd lines at odd or at even ones alone:
        # at these distances it is like that at the harmonic.
        distances = _MAINS_BESIDE * int(np.lcm(2, gcd(*lines.bins)))
        barred = np.concatenate([bins, *free])
        self.free = [Neighbours(tones, distances, barred, highest) for tones in free]
        barred = np.concatenate(free)
        self.excited = Neighbours(bins if self._any.any() else bins[:0], 2 * _MAINS_BESIDE, barred, highest)
        groups = [*self.free, self.excited]
        self.bins = np.unique(np.concatenate([group.bins for group in groups]))
        for group in groups:
            group.place_in(self.bins)

    @property
    def any(self) -> bool:
        return bool(self._any.any())

    def seen(self, output: Floats) -> NDArray[np.bool_]:
        """Lines that may contain hum, (rows, lines), by the power of the mean output at `bins`, (rows, bins)."""
        if not self.any:
            return np.zeros((len(output), self._any.size), dtype=np.bool_)
        least = _MATTERS * output[:, self.excited.tones].max(axis=1, keepdims=True)
        stands_out = [(group.stand_out(output) & (output[:, group.tones] > least)).any(axis=1) for group in self.free]
        return np.asarray((self.lines & np.array(stands_out).T[:, :, np.newaxis]).any(axis=1))

    def alone(self, output: Floats) -> tuple[Floats, NDArray[np.bool_]]:
        """In a period without excitation: the power at each line, and whether it is that of a tone there.

        `output` is the power at `bins`; shapes (lines,).
        """
        if not self.any:
            return np.zeros(self._any.size), self._any
        return output[self.excited.tones], self._any & self.excited.stand_out(output)


@lru_cache(maxsize=64)
def mains_of(lines: Lines) -> Mains:
    """The Mains of these lines; several trackers of the same lines have the same one."""
    return Mains(lines)


class Neighbours:
    """Bins at which a tone may be, and the neighbours with which each is compared."""

    def __init__(
        self, tones: NDArray[np.int64], distances: NDArray[np.int64], barred: NDArray[np.int64], highest: int
    ) -> None:
        beside = tones[:, np.newaxis] + distances
        self.usable = (beside > 0) & (beside <= highest) & ~np.isin(beside, barred)
        self.tones, self.beside = tones, beside.clip(0, highest)
        count = self.usable.sum(axis=1)
        self.known = np.maximum(count, 1).astype(np.float64)
        self.enough = count >= distances.size // 2
        self.times = np.array([prominence(n) for n in count])

    @property
    def bins(self) -> NDArray[np.int64]:
        return np.concatenate([self.tones, self.beside.ravel()])

    def place_in(self, bins: NDArray[np.int64]) -> None:
        """Restrict the powers to these bins."""
        self.tones, self.beside = np.searchsorted(bins, self.tones), np.searchsorted(bins, self.beside)

    def stand_out(self, power: Floats) -> NDArray[np.bool_]:
        """Bins whose power exceeds that of their neighbours by more than chance, (…, bins) to (…, tones)."""
        level = np.where(self.usable, np.take(power, self.beside, axis=-1), 0.0).sum(axis=-1) / self.known
        return np.asarray(self.enough & (power[..., self.tones] > self.times * level))


def prominence(neighbours: int) -> float:
    """Ratio to the mean power of its neighbours that a bin of noise exceeds with a probability of 1e-8."""
    return float(neighbours * (_CHANCE ** (-1 / max(neighbours, 1)) - 1))


def _on_bins(mains_hz: float, lines: Lines, harmonics: int) -> NDArray[np.int64]:
    """Bins at multiples of the mains frequency."""
    exact = mains_hz * np.arange(1, harmonics + 1) / lines.resolution_hz
    near = np.rint(exact).astype(np.int64)
    return np.asarray(near[(np.abs(exact - near) < _ON_BIN) & (near > 0) & (2 * near < lines.window)])


PERIODS = 9
"""Periods of silence after an excitation before a tone counts as hum.

A mode with a damping ratio of 0.1 % at 50 Hz loses 31 % of its power from the first to the last third of nine periods
of 0.1 s; in two periods a damping ratio of 0.5 % cannot be separated from noise.
"""
PERIODS_FIRST = 3  # of silence before the first excitation: thirds that a tone can decay over
STEADY = 0.9  # of the power in the first third of the periods: in the last third a tone that does not decay has more
GONE = 0.25  # of the previous power of the hum: below this, and without a tone, it has disappeared
GONE_PERIODS = 2  # in a row


class SilentHum(StatefulBase):
    """Which lines show a steady tone in periods without excitation.

    After the excitation a weakly damped mode rings near its own frequency, and looks like a tone. So a tone counts
    if it is detected in nine consecutive periods of silence and does not decay over them; where the data begins
    without excitation, three to eight are enough. A verdict is withdrawn when a later silence shows no tone there.

    Parameters
    ----------
    lines
        Number of lines.
    """

    _stage = Stage("silent-hum", 1)
    _STATE = ("_power", "_found", "_low", "_counts")

    def __init__(self, lines: int) -> None:
        self._power = np.full((PERIODS, lines), np.nan)  # of the newest periods of this silence, newest last
        self._found = np.zeros(lines)  # the hum's power, 0 where there is none
        self._low = np.zeros(lines)  # consecutive periods without it
        self._counts = np.zeros(2)  # periods of this silence, and of excitation before it

    @property
    def arrays(self) -> tuple[Floats, Floats, Floats, Floats]:
        """The state, which `Judge.process` changes in place: as the last ones of `PeriodState`."""
        return self._power, self._found, self._low, self._counts

    def interrupt(self) -> None:
        """The next period does not follow the previous one."""
        self._counts[0] = 0
        self._power[:] = np.nan


SECONDS_MIN = 2.0  # its thirds separate 50 from 60 Hz, with bins between them
_PARTS = 3
_MULTIPLES = np.array(sorted({base * k for base in MAINS_HZ for k in range(1, HARMONICS + 1)}))
_REACH = 3e-3  # of its frequency by which the mains may be off
_LOBE = 2  # bins on each side that a tone reaches in a Hann window
_NOISE = 2.0  # standard deviation of a tone's power in a part: √(2·35/18), times √(noise per bin/power)
_BESIDE = np.r_[-12:-3, 4:13]  # bins that a tone is compared with
_OFF = 0.2  # bins by which the place of a tone may be wrong, besides
_WANDER = 0.45  # of the highest power of the parts: the lowest one of a tone whose amplitude changes by ± 20 %
_DRIFT = 1e-4  # of its frequency per second by which the mains changes it
_TURN_MAX = 0.1  # rad: above it, the phase does not separate hum from a mode that noise drives
_PART_S = 2.0  # in which the mains changes its frequency by less than a bin, up to the tenth multiple


@dataclass(frozen=True)
class Hum:
    """A tone at a multiple of a mains frequency.

    Attributes
    ----------
    frequency_hz
        As measured, to a tenth of a bin of a third of the recording.
    amplitude
        Of the sine in each signal in which it is visible, in the signal's unit.
    """

    frequency_hz: float
    amplitude: Mapping[str, float]


def find_hum(signals: Mapping[str, Floats], rate_hz: float) -> list[Hum]:
    """Tones within 0.3 % of multiples 1 … 10 of 50 and 60 Hz in signals without excitation, ascending.

    A tone is detected if its power, over thirds of the recording with a Hann window, exceeds the noise of its
    neighbours (probability of chance 1e-8), and if each third has nine tenths of the power of each other third, less
    the scatter of the noise; 45 % are enough where the phase advances by the same angle from third to third, because
    the amplitude of the mains changes, its frequency hardly. So a decaying oscillation is not hum, nor is a mode that
    noise excites, whose amplitude and phase vary; the latter passes by chance once in 20 recordings of three seconds,
    once in eight of six. A tone of another machine is separated from the mains if it is off by 0.3 % and a fifth of the
    resolution of a third. Recordings of twelve seconds or more are also
    searched in parts of two seconds, because the mains drifts by more than the resolution of a third. Bias: the squared
    amplitude contains the noise power of five bins.

    Parameters
    ----------
    signals
        Samples of each, all finite and equally many.
    rate_hz
        Samples per second.

    Raises
    ------
    SignalError
        If there are less than two seconds.

    Examples
    --------
    >>> t = np.arange(4000) / 1000
    >>> y = 0.2 * np.sin(2 * np.pi * 50 * t) + 1e-3 * np.random.default_rng(1).standard_normal(4000)
    >>> [(round(hum.frequency_hz, 2), round(hum.amplitude["y"], 3)) for hum in find_hum({"y": y}, 1000)]
    [(50.0, 0.2)]
    """
    samples = min(x.size for x in signals.values())
    if samples < SECONDS_MIN * rate_hz:
        raise SignalError(
            "too-short",
            f"{samples / rate_hz:.3g} s without excitation are too short to detect hum",
            "record two seconds or more",
            seconds=samples / rate_hz,
            seconds_min=SECONDS_MIN,
        )
    tones = _tones(signals, rate_hz, _PARTS)
    parts = int(samples / rate_hz / _PART_S)
    if parts >= 2 * _PARTS:
        tones = _tones(signals, rate_hz, parts) | tones  # thirds have the best frequency
    return [tones[multiple] for multiple in sorted(tones)]


def disturbed_lines(tones: Sequence[Hum], lines: Lines) -> NDArray[np.bool_]:
    """Which lines each tone disturbs: closer than half a bin of their window, shape (tones, lines)."""
    tones_hz = np.array([tone.frequency_hz for tone in tones]).reshape(-1, 1)
    return np.asarray(np.abs(lines.frequency_hz - tones_hz) <= lines.resolution_hz / 2)


def may_disturb(lines: Lines) -> bool:
    """Whether a tone that `find_hum` may find can disturb one of the lines."""
    reach_hz = _REACH * _MULTIPLES + lines.resolution_hz  # half a bin, and the resolution of a short recording
    return bool(np.any(np.abs(lines.frequency_hz[:, np.newaxis] - _MULTIPLES) <= reach_hz))


def _tones(signals: Mapping[str, Floats], rate_hz: float, parts: int) -> dict[float, Hum]:
    """Tones that have the same power in so many parts, by the multiple that each belongs to."""
    spectra = {name: _spectra(x, parts) for name, x in signals.items()}
    resolution_hz = rate_hz / (min(x.size for x in signals.values()) // parts)
    near = np.rint(_MULTIPLES / resolution_hz).astype(np.int64)
    hum = {}
    highest_hz = (rate_hz / 2 - (_LOBE + 1) * resolution_hz) / (1 + _REACH)
    for f in _MULTIPLES[highest_hz > _MULTIPLES].tolist():
        turn = 2 * np.pi * _DRIFT * f / resolution_hz**2
        tones = {name: tone for name, x in spectra.items() if (tone := _tone(x, f / resolution_hz, near, turn))}
        if tones:
            bins = max(tones.values(), key=lambda tone: tone[1])[0]
            hum[f] = Hum(bins * resolution_hz, {name: amplitude for name, (_, amplitude) in tones.items()})
    return hum


def _spectra(x: Floats, count: int) -> Complex:
    """Spectra of the parts, so scaled that a sine of amplitude A has the power A² in the bins that it reaches."""
    n = x.size // count
    parts = x[: n * count].reshape(count, n)
    slope = np.arange(n) - (n - 1) / 2
    parts = parts - parts.mean(axis=1, keepdims=True)
    parts = parts - np.outer(parts @ slope / (slope @ slope), slope)
    window = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(n) / n)  # Hann
    return np.asarray(np.fft.rfft(parts * window, axis=1) * 2 / np.sqrt(n * np.sum(window**2)))


def _tone(spectra: Complex, expected: float, multiples: NDArray[np.int64], turn: float) -> tuple[float, float] | None:
    """Place in bins and amplitude of a tone at a place; None where the noise hides it, or it is not steady.

    `turn` is the angle in rad by which the phase of the mains may advance differently from part to part.
    """
    power = np.abs(spectra) ** 2
    mean, reach = power.mean(axis=0), max(1, round(_REACH * expected))
    first = max(round(expected) - reach, 1)
    peak = first + int(np.argmax(mean[first : round(expected) + reach + 1]))
    lobe = np.arange(max(peak - _LOBE, 1), min(peak + _LOBE, mean.size - 1) + 1)
    if mean[peak] < mean[lobe].max():
        return None  # the flank of another tone
    beside = peak + _BESIDE
    beside = beside[(beside > 0) & (beside < mean.size)]
    others = multiples[np.abs(multiples - peak) > _LOBE + reach]
    beside = beside[np.abs(beside[:, np.newaxis] - others).min(axis=1, initial=mean.size) > _LOBE]
    if beside.size < _BESIDE.size // 2 or mean[peak] <= prominence(beside.size // 2) * mean[beside].mean():
        return None
    place = float(np.average(lobe, weights=mean[lobe]))
    if abs(place - expected) > _REACH * expected + _OFF:
        return None
    of_part = power[:, lobe].sum(axis=1)
    noise = float(np.sqrt(mean[beside].mean() / of_part.mean()))
    lowest = of_part.min() / of_part.max() + _noise(len(power)) * noise
    if lowest < STEADY and (
        lowest < _WANDER or _curvature(spectra[:, peak]) > min(turn, _TURN_MAX) + 1.5 * _NOISE * noise
    ):
        return None
    return place, float(np.sqrt(of_part.mean()))


def _curvature(parts: Complex) -> float:
    """Largest change, from part to part, of the angle by which the phase advances."""
    advance = parts[1:] * parts[:-1].conj()
    return float(np.abs(np.angle(advance[1:] * advance[:-1].conj())).max())


def _noise(parts: int) -> float:
    """Change of a tone's power by noise that one of the parts exceeds as seldom as one of three exceeds two sigma."""
    return _NOISE * NormalDist().inv_cdf(1 - 0.0228 * _PARTS / parts)
