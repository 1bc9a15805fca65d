"""The orders of an axis in a recording: torque that repeats with the angle of its shafts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from livebode.arrays import Floats
from livebode.core import Block, SignalError, UsageError
from livebode.dataclass import dataclass
from livebode.motion import (
    SLOWEST,
    FrictionCurve,
    Shaft,
    SmoothKernel,
    SmoothMotion,
    Stroke,
    angle_windows,
    applied,
    friction_curve,
    strokes_of,
    usable_windows,
)
from livebode_control.strokes.line_subtraction import without_lines
from livebode_control.strokes.motion_samples import MotionSamples
from livebode_control.strokes.order_changes import OrderChange, order_changes
from livebode_control.strokes.position_errors import PositionErrors, position_errors
from livebode_control.strokes.shaft_orders import ShaftOrders, shaft_orders
from livebode_control.strokes.time_lines import TimeLine, time_lines

_SAME_LINE = 0.02  # of a frequency, within which a line is one that was specified


@dataclass(frozen=True, eq=False)
class OrderReport:
    """Orders of an axis.

    Attributes
    ----------
    shafts
        The orders of each shaft.
    errors
        Errors of the measured angle, of each shaft.
    friction
        The friction and the inertia with which the torque was computed.
    strokes
        Number of strokes.
    speed_hz
        Slowest and fastest turns of the motor in a window, per second.
    lines_hz
        Lines of the time that were specified.
    subtracted_hz
        Those of them that were told from the orders and subtracted; windows that meet the others are left out.
    found_lines
        Lines of the time that nobody specified, and that were found and left out.
    motion
        The samples.
    unit
        Of the torque.
    """

    shafts: list[ShaftOrders]
    errors: list[PositionErrors]
    friction: FrictionCurve
    strokes: int
    speed_hz: tuple[float, float]
    lines_hz: Floats
    subtracted_hz: Floats
    found_lines: list[TimeLine]
    motion: MotionSamples
    unit: str

    @property
    def zero_known(self) -> bool:
        """Whether phases count from the zero of a measured angle; else from the first sample."""
        return self.motion.angle is not None or self.motion.kind == "position"

    def changes_from(self, baseline: OrderReport, *, phases: bool = True) -> list[OrderChange]:
        """Each order compared with that of an earlier recording; phases only if both angles have the same zero."""
        same_zero = phases and self.zero_known and baseline.zero_known
        return order_changes(baseline.shafts, self.shafts, phases=same_zero)

    def plain(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {
            "shafts": [shaft.plain() for shaft in self.shafts],
            "position_errors": [row for error in self.errors for row in error.plain()],
            "unit": self.unit,
            "strokes": self.strokes,
            "turns_per_s": list(self.speed_hz),
            "lines_hz": self.lines_hz.tolist(),
            "subtracted_lines_hz": self.subtracted_hz.tolist(),
            "found_lines": [
                {"frequency_hz": line.frequency_hz, "amplitude": line.amplitude} for line in self.found_lines
            ],
            "inertia": self.friction["inertia"],
            "inertia_bound": float(self.friction.bound()[self.friction.index("inertia")]),
            "input": self.motion.input,
            "output": self.motion.output,
        }


def orders_of(
    motion: MotionSamples,
    shafts: Sequence[Shaft],
    *,
    angle: str | None = None,
    turn: float | None = None,
    lines_hz: Floats | None = None,
    highest_hz: float = np.inf,
    band_hz: float = 5.0,
) -> OrderReport:
    """Torque that acts on the axis beside its input, over the angle of its shafts.

    The torque is J·a + Fv·v + friction − u, with inertia and friction from the same samples (`friction_curve`). It is
    that of one mass: use `highest_hz` below the antiresonance of an axis with a belt or a coupling.

    Parameters
    ----------
    motion
        Samples, whose output is the motor's angle or speed.
    shafts
        The shafts and their orders.
    angle
        Channel of the motor's angle. Default: the output, or its integral if it is a velocity; the phase then counts
        from the first sample.
    turn
        Angle of one turn of the motor, in rad, or in the unit of a channel that has no SI unit. Default: 2π.
    lines_hz
        Lines of the time, such as those of an excitation that runs at the same time. Those that the strokes tell from
        the orders are subtracted (`without_lines`); windows that meet the others are left out.
    highest_hz
        Highest frequency of an order.
    band_hz
        Band of the kernel with which friction and inertia are found (`friction_curve`). The orders that are seen are
        subtracted first: a ripple of slow strokes within the band would make the inertia too small.

    Raises
    ------
    SignalError
        If the strokes are too short, or do not show friction and inertia.
    UsageError
        If an argument is out of its range.
    """
    per_turn = 2 * np.pi if turn is None else turn
    if not (np.isfinite(per_turn) and per_turn > 0):
        raise UsageError(
            "out-of-range", f"{turn=} is not a positive number", "give the units of the angle in one turn",
            argument="turn", value=turn,
        )  # fmt: skip
    known = np.zeros(0) if lines_hz is None else np.asarray(lines_hz, dtype=np.float64)
    _check_frequencies(known, highest_hz)
    search = _Search(motion, shafts, _angle(motion, angle) * 2 * np.pi / per_turn, known, highest_hz)
    smooth = SmoothMotion.of(motion.block, motion.input, motion.output, motion.kind, band_hz, None)
    slowest = _slowest(smooth.velocity)
    curve = search.friction(motion.block, band_hz, slowest)
    # The steps of the friction at reversals make the inertia depend on a delay of the input.
    delayed = search.friction(search.one_sample_later(), band_hz, slowest)
    inertia_per_s = (delayed["inertia"] - curve["inertia"]) * motion.block.rate_hz
    search_result = search.result(curve, inertia_per_s)
    if any(shaft.seen.any() for shaft in search_result.shafts):
        curve = search.friction(search.without_ripple(search_result.shafts), band_hz, slowest)
        search_result = search.result(curve, inertia_per_s)
    return search_result


def _check_frequencies(lines_hz: Floats, highest_hz: float) -> None:
    """UsageError for a line of the time, or a highest frequency, that is not positive; the highest may be infinite."""
    for line in lines_hz[~(np.isfinite(lines_hz) & (lines_hz > 0))]:
        raise UsageError(
            "out-of-range", f"the line {line:g} Hz is not a positive frequency", "write frequencies in Hz: 20,40,50",
            argument="time_lines", value=float(line),
        )  # fmt: skip
    if not highest_hz > 0:
        raise UsageError(
            "out-of-range", f"{highest_hz=} is not a positive number", "choose a frequency in Hz",
            argument="highest_hz", value=highest_hz,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Search:
    """What a search for orders needs beside the friction; the angle is that of the motor in rad, (samples,)."""

    motion: MotionSamples
    shafts: Sequence[Shaft]
    angle: Floats
    known_hz: Floats
    highest_hz: float

    def friction(self, block: Block, band_hz: float, slowest: float) -> FrictionCurve:
        """Friction and inertia from these samples of the axis."""
        motion = self.motion
        return friction_curve(
            block, input=motion.input, output=motion.output, kind=motion.kind, band_hz=band_hz, slowest=slowest
        )

    def result(self, curve: FrictionCurve, inertia_per_s: float) -> OrderReport:
        """The orders with this friction and inertia, and the derivative of the inertia by a delay of the input."""
        motion, rate_hz = self.motion, self.motion.block.rate_hz
        kernel = SmoothKernel.sharpest(rate_hz)
        signals, speed = _signals(motion, curve, kernel)
        inner = slice(kernel.reach, len(motion.block) - kernel.reach)
        limit = min(self.highest_hz, kernel.most_hz)
        low = self.known_hz <= limit
        strokes = strokes_of(self.angle[inner], speed, signals, rate_hz, _slowest(speed))
        strokes, meeting = without_lines(strokes, self.shafts, self.known_hz[low])
        remaining = np.concatenate([meeting, self.known_hz[~low]])

        def shaft_found(shaft: Shaft, lines: Floats) -> tuple[ShaftOrders, PositionErrors, list[float]]:
            windows = angle_windows(strokes, shaft)
            middle = (windows.slowest + windows.fastest)[:, np.newaxis] / 2 * np.array(shaft.orders)
            value = windows.value / kernel.left(middle)
            extra = float(curve.sigma[curve.index("inertia")]) * np.abs(np.nanmean(value[1], axis=0))
            speeds = [float(windows.slowest.min()) / shaft.turns, float(windows.fastest.max()) / shaft.turns]
            use, _ = usable_windows(windows, shaft, lines, limit)
            errors = position_errors(windows, shaft, value[0], use, curve["inertia"])
            per_delay_s = value[2] + inertia_per_s * value[1]
            return shaft_orders(windows, shaft, value[0], extra, per_delay_s, lines, limit), errors, speeds

        results = [shaft_found(shaft, remaining) for shaft in self.shafts]
        lines = _unknown_lines(strokes, [orders for orders, _, _ in results], self.known_hz, limit, kernel)
        if lines:
            away = np.concatenate([remaining, [line.frequency_hz for line in lines]])
            results = [shaft_found(shaft, away) for shaft in self.shafts]
        speeds = [speed for _, _, both in results for speed in both]
        return OrderReport(
            shafts=[orders for orders, _, _ in results],
            errors=[error for _, error, _ in results],
            friction=curve,
            strokes=len(strokes),
            speed_hz=(min(speeds), max(speeds)),
            lines_hz=self.known_hz,
            subtracted_hz=np.setdiff1d(self.known_hz, remaining),
            found_lines=lines,
            motion=motion,
            unit=motion.block.channels[motion.block.index(motion.input)].unit,
        )

    def one_sample_later(self) -> Block:
        """The samples with a later input."""
        block = self.motion.block
        data = block.data.copy()
        row = block.index(self.motion.input)
        data[row, 1:] = block.data[row, :-1]
        return replace(block, data=data)

    def without_ripple(self, shafts: list[ShaftOrders]) -> Block:
        """The samples as the axis would need them without the orders that are seen.

        In slow motion a ripple is within the band of the friction, and moves the axis: its acceleration is then
        correlated with what the regression takes for noise, so that the inertia is too small.
        """
        block = self.motion.block
        data = block.data.copy()
        data[block.index(self.motion.input)] += sum(orders.torque(self.angle * orders.shaft.turns) for orders in shafts)
        return replace(block, data=data)


def _unknown_lines(
    strokes: list[Stroke], shafts: list[ShaftOrders], known: Floats, highest_hz: float, kernel: SmoothKernel
) -> list[TimeLine]:
    """Lines of the time in what the orders leave, without those that are known."""
    rests = [
        replace(
            stroke, torque=stroke.torque[:1] - sum(shaft.torque(stroke.angle * shaft.shaft.turns) for shaft in shafts)
        )
        for stroke in strokes
    ]
    seen = [
        order * orders.shaft.turns
        for orders in shafts
        for order, is_seen in zip(orders.shaft.orders, orders.seen)
        if is_seen
    ]
    return [
        TimeLine(line.frequency_hz, line.amplitude / float(kernel.left(np.array(line.frequency_hz))))
        for line in time_lines(rests, highest_hz, seen)
        if not np.any(np.abs(known - line.frequency_hz) < _SAME_LINE * line.frequency_hz)
    ]


def _slowest(speed: Floats) -> float:
    """Speed from which on an axis counts as moving."""
    return SLOWEST * float(np.max(np.abs(speed)))


def _signals(motion: MotionSamples, curve: FrictionCurve, kernel: SmoothKernel) -> tuple[Floats, Floats]:
    """Torque beside the input, acceleration and rate of the input, (3, samples), and speed, at the inner samples."""
    u, y = applied(motion.block[motion.input]), motion.block[motion.output]
    order = 0 if motion.kind == "velocity" else 1
    speed, acceleration = kernel.smooth(y, order), kernel.smooth(y, order + 1)
    friction, _ = curve.at(speed)
    remainder = curve["inertia"] * acceleration + friction + curve["offset"] - kernel.smooth(u)
    return np.stack([remainder, acceleration, kernel.smooth(u, 1)]), speed


def _angle(motion: MotionSamples, angle: str | None) -> Floats:
    if angle is None:
        y = motion.block[motion.output]
        if motion.kind == "position":
            return y
        return np.asarray((np.cumsum(y) - y / 2) / motion.block.rate_hz)
    angles = motion.block[angle]
    if not np.ptp(angles) > 0:
        raise SignalError(
            "channel-constant", f"the angle {angle!r} is constant", "name the channel of the motor's angle",
            channel=angle,
        )  # fmt: skip
    return angles
