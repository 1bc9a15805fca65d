"""Orders of a torque over the angle of a shaft: sliding DFT of samples at equal steps of the angle."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import SignalError, UsageError
from livebode.dataclass import dataclass
from livebode.kernel import SlidingDFT

SLOWEST = 0.05  # of the highest speed, from which on an axis counts as moving

_OVERSAMPLED = 8  # steps in the shortest cycle
_STEPS_MIN = 64  # a turn
_MAIN_LOBE = 2.0  # bins on each side that a tone reaches under the Hann window
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
        if not self.name.strip():
            raise UsageError("missing", "a shaft has no name", "write for example gear=0.2:1,2,14", argument="shaft")
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
    windows = [
        window for number, stroke in enumerate(strokes) for window in _of_stroke(stroke, number, shaft, turns, steps)
    ]
    if not windows:
        longest = max((float(np.ptp(s.angle)) * shaft.turns / (2 * np.pi) for s in strokes), default=0.0)
        raise SignalError(
            "too-short",
            f"the longest stroke turns the shaft {shaft.name!r} {longest:.3g} times, less than the {turns} turns of a "
            "window",
            "record longer strokes",
            turns=longest,
            limit=turns,
        )
    value, stroke_of, slowest, fastest, sample = zip(*windows)
    return AngleWindows(
        np.stack(value, axis=1), np.array(stroke_of), np.array(slowest), np.array(fastest), np.array(sample)
    )


def _of_stroke(
    stroke: Stroke, number: int, shaft: Shaft, turns: int, steps: int
) -> Iterator[tuple[Complex, int, float, float, int]]:
    """Amplitudes, stroke, slowest and fastest speed, and middle sample of each window of a stroke."""
    steps_passed = stroke.angle * shaft.turns / (2 * np.pi) * steps  # in steps
    if steps_passed[-1] < steps_passed[0]:
        steps_passed, torque, numbers = steps_passed[::-1], stroke.torque[:, ::-1], np.arange(steps_passed.size)[::-1]
    else:
        torque, numbers = stroke.torque, np.arange(steps_passed.size)
    steps_passed = np.maximum.accumulate(steps_passed) + np.arange(steps_passed.size) * 1e-9
    edges = np.arange(int(np.ceil(steps_passed[0])), int(np.floor(steps_passed[-1])) + 1)
    window = turns * steps
    if edges.size <= window:
        return
    when = np.interp(edges, steps_passed, np.arange(steps_passed.size))
    even = np.stack([_means(row, when) for row in torque])
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


def usable_windows(
    windows: AngleWindows, shaft: Shaft, lines_hz: Floats, highest_hz: float, turns: int = 2
) -> tuple[NDArray[np.bool_], Floats]:
    """Windows in which an order meets no line and is not too fast, (windows, orders), and the line met in all of them.

    `lines_hz` are frequencies at which the time has lines, `highest_hz` that above which the axis does not move as one
    mass, and `turns` those of a window. The line is NaN for an order that has a window.
    """
    orders = np.array(shaft.orders)
    low, high = (speed[:, np.newaxis] * orders for speed in (windows.slowest, windows.fastest))
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
