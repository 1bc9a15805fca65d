"""Hum of the mains in a recording without excitation: its frequencies and amplitudes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from livebode.core import SignalError
from livebode.core.mains import MAINS_HZ
from livebode.estimation.mains import HARMONICS, prominence
from livebode.estimation.silence import STEADY

Floats = NDArray[np.float64]

SECONDS_MIN = 2.0  # its thirds separate 50 from 60 Hz, with bins between them
_PARTS = 3
_REACH = 3e-3  # of its frequency by which the mains may be off
_LOBE = 2  # bins on each side that a tone reaches in a Hann window
_NOISE = 4.0  # two standard deviations of a tone's power in a third: √(2·35/18) is one, times √(noise per bin/power)
_BESIDE = np.r_[-12:-3, 4:13]  # bins that a tone is compared with


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
    the scatter of the noise. So a decaying oscillation is not hum, nor is a mode that noise excites, whose amplitude
    varies; the latter passes by chance about once in 20 recordings. Bias: the squared amplitude contains the noise
    power of five bins.

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
    spectra = {name: _powers(x, rate_hz) for name, x in signals.items()}
    samples = min(x.size for x in signals.values()) // _PARTS
    resolution_hz = rate_hz / samples
    multiples = np.unique(np.outer(MAINS_HZ, np.arange(1, HARMONICS + 1)))
    near = np.rint(multiples / resolution_hz).astype(np.int64)
    found = []
    for f in multiples[multiples * (1 + _REACH) < rate_hz / 2 - (_LOBE + 1) * resolution_hz]:
        tones = {name: tone for name, power in spectra.items() if (tone := _tone(power, f / resolution_hz, near))}
        if tones:
            bins = max(tones.values(), key=lambda tone: tone[1])[0]
            found.append(Hum(bins * resolution_hz, {name: amplitude for name, (_, amplitude) in tones.items()}))
    return found


def _powers(x: Floats, rate_hz: float) -> Floats:
    """Power of the thirds at each bin, so scaled that a sine of amplitude A has A² in the bins that it reaches."""
    if x.size < SECONDS_MIN * rate_hz:
        raise SignalError(
            "too-short",
            f"{x.size / rate_hz:.3g} s without excitation are too short to detect hum",
            "record two seconds or more",
            seconds=x.size / rate_hz,
            seconds_min=SECONDS_MIN,
        )
    n = x.size // _PARTS
    parts = x[: n * _PARTS].reshape(_PARTS, n)
    slope = np.arange(n) - (n - 1) / 2
    parts = parts - parts.mean(axis=1, keepdims=True)
    parts = parts - np.outer(parts @ slope / (slope @ slope), slope)
    window = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(n) / n)  # Hann
    return np.asarray(np.abs(np.fft.rfft(parts * window, axis=1)) ** 2 * 4 / (n * np.sum(window**2)))


def _tone(power: Floats, expected: float, multiples: NDArray[np.int64]) -> tuple[float, float] | None:
    """Place in bins and amplitude of a tone near a place; None where the noise hides it, or its power changes."""
    mean, reach = power.mean(axis=0), max(1, round(_REACH * expected))
    first = max(round(expected) - reach, 1)
    at = first + int(np.argmax(mean[first : round(expected) + reach + 1]))
    lobe = np.arange(max(at - _LOBE, 1), min(at + _LOBE, mean.size - 1) + 1)
    if mean[at] < mean[lobe].max():
        return None  # the flank of another tone
    beside = at + _BESIDE
    beside = beside[(beside > 0) & (beside < mean.size)]
    others = multiples[np.abs(multiples - at) > _LOBE + reach]
    beside = beside[np.abs(beside[:, np.newaxis] - others).min(axis=1, initial=mean.size) > _LOBE]
    if beside.size < _BESIDE.size // 2 or mean[at] <= prominence(beside.size // 2) * mean[beside].mean():
        return None
    of_part = power[:, lobe].sum(axis=1)
    by_noise = _NOISE * np.sqrt(mean[beside].mean() / of_part.mean())
    if of_part.min() < (STEADY - by_noise) * of_part.max():
        return None
    return float(np.average(lobe, weights=mean[lobe])), float(np.sqrt(of_part.mean()))
