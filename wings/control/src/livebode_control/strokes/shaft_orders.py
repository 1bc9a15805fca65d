"""Orders of a torque over the angle of a shaft, from all windows of the recording, with bounds."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import CIRCLE_FACTOR, widened
from livebode.dataclass import dataclass
from livebode.motion import AngleWindows, Shaft, usable_windows

_STROKES_MIN = 4  # whose scatter is a bound
_FALSE = 1e-3  # probability that any order of a shaft is seen by chance


@dataclass(frozen=True, eq=False)
class ShaftOrders:
    """The orders of one shaft.

    Attributes
    ----------
    shaft
        Its name, turns and orders.
    value
        Complex amplitude of each order, (orders,): the torque is Re(value·exp(j·order·angle)), with the angle of this
        shaft. NaN where no window shows the order.
    sigma, dof
        E|error|² = sigma², and its complex degrees of freedom, (orders,).
    seen
        Whether the order differs from zero; by chance, any order of a shaft does once in 1,000 results.
    strokes, windows
        Numbers of strokes and windows behind each order, (orders,).
    meets_hz
        Line that the order meets in every window, so that it cannot be separated from the line; else NaN.
    by_strokes
        Whether sigma is the scatter between strokes. That between the windows of a few strokes does not show a line of
        the time, if the speed is constant.
    per_delay_s
        Size of the error of the value for each second between the times of torque and motion, (orders,). It is no part
        of sigma: a recording does not show such a delay.
    """

    shaft: Shaft
    value: Complex
    sigma: Floats
    dof: Floats
    seen: NDArray[np.bool_]
    strokes: NDArray[np.int64]
    windows: NDArray[np.int64]
    meets_hz: Floats
    by_strokes: bool
    per_delay_s: Floats

    @property
    def amplitude(self) -> Floats:
        """Peak values, (orders,)."""
        return np.abs(self.value)

    @property
    def phase_deg(self) -> Floats:
        """Phase of the cosine at angle 0, (orders,)."""
        return np.degrees(np.angle(self.value))

    def bound(self, c: float = CIRCLE_FACTOR) -> Floats:
        """Radius around the complex amplitude that covers the true one with probability 1 − exp(−c²); default: 95 %.

        Of torque and motion that are recorded at the same time; a delay between them adds `per_delay_s`·delay.
        """
        return widened(self.sigma, self.dof, float(c))

    def torque(self, angle: Floats) -> Floats:
        """The sum of the orders that are seen, at angles of this shaft in rad."""
        k = np.array(self.shaft.orders)[self.seen]
        return np.asarray((self.value[self.seen] * np.exp(1j * np.multiply.outer(angle, k))).real.sum(axis=-1))

    def plain(self) -> dict[str, Any]:
        """Plain data for JSON; bounds of 95 %."""
        names = ("amplitude", "phase_deg", "bound", "error_per_delay_s", "seen", "strokes", "windows", "meets_hz")
        columns = [
            self.amplitude, self.phase_deg, self.bound(), self.per_delay_s, self.seen, self.strokes, self.windows,
            self.meets_hz,
        ]  # fmt: skip
        rows = [dict(zip(names, (value.item() for value in row))) for row in zip(*columns)]
        return {
            "shaft": self.shaft.name,
            "turns": self.shaft.turns,
            "bounds_from": "strokes" if self.by_strokes else "windows",
            "orders": [{"order": order} | row for order, row in zip(self.shaft.orders, rows)],
        }


def shaft_orders(
    windows: AngleWindows,
    shaft: Shaft,
    value: Complex,
    extra: Floats,
    per_delay_s: Complex,
    lines_hz: Floats,
    highest_hz: float,
    turns: int = 2,
) -> ShaftOrders:
    """Mean over all windows in which an order meets no line of the time, with the scatter between strokes.

    An order has the same phase over the angle in every stroke; a line of the time, at a constant frequency, has another
    one in each, and at another speed it is at another order. With four strokes or more, sigma is therefore the scatter
    between their means; else that between windows.

    Parameters
    ----------
    windows
        Of `angle_windows`.
    shaft
        The same.
    value
        Amplitudes, (windows, orders).
    extra
        Further standard deviation of the mean, (orders,): of the inertia.
    per_delay_s
        Derivative of the amplitudes by a delay of the input, (windows, orders).
    lines_hz
        Frequencies at which the time has lines, such as those of the excitation.
    highest_hz
        Windows in which an order is faster are not used: the axis does not move as one mass there.
    turns
        Of a window.
    """
    orders = np.array(shaft.orders)
    use, meets = usable_windows(windows, shaft, lines_hz, highest_hz, turns)
    by_strokes = bool(np.unique(windows.stroke).size >= _STROKES_MIN)

    def means(values: Complex) -> tuple[Any, ...]:
        many = [_mean(values[use[:, i], i], windows.stroke[use[:, i]], by_strokes) for i in range(orders.size)]
        return tuple(np.array(values) for values in zip(*many))

    mean, variance, dof = means(value)
    sigma = np.sqrt(variance + extra**2)
    limit = widened(sigma, dof, float(np.sqrt(np.log(orders.size / _FALSE))))
    return ShaftOrders(
        shaft=shaft,
        value=mean.astype(np.complex128),
        sigma=sigma,
        dof=dof,
        seen=np.abs(mean) > limit,
        strokes=np.array([np.unique(windows.stroke[use[:, i]]).size for i in range(orders.size)]),
        windows=use.sum(axis=0),
        meets_hz=meets,
        by_strokes=by_strokes,
        per_delay_s=np.abs(means(per_delay_s)[0]),
    )


def _mean(value: Complex, stroke: NDArray[np.int64], by_strokes: bool) -> tuple[complex, float, float]:
    """Mean, variance of the mean and degrees of freedom; NaN where there are fewer than two groups.

    Windows of a stroke overlap by a half, and count by their number.
    """
    if not by_strokes:
        stroke = np.arange(value.size) // 2  # two neighbours: the others overlap with one of them only
    groups, group, weight = np.unique(stroke, return_inverse=True, return_counts=True)
    if groups.size < 2:
        return complex(np.nan), np.nan, np.nan
    share = weight / weight.sum()
    mean = complex(value.mean())
    each = np.array([value[group == g].mean() for g in range(groups.size)])
    # E Σ share²·|each − mean|² of groups whose variance falls with their number of windows.
    expected = 1 - np.sum(share**2)
    variance = float(np.sum(share**2 * np.abs(each - mean) ** 2)) / expected
    dof = float(1 / np.sum(share**2) - 1)
    return mean, variance, max(dof, 1.0)
