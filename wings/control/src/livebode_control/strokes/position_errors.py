"""Errors of the measured angle, such as an eccentric encoder: they grow with the speed, and a torque does not."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import CIRCLE_FACTOR, widened
from livebode.dataclass import dataclass
from livebode.motion import AngleWindows, Shaft

_STROKES_MIN = 5  # fewer give no usable scatter
_FALSE = 1e-3  # probability that any order of a shaft has an error by chance
_SPREAD = 1.2  # fastest over slowest stroke, from which a torque and an error differ
_LEVERAGE = 0.99  # of a stroke on the slope, above which its residual is nothing but rounding


@dataclass(frozen=True, eq=False)
class PositionErrors:
    """Errors of the angle of a shaft, by order.

    Attributes
    ----------
    shaft
        Its name, turns and orders.
    value
        Complex amplitude of the error of the motor's angle in rad, (orders,): it is read too large by
        Re(value·exp(j·order·angle)). NaN where the strokes do not show it.
    sigma, dof
        E|error|² = sigma², and its complex degrees of freedom, (orders,).
    seen
        Whether it differs from zero; by chance, any order of a shaft does once in 1,000 results.
    """

    shaft: Shaft
    value: Complex
    sigma: Floats
    dof: Floats
    seen: NDArray[np.bool_]

    def bound(self, c: float = CIRCLE_FACTOR) -> Floats:
        """Radius around the complex amplitude that covers the true one with probability 1 − exp(−c²); default: 95 %."""
        return widened(self.sigma, self.dof, float(c))

    def plain(self) -> list[dict[str, Any]]:
        """Plain data for JSON; bounds of 95 %, in rad of the motor."""
        return [
            {
                "shaft": self.shaft.name,
                "order": order,
                "amplitude_rad": float(abs(value)),
                "phase_deg": float(np.degrees(np.angle(value))),
                "bound_rad": float(bound),
                "seen": bool(seen),
            }
            for order, value, bound, seen in zip(self.shaft.orders, self.value, self.bound(), self.seen)
        ]


def position_errors(
    windows: AngleWindows, shaft: Shaft, value: Complex, use: NDArray[np.bool_], inertia: float
) -> PositionErrors:
    """Fit of a torque and an error of the angle to the order of each stroke.

    An error e·cos(k·φ) of the angle has the acceleration −e·ω²·cos(k·φ), with the order's angular frequency ω, and the
    inertia turns it into a torque that is not there. It grows with the square of the speed, and a torque does not.

    Parameters
    ----------
    windows
        Of `angle_windows`.
    shaft
        The same.
    value
        Amplitudes of the torque, (windows, orders).
    use
        Windows that an order uses, (windows, orders).
    inertia
        Of the axis, at the motor.
    """
    many = [_error(windows, order, value[:, i], use[:, i], inertia) for i, order in enumerate(shaft.orders)]
    error, sigma, dof = (np.array(values) for values in zip(*many))
    limit = widened(sigma, dof, float(np.sqrt(np.log(len(shaft.orders) / _FALSE))))
    return PositionErrors(shaft, error.astype(np.complex128), sigma, dof, np.abs(error) > limit)


def _error(
    windows: AngleWindows, order: int, value: Complex, use: NDArray[np.bool_], inertia: float
) -> tuple[complex, float, float]:
    """Slope of the torque over −J·ω², its sigma and degrees of freedom, from means of strokes."""
    speed_hz = (windows.slowest + windows.fastest) / 2
    strokes = np.unique(windows.stroke[use])
    rows = [use & (windows.stroke == stroke) for stroke in strokes]
    if strokes.size < _STROKES_MIN:
        return complex(np.nan), np.nan, np.nan
    torque = np.array([value[row].mean() for row in rows])
    square = np.array([np.mean((2 * np.pi * order * speed_hz[row]) ** 2) for row in rows])
    away = -inertia * (square - square.mean())
    # A stroke that alone has its speed decides alone, and nothing tells its noise.
    alone = np.max(away**2) > _LEVERAGE * (1 - 1 / strokes.size) * (away @ away)
    if square.max() < _SPREAD**2 * square.min() or alone:
        return complex(np.nan), np.nan, np.nan
    slope = complex(away @ torque / (away @ away))
    residual = torque - torque.mean() - slope * away
    variance, dof = _scatter(away, residual)
    return slope, float(np.sqrt(variance)), dof


def _scatter(away: Floats, residual: Complex) -> tuple[float, float]:
    """Variance of the slope, and its complex degrees of freedom, without equal noise of all strokes.

    `away` is centred. Noise grows with the speed, and fast strokes decide: their residuals alone tell how large it is.
    The estimate is exact where the noise is equal (HC2 of MacKinnon and White, J. Econometrics 29(3), 1985, with the
    degrees of freedom of Bell and McCaffrey, Survey Methodology 28(2), 2002).
    """
    share = away**2 / (away @ away)
    weight = share / (1 - 1 / away.size - share)
    kept = np.eye(away.size) - 1 / away.size - np.outer(away, away) / (away @ away)
    form = (kept * weight) @ kept
    variance = weight @ np.abs(residual) ** 2 / (away @ away)
    return float(variance), float(np.trace(form) ** 2 / np.sum(form**2))
