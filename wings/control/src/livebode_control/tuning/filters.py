"""Notch and low-pass as one biquad each, at a controller's rate."""

from __future__ import annotations

from math import atan, pi, sqrt, tan

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebode.core import Algebra, UsageError
from livebode.dataclass import dataclass

Polynomial = tuple[float, float, float]


@dataclass(frozen=True)
class Biquad(Algebra):
    """y(n) = b0·x(n) + b1·x(n−1) + b2·x(n−2) − a1·y(n−1) − a2·y(n−2), computed `rate_hz` times a second.

    In series with a controller of the same rate, so that the hold after both is counted with the controller.

    Parameters
    ----------
    b
        b0, b1, b2.
    a
        a1, a2; a0 is 1.
    rate_hz
        Computations per second.
    """

    b: tuple[float, float, float]
    a: tuple[float, float]
    rate_hz: float

    def response(self, frequency_hz: ArrayLike) -> NDArray[np.complex128]:
        before = np.exp(-2j * np.pi * np.asarray(frequency_hz, dtype=np.float64) / self.rate_hz)
        below = 1 + before * (self.a[0] + before * self.a[1])
        return np.asarray((self.b[0] + before * (self.b[1] + before * self.b[2])) / below)

    @classmethod
    def of(cls, numerator: Polynomial, denominator: Polynomial, frequency_hz: float, rate_hz: float) -> Biquad:
        """By the bilinear transformation that is exact at `frequency_hz` (prewarped)."""
        if not 0 < frequency_hz < rate_hz / 2:
            raise UsageError(
                "out-of-range",
                f"a filter at {frequency_hz:g} Hz cannot run at {rate_hz:g} Hz",
                "choose a frequency below half the rate",
                argument="frequency_hz",
                value=frequency_hz,
                rate_hz=rate_hz,
            )
        double = 2 * pi * frequency_hz / tan(pi * frequency_hz / rate_hz)  # s = double·(1 − 1/z)/(1 + 1/z)
        b, a = (_of_delays(polynomial, double) for polynomial in (numerator, denominator))
        return cls((b[0] / a[0], b[1] / a[0], b[2] / a[0]), (a[1] / a[0], a[2] / a[0]), rate_hz)


def _of_delays(polynomial: Polynomial, double: float) -> Polynomial:
    """p2·s² + p1·s + p0 times (1 + 1/z)²: its coefficients of 1, 1/z, 1/z²."""
    square, first, constant = polynomial[0] * double**2, polynomial[1] * double, polynomial[2]
    return square + first + constant, 2 * (constant - square), square - first + constant


def notch(frequency_hz: float, depth_db: float, damping: float, rate_hz: float) -> Biquad:
    """(s² + 2·g·ζ·ω·s + ω²)/(s² + 2·ζ·ω·s + ω²) with g = 10^(−depth/20): `depth_db` down at its centre, 0 dB far away.

    Raises
    ------
    UsageError
        If the centre is not below half the rate.

    Examples
    --------
    >>> biquad = notch(60.0, depth_db=20.0, damping=0.5, rate_hz=4000.0)
    >>> abs(biquad.response([0.0, 60.0, 2000.0])).round(6)
    array([1. , 0.1, 1. ])
    """
    omega, share = 2 * pi * frequency_hz, 10 ** (-depth_db / 20)
    above, below = ((1.0, 2 * d * omega, omega**2) for d in (share * damping, damping))
    return Biquad.of(above, below, frequency_hz, rate_hz)


def low_pass(frequency_hz: float, rate_hz: float, damping: float = 1 / sqrt(2)) -> Biquad:
    """ω²/(s² + 2·ζ·ω·s + ω²); with the usual damping (Butterworth) 3 dB down at `frequency_hz`.

    Raises
    ------
    UsageError
        If the frequency is not below half the rate.

    Examples
    --------
    >>> abs(low_pass(60.0, 4000.0).response([0.0, 60.0])).round(4)
    array([1.    , 0.7071])
    """
    omega = 2 * pi * frequency_hz
    return Biquad.of((0.0, 0.0, omega**2), (1.0, 2 * damping * omega, omega**2), frequency_hz, rate_hz)


def notch_over(low_hz: float, high_hz: float, depth_db: float, least_damping: float, rate_hz: float) -> Biquad:
    """A notch that is at least half its depth (in dB) down everywhere from `low_hz` to `high_hz`.

    With v = (f/f0 − f0/f)/2 its size squared is (v² + g²ζ²)/(v² + ζ²), which is g at v = √g·ζ. Its zeros are damped by
    at least `least_damping`, the damping of the resonance, so that it removes the peak without a dip beside it.

    Raises
    ------
    UsageError
        If the range is not below half the rate.
    """
    if not 0 < low_hz <= high_hz < rate_hz / 2:
        raise UsageError(
            "out-of-range",
            f"a notch over {low_hz:g} … {high_hz:g} Hz cannot run at {rate_hz:g} Hz",
            "choose a range below half the rate",
            argument="high_hz",
            value=high_hz,
            rate_hz=rate_hz,
        )
    share = 10 ** (-depth_db / 20)
    low, high = (
        tan(pi * low_hz / rate_hz),
        tan(pi * high_hz / rate_hz),
    )  # with the frequency warping of the bilinear transformation
    centre_hz = atan(sqrt(low * high)) * rate_hz / pi
    edge = (sqrt(high / low) - sqrt(low / high)) / 2
    return notch(centre_hz, depth_db, max(edge / sqrt(share), least_damping / share), rate_hz)
