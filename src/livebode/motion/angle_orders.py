"""Orders of a torque over the angle of a shaft: sliding DFT of samples at equal steps of the angle."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import SignalError, UsageError, widened
from livebode.kernel import SlidingDFT

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

_OVERSAMPLED = 8  # steps in the shortest cycle
_STEPS_MIN = 64  # a turn
_MAIN_LOBE = 2.0  # bins on each side that a tone reaches under the Hann window
_STROKES_MIN = 4  # whose scatter is a bound
_FALSE = 1e-3  # probability that any order of a shaft is seen by chance
_GAIN = 0.5  # mean of the Hann window
_MOST = 400  # orders of a shaft


@dataclass(frozen=True)
class Shaft:
    """A shaft that turns with the axis, and its orders.

    Attributes
    ----------
    name
        motor, pulley, gear, encoder, …
    turns
        Turns of this shaft in one turn of the motor: 1/5 behind a gear of 5:1.
    orders
        Cycles in one turn of this shaft, whole numbers.
    """

    name: str
    turns: float
    orders: tuple[int, ...]

    def __post_init__(self) -> None:
        if not (np.isfinite(self.turns) and self.turns > 0):
            raise UsageError(
                "out-of-range",
                f"the shaft {self.name!r} has {self.turns} turns in one turn of the motor",
                "give a positive number",
                argument="shaft",
                value=self.turns,
            )
        if not self.orders or len(set(self.orders)) < len(self.orders) or min(self.orders) < 1:
            raise UsageError(
                "out-of-range",
                f"the orders {list(self.orders)} of the shaft {self.name!r} are not different whole numbers above 0",
                "give for example 1, 2, 24",
                argument="shaft",
                value=list(self.orders),
            )
        if len(self.orders) > _MOST:
            raise UsageError(
                "too-large",
                f"the shaft {self.name!r} has {len(self.orders)} orders",
                f"give at most {_MOST}",
                argument="shaft",
                limit=_MOST,
            )


@dataclass(frozen=True, eq=False)
class Stroke:
    """Samples in one direction: angle of the motor in rad, (samples,), and some signals, (signals, samples)."""

    angle: Floats
    torque: Floats
    first: int
    rate_hz: float


@dataclass(frozen=True, eq=False)
class AngleWindows:
    """Spectra over windows of a shaft's angle.

    Attributes
    ----------
    value
        Complex amplitudes, (signals, windows, orders): the torque is the sum of Re(value·exp(j·order·angle)).
    stroke
        Number of the stroke of each window, (windows,).
    slowest, fastest
        Frequency of the shaft's turns over the window, Hz, (windows,).
    sample
        Number of the sample at the middle of each window, (windows,).
    """

    value: Complex
    stroke: NDArray[np.int64]
    slowest: Floats
    fastest: Floats
    sample: NDArray[np.int64]


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

    @property
    def amplitude(self) -> Floats:
        """Peak values, (orders,)."""
        return np.abs(self.value)

    @property
    def phase_deg(self) -> Floats:
        """Phase of the cosine at angle 0, (orders,)."""
        return np.degrees(np.angle(self.value))

    def bound(self, c: float = np.sqrt(np.log(20.0))) -> Floats:
        """Radius around the complex amplitude that covers the true one with probability 1 − exp(−c²); default: 95 %."""
        return widened(self.sigma, self.dof, float(c))

    def torque(self, angle: Floats) -> Floats:
        """The sum of the orders that are seen, at angles of this shaft in rad."""
        k = np.array(self.shaft.orders)[self.seen]
        return np.asarray((self.value[self.seen] * np.exp(1j * np.multiply.outer(angle, k))).real.sum(axis=-1))

    def plain(self) -> dict[str, Any]:
        """As plain data, for JSON; bounds of 95 %."""
        names = ("amplitude", "phase_deg", "bound", "seen", "strokes", "windows", "meets_hz")
        bound = self.bound()
        columns = [self.amplitude, self.phase_deg, bound, self.seen, self.strokes, self.windows, self.meets_hz]
        rows = [dict(zip(names, (one.item() for one in row))) for row in zip(*columns)]
        return {
            "shaft": self.shaft.name,
            "turns": self.shaft.turns,
            "bounds_from": "strokes" if self.by_strokes else "windows",
            "orders": [{"order": order} | row for order, row in zip(self.shaft.orders, rows)],
        }


def strokes_of(angle: Floats, speed: Floats, torque: Floats, rate_hz: float, slowest: float) -> list[Stroke]:
    """Stretches in which the axis is faster than `slowest` in one direction; `torque` is (many, samples)."""
    way = np.where(np.abs(speed) > slowest, np.sign(speed), 0.0)
    edges = np.concatenate([[0], np.flatnonzero(np.diff(way)) + 1, [way.size]])
    return [
        Stroke(angle[first:stop], torque[:, first:stop], int(first), rate_hz)
        for first, stop in pairwise(edges)
        if way[first] != 0 and stop - first > 1
    ]


def angle_windows(strokes: Sequence[Stroke], shaft: Shaft, turns: int = 2) -> AngleWindows:
    """Spectra of all windows of so many turns of a shaft, half of a window apart, under the Hann window.

    The steps of the angle are the same in every stroke and direction, so that the phase of an order is too. A sample
    at a step is the mean over it, which no vibration between two steps changes into an order.

    Raises
    ------
    SignalError
        If no stroke is as long as a window.
    """
    steps = max(_STEPS_MIN, 1 << int(np.ceil(np.log2(_OVERSAMPLED * max(shaft.orders)))))
    found = [one for number, stroke in enumerate(strokes) for one in _of_stroke(stroke, number, shaft, turns, steps)]
    if not found:
        longest = max((float(np.ptp(s.angle)) * shaft.turns / (2 * np.pi) for s in strokes), default=0.0)
        raise SignalError(
            "too-short",
            f"the longest stroke turns the shaft {shaft.name!r} {longest:.3g} times, less than the {turns} turns of a "
            "window",
            "record longer strokes",
            turns=longest,
            limit=turns,
        )
    value, stroke_of, slowest, fastest, sample = zip(*found)
    return AngleWindows(
        np.stack(value, axis=1), np.array(stroke_of), np.array(slowest), np.array(fastest), np.array(sample)
    )


def _of_stroke(
    stroke: Stroke, number: int, shaft: Shaft, turns: int, steps: int
) -> Iterator[tuple[Complex, int, float, float, int]]:
    """Amplitudes, stroke, slowest and fastest speed, and middle sample of each window of a stroke."""
    at = stroke.angle * shaft.turns / (2 * np.pi) * steps  # in steps
    if at[-1] < at[0]:
        at, torque, numbers = at[::-1], stroke.torque[:, ::-1], np.arange(at.size)[::-1]
    else:
        torque, numbers = stroke.torque, np.arange(at.size)
    at = np.maximum.accumulate(at) + np.arange(at.size) * 1e-9
    edges = np.arange(int(np.ceil(at[0])), int(np.floor(at[-1])) + 1)
    window = turns * steps
    if edges.size <= window:
        return
    when = np.interp(edges, at, np.arange(at.size))
    even = np.stack([_means(one, when) for one in torque])
    orders = np.array(shaft.orders)
    dft = SlidingDFT(window, orders * turns, channels=len(even), variant="hann")
    spectra = np.asarray(dft.process(even, hop=window // 2)).reshape(len(even), -1, orders.size)
    # The phase from the window's first sample to angle 0, and the mean over a step.
    mean = np.sinc(orders / steps)
    for row in range(1, spectra.shape[1]):
        begin = (row - 1) * (window // 2)
        turned = np.exp(-2j * np.pi * orders * (edges[begin] + 0.5) / steps)
        each = np.diff(when[begin : begin + window + 1 : max(window // 16, 1)]) / stroke.rate_hz
        speed = window / steps / 16 / each
        middle = int(numbers[round(when[begin + window // 2])])
        value = spectra[:, row] * turned * 2 / (window * _GAIN * mean)
        yield value, number, float(speed.min()), float(speed.max()), stroke.first + middle


def _means(signal: Floats, when: Floats) -> Floats:
    """Mean of a signal, linear between its samples, from each moment to the next one."""
    whole = np.concatenate([[0.0], np.cumsum((signal[1:] + signal[:-1]) / 2)])
    below = np.floor(when).astype(np.int64).clip(0, signal.size - 2)
    share = when - below
    rise = signal[below + 1] - signal[below]
    total = whole[below] + share * signal[below] + share**2 / 2 * rise
    return np.asarray(np.diff(total) / np.diff(when))


def shaft_orders(
    windows: AngleWindows,
    shaft: Shaft,
    value: Complex,
    extra: Floats,
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
    many = [_mean(value[use[:, i], i], windows.stroke[use[:, i]], by_strokes) for i in range(orders.size)]
    mean, variance, dof = (np.array(one) for one in zip(*many))
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
    )


def usable_windows(
    windows: AngleWindows, shaft: Shaft, lines_hz: Floats, highest_hz: float, turns: int = 2
) -> tuple[NDArray[np.bool_], Floats]:
    """Windows in which an order meets no line and is not too fast, (windows, orders), and the line met in all of them.

    The arguments are those of `shaft_orders`. The line is NaN for an order that has a window.
    """
    orders = np.array(shaft.orders)
    low, high = (one[:, np.newaxis] * orders for one in (windows.slowest, windows.fastest))
    beside = _MAIN_LOBE / turns * windows.fastest[:, np.newaxis]
    met = np.zeros(low.shape, dtype=bool)
    meets = np.full(orders.size, np.nan)
    for line in lines_hz:
        near = (low - beside < line) & (line < high + beside)
        meets[near.any(axis=0) & np.isnan(meets)] = line
        met |= near
    slow = high <= highest_hz
    use = ~met & slow
    meets[use.any(axis=0) | ~slow.any(axis=0)] = np.nan
    return use, meets


def _mean(value: Complex, stroke: NDArray[np.int64], by_strokes: bool) -> tuple[complex, float, float]:
    """Mean, variance of the mean and degrees of freedom; NaN where there are fewer than two groups.

    Windows of a stroke overlap by a half, and count by their number.
    """
    if not by_strokes:
        stroke = np.arange(value.size) // 2  # two neighbours: the others overlap with one of them only
    groups, at, weight = np.unique(stroke, return_inverse=True, return_counts=True)
    if groups.size < 2:
        return complex(np.nan), np.nan, np.nan
    share = weight / weight.sum()
    mean = complex(value.mean())
    each = np.array([value[at == g].mean() for g in range(groups.size)])
    # E Σ share²·|each − mean|² of groups whose variance falls with their number of windows.
    expected = 1 - np.sum(share**2)
    variance = float(np.sum(share**2 * np.abs(each - mean) ** 2)) / expected
    dof = float(1 / np.sum(share**2) - 1)
    return mean, variance, max(dof, 1.0)
