"""The rate of a mean period: the shortest decimal within the uncertainty."""

from __future__ import annotations

EPSILON = 2.0**-50
"""Relative uncertainty of double precision alone."""


def exact_rate_hz(period_s: float, uncertainty: float) -> float:
    """Rate in Hz for a mean period in seconds that is known to ± `uncertainty` (relative).

    Of all rates and periods within the uncertainty, the one with the fewest decimal digits: recorders sample at 4000 Hz
    or every 0.3 ms, not at 3999.99996 Hz. The data cannot distinguish rates within the uncertainty.

    >>> exact_rate_hz(1 / 3999.99996, 1e-6)
    4000.0
    >>> exact_rate_hz(0.0003, 1e-9)
    3333.3333333333335
    >>> exact_rate_hz(1 / 1000.0037, 1e-12)
    1000.0037
    """
    room = uncertainty + EPSILON
    rate_digits, rate_hz = shortest(1.0 / period_s, room)
    period_digits, period_s = shortest(period_s, room)
    return rate_hz if rate_digits <= period_digits else 1.0 / period_s


def shortest(value: float, room: float) -> tuple[int, float]:
    """Number of digits and value of the shortest decimal within `value`·(1 ± `room`).

    >>> shortest(3999.99996, 1e-6)
    (1, 4000.0)
    """
    for digits in range(1, 17):
        rounded = float(f"{value:.{digits - 1}e}")
        if abs(rounded - value) <= room * value:
            return digits, rounded
    return 17, value
