"""Torque that an axis needs beside its excitation, and what of it repeats with the angle: one section of a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Block, SignalError
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
