"""Models of the torque: friction of strokes and orders of shafts, and the amplitudes of these."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Block, SignalError
from livebode.dataclass import dataclass
from livebode.motion import (
    SLOWEST,
    OutputKind,
    Shaft,
    SmoothKernel,
    Stroke,
    angle_windows,
    applied,
    friction_curve,
    strokes_of,
    usable_windows,
)

BAND_HZ = 5.0  # in which the direction of motion is decided: an excitation is above it

_SPEEDS = 33  # points of the friction over the speed
_STEADY = 1.3  # quotient of the speeds in a window: in a ramp, friction and the excitation leak into the orders
_VARYING = 3  # terms in time of the amplitude of a line
_STROKE_S = 0.3  # a shorter piece of motion in one direction is a correction, not a stroke


@dataclass(frozen=True, eq=False)
class StrokeFriction:
    """Friction of the strokes of a section, as a factor of the learned one, (strokes,) each.

    `speed` is the mean speed with the sign of the direction; `samples` is the length.
    """

    speed: Floats
    factor: Floats
    samples: Floats


@dataclass(frozen=True, eq=False)
class OrderWindows:
    """Orders of a shaft in windows of two turns, (windows, orders) each.

    `value` are the complex amplitudes, NaN where an order meets a line or is too fast; `frequency_hz` is that of the
    order in the window.
    """

    value: NDArray[np.complex128]
    frequency_hz: Floats


@dataclass(frozen=True, eq=False)
class TorqueModel:
    """Inertia and friction of the healthy axis, and the shafts whose orders are monitored.

    Attributes
    ----------
    kind
        Whether the output is a position or a velocity.
    inertia, offset
        J and the constant force F0 of the equation of motion, in units of the input and the output.
    speed, friction
        Friction over the speed of the motion, (points,); above and below, the last value.
    turn
        Units of the output (of its integral, if it is a velocity) in one turn of the motor.
    shafts
        With their orders; none if the turn of the motor is not known.
    lines_hz
        Frequencies of the excitation: windows in which an order meets one are left out.
    """

    kind: OutputKind
    inertia: float
    offset: float
    speed: Floats
    friction: Floats
    turn: float
    shafts: tuple[Shaft, ...]
    lines_hz: Floats

    @classmethod
    def of(cls, block: Block, names: tuple[str, str], kind: OutputKind, turn: float, shafts: Sequence[Shaft],
           lines_hz: Floats) -> TorqueModel:  # fmt: skip
        """From healthy strokes without a gap; `names` are the channels of input and output.

        Raises
        ------
        SignalError
            If they do not show the friction.
        """
        input, output = names
        order = 0 if kind == "velocity" else 1
        top = float(np.max(np.abs(SmoothKernel(BAND_HZ, block.rate_hz).smooth(block[output], order))))
        curve = friction_curve(block, input=input, output=output, kind=kind, band_hz=BAND_HZ, slowest=SLOWEST * top)
        speed = np.linspace(SLOWEST * top, top, _SPEEDS)
        friction, _ = curve.at(speed)
        return cls(kind, curve["inertia"], curve["offset"], speed, friction, turn, tuple(shafts), lines_hz)

    def section(self, input: Floats, output: Floats, rate_hz: float) -> tuple[StrokeFriction, list[OrderWindows]]:
        """Friction of the strokes in these samples without a gap, and the windows of each shaft's orders.

        The friction of a stroke is the mean of u − J·a − F0 in the direction of the motion. The angle begins at zero
        with each section.
        """
        sharp, slow = SmoothKernel.sharpest(rate_hz), SmoothKernel(BAND_HZ, rate_hz)
        order = 0 if self.kind == "velocity" else 1
        held, velocity = applied(input), slow.smooth(output, order)
        inner = slice(slow.reach - sharp.reach, input.size - slow.reach - sharp.reach)
        smooth = slow.smooth(held) - self.inertia * slow.smooth(output, order + 1) - self.offset
        acting = (sharp.smooth(held) - self.inertia * sharp.smooth(output, order + 1))[inner] - self.offset
        learned = np.interp(np.abs(velocity), self.speed, self.friction)
        angle = output[slow.reach : output.size - slow.reach]
        if self.kind == "velocity":
            angle = np.cumsum(angle) / rate_hz
        signals = np.stack([learned * np.sign(velocity) - acting, smooth, learned, velocity])
        strokes = [
            stroke
            for stroke in strokes_of(angle * 2 * np.pi / self.turn, velocity, signals, rate_hz, float(self.speed[0]))
            if stroke.angle.size >= _STROKE_S * rate_hz
        ]
        alone = [self._without_lines(stroke) for stroke in strokes] if self.shafts else []
        return _friction(strokes), [self._orders(alone, shaft, sharp) for shaft in self.shafts]

    def _without_lines(self, stroke: Stroke) -> Stroke:
        """The torque of a stroke without the excitation, whose amplitude changes with the position.

        Windows in which an order meets a line are left out; in the others, a window's side lobes would show the lines.
        """
        t = np.linspace(-1.0, 1.0, stroke.angle.size)
        time_s = np.arange(stroke.angle.size) / stroke.rate_hz
        phase = 2 * np.pi * np.multiply.outer(time_s, self.lines_hz)
        waves = np.concatenate([np.ones((t.size, 1)), np.cos(phase), np.sin(phase)], axis=1)
        columns = np.concatenate([waves * t[:, np.newaxis] ** k for k in range(_VARYING)], axis=1)
        torque = stroke.torque[0] - columns @ np.linalg.lstsq(columns.T @ columns, columns.T @ stroke.torque[0])[0]
        return Stroke(stroke.angle, torque[np.newaxis], stroke.first, stroke.rate_hz)

    def _orders(self, strokes: list[Stroke], shaft: Shaft, kernel: SmoothKernel) -> OrderWindows:
        try:
            windows = angle_windows(strokes, shaft)
        except SignalError:  # no stroke has two turns
            nothing = np.zeros((0, len(shaft.orders)))
            return OrderWindows(nothing.astype(np.complex128), nothing)
        use, _ = usable_windows(windows, shaft, self.lines_hz, kernel.most_hz)
        use &= (windows.fastest <= _STEADY * windows.slowest)[:, np.newaxis]
        middle = (windows.slowest + windows.fastest)[:, np.newaxis] / 2 * np.array(shaft.orders)
        return OrderWindows(np.where(use, windows.value[0] / kernel.left(middle), np.nan), middle)


def _friction(strokes: list[Stroke]) -> StrokeFriction:
    _, acting, learned, speed = np.array([stroke.torque.mean(axis=1) for stroke in strokes]).reshape(-1, 4).T
    samples = np.array([float(stroke.angle.size) for stroke in strokes])
    return StrokeFriction(speed, acting * np.sign(speed) / learned, samples)


TOGETHER_MIN = 4  # orders of a shaft, from which on they are also judged together
_BINS = 48
_BIN_MIN = 20  # windows
_WINDOWS_MIN = 3  # of a section, whose scatter shows what is no order


@dataclass(frozen=True, eq=False)
class TorqueNoise:
    """Power of a window's complex amplitude without any order, over the frequency; (frequencies,) each."""

    frequency_hz: Floats
    power: Floats

    @classmethod
    def of(cls, windows: Sequence[OrderWindows]) -> TorqueNoise:
        """From windows of the healthy axis: the median over all orders, of which few are there, in bins."""
        value = np.concatenate([window.value.ravel() for window in windows])
        f = np.concatenate([window.frequency_hz.ravel() for window in windows])
        known = np.isfinite(value) & (f > 0)
        f, square = f[known], np.abs(value[known]) ** 2
        order = np.argsort(f, kind="stable")
        parts = np.array_split(order, max(1, min(_BINS, f.size // _BIN_MIN)))
        return cls(
            np.array([np.median(f[part]) for part in parts]),
            np.array([np.median(square[part]) for part in parts]) / np.log(2),
        )

    def at(self, frequency_hz: Floats) -> Floats:
        """Power at these frequencies."""
        return np.exp(np.interp(frequency_hz, self.frequency_hz, np.log(self.power)))


def powers(windows: Sequence[OrderWindows], noise: TorqueNoise) -> tuple[Floats, Floats]:
    """|amplitude|² of each order's mean over the windows, and what noise gives; (orders,) each.

    Windows are weighted by the noise at their frequencies. An order of the shaft has one phase in all windows of a
    section. What is in a few of them only, such as the excitation near a line that the axis passes, scatters, and
    counts as noise. NaN and infinite where fewer than three windows show an order.
    """
    square, own = [], []
    for window in windows:
        value, seen = np.nan_to_num(window.value), np.isfinite(window.value)
        weight = np.where(seen, 1 / noise.at(window.frequency_hz), 0.0)
        count, total = seen.sum(axis=0), np.maximum(weight.sum(axis=0), np.finfo(float).tiny)
        share = weight / total
        mean = np.sum(share * value, axis=0)
        scatter = np.sum(share**2 * np.abs(value - mean) ** 2, axis=0) * count / np.maximum(count - 1, 1)
        known = count >= _WINDOWS_MIN
        square.append(np.where(known, np.abs(mean) ** 2, np.nan))
        own.append(np.where(known, np.maximum(1 / total, scatter), np.inf))
    return np.concatenate(square), np.concatenate(own)


def normal_values(square: Floats, own: Floats, true: Floats, usual: Floats) -> Floats:
    """Values of orders whose scatter hardly depends on the speeds and the number of windows, (orders,).

    The cube root of |amplitude|², a χ² of two degrees of freedom, is nearly normal whether the order is seen or not
    (Wilson and Hilferty, PNAS 17, 1931; Abdel-Aty, Biometrika 41, 1954). It is scaled to the usual noise: by nothing
    for an order that is well above the noise, so that its amplitude remains true.

    Parameters
    ----------
    square, own
        Of `powers`.
    true, usual
        Square of the amplitude of the healthy axis, and the usual noise.
    """
    with np.errstate(invalid="ignore"):
        return np.asarray(np.cbrt(square * (true + usual) / (true + own)))


def together(square: Floats, own: Floats, true: Floats, shafts: Sequence[Shaft]) -> Floats:
    """For each shaft the cube root of the mean of its orders' powers, relative to the healthy ones, (shafts,).

    A local defect, such as a tooth, has many orders, and each of them is small. NaN where fewer than half are known.
    """
    with np.errstate(invalid="ignore"):
        share = square / (true + own)
    edges = np.cumsum([len(shaft.orders) for shaft in shafts])[:-1]
    return np.array([_mean_share(part) for part in np.split(share, edges)])


def _mean_share(share: Floats) -> float:
    known = share[np.isfinite(share)]
    if known.size < max(TOGETHER_MIN, share.size / 2):
        return np.nan
    # With the scatter of as many orders as the shaft has.
    mean = 1 - 1 / (9 * known.size)
    return float(mean + (np.cbrt(known.mean()) - mean) * np.sqrt(known.size / share.size))
