"""Ticks as engineers draw them: 20, 50, 100, 200 Hz in plain numbers, decibels and degrees in round steps."""

from __future__ import annotations

from math import ceil, floor, isfinite, log10

import numpy as np

# In order of preference.
_MANTISSAS = ((1.0, 2.0, 5.0), (1.0, 2.0, 3.0, 5.0, 7.0), (1.0, 3.0), (1.0,))


def frequency_ticks(low_hz: float, high_hz: float, most: int = 10) -> list[float]:
    """At most `most` round frequencies from `low_hz` to `high_hz` for a logarithmic axis, at least three if they fit.

    >>> frequency_ticks(17, 260)
    [20.0, 50.0, 100.0, 200.0]
    >>> frequency_ticks(48, 63)
    [48.0, 50.0, 52.0, 54.0, 56.0, 58.0, 60.0, 62.0]
    """
    first, last = floor(log10(low_hz)), floor(log10(high_hz))
    choices = []
    for mantissas in _MANTISSAS:
        every = [float(f"{m}e{d}") for d in range(first, last + 1) for m in mantissas]
        choices.append([f for f in every if low_hz <= f <= high_hz])
    for choice in choices:
        if len(choice) >= 4 and len(choice) <= most:
            return choice
    if high_hz / low_hz < 10:
        return linear_ticks(low_hz, high_hz, most)
    fitting = [choice for choice in choices if len(choice) <= most]
    return max(fitting, key=len) if fitting else choices[-1][:: ceil(len(choices[-1]) / most)]


def line_ticks(frequency_hz: np.ndarray, low_hz: float, high_hz: float, most: int = 10) -> list[float]:
    """The measured lines if there is room for a number at each, otherwise round frequencies.

    >>> line_ticks(np.array([20.0, 40.0, 80.0]), 18, 90)
    [20.0, 40.0, 80.0]
    >>> line_ticks(np.array([20.0, 21.0, 80.0]), 18, 90)
    [20.0, 30.0, 50.0, 70.0]
    """
    gaps = np.diff(np.log(frequency_hz)) / np.log(high_hz / low_hz)
    if len(frequency_hz) <= most and np.all(gaps >= min(0.06, 0.6 / most)):
        return [float(f) for f in frequency_hz]
    return frequency_ticks(low_hz, high_hz, most)


def minor_frequency_ticks(low_hz: float, high_hz: float) -> list[float]:
    """1 … 9 in every decade between the limits, as on logarithmic paper."""
    first, last = floor(log10(low_hz)), floor(log10(high_hz))
    if last - first > 12:
        return []
    every = [float(f"{m}e{d}") for d in range(first, last + 1) for m in range(1, 10)]
    return [f for f in every if low_hz <= f <= high_hz]


def frequency_label(frequency_hz: float) -> str:
    """Plain number; from 100 kHz with k or M.

    >>> [frequency_label(f) for f in (0.05, 20, 2000, 12345.6, 200e3, 1.5e6)]
    ['0.05', '20', '2000', '12345.6', '200k', '1.5M']
    """
    for unit, letter in ((1e6, "M"), (1e3, "k")):
        if frequency_hz >= max(unit, 1e5):
            return f"{frequency_hz / unit:.6g}{letter}"
    return f"{frequency_hz:.6g}"


def frequency_limits(frequency_hz: np.ndarray) -> tuple[float, float]:
    """Limits of a logarithmic axis with a little room at both sides, also around one line."""
    low, high = float(frequency_hz[0]), float(frequency_hz[-1])
    room = max(1.03, min(1.15, (high / low) ** 0.06)) if high > low else 1.5
    return low / room, high * room


def linear_ticks(low: float, high: float, most: int = 8) -> list[float]:
    """Multiples of 1, 2, 2.5 or 5 times a power of ten within the limits, at most `most`."""
    return _multiples(low, high, nice_step((high - low) / max(most - 1, 1)))


def nice_step(least: float) -> float:
    """The smallest of 1, 2, 2.5, 5 times a power of ten that is not below `least`."""
    if not (isfinite(least) and least > 0):
        return 1.0
    decade = floor(log10(least))
    steps = (float(f"{m}e{d}") for d in (decade, decade + 1) for m in (1, 2, 2.5, 5))
    return next((step for step in steps if step >= least * (1 - 1e-9)), float(f"1e{decade + 2}"))


def phase_ticks(low_deg: float, high_deg: float, most: int = 8) -> list[float]:
    """Multiples of a step that divides a quarter turn, 10, 15, 30, 45, 90, or of 180 degrees or whole turns.

    >>> phase_ticks(-200, 100)
    [-180.0, -135.0, -90.0, -45.0, 0.0, 45.0, 90.0]
    """
    least = (high_deg - low_deg) / most
    steps = (1, 2, 5, 10, 15, 30, 45, 90, 180, 360, 720, 1800, 3600, 7200)
    step = next((s for s in steps if s >= least), 360 * ceil(least / 360))
    return _multiples(low_deg, high_deg, step)


def _multiples(low: float, high: float, step: float) -> list[float]:
    first, last = ceil(low / step - 1e-9), floor(high / step + 1e-9)
    return [float(f"{i * step:.12g}") for i in range(first, last + 1)]
