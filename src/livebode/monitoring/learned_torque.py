"""Friction and orders of the healthy axis, as a baseline has them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from livebode.arrays import Floats
from livebode.dataclass import dataclass
from livebode.language import Message
from livebode.monitoring.stretches import SampleSection
from livebode.monitoring.table import STILL, ScheduleTable, WindowRows
from livebode.monitoring.torque_model import StrokeFriction, TorqueModel, TorqueNoise, normal_values, powers, together
from livebode.motion import Shaft

DIRECTIONS = ("forward", "backward")
_WAYS = Message("friction forward"), Message("friction backward")


@dataclass(frozen=True, eq=False)
class LearnedTorque:
    """What friction and orders of a section of 10 s are compared with.

    Attributes
    ----------
    model
        Inertia, friction and shafts.
    middle
        Mean speed of a stroke that divides slow from fast ones; 0: all strokes have about one speed.
    noise
        Of the torque's orders; None without shafts.
    true, usual
        Square of the amplitude of each order of all shafts, and its usual noise in a section, (orders,).
    friction
        Of the friction as a factor of the model's, by direction and by slow and fast strokes.
    orders
        Of `normal_values` of each order, then of all orders of each shaft `together`; None without shafts.
    """

    model: TorqueModel
    middle: float
    noise: TorqueNoise | None
    true: Floats
    usual: Floats
    friction: ScheduleTable
    orders: ScheduleTable | None

    @property
    def tables(self) -> tuple[ScheduleTable, ...]:
        """Tables of friction and orders."""
        return (self.friction,) if self.orders is None else (self.friction, self.orders)

    @property
    def smallest(self) -> dict[str, Any]:
        """Smallest changes of friction in percent, and amplitudes from which on an order is reported, by name."""
        friction, orders = self.friction, self.orders
        percent = dict(zip(friction.names, (100 * friction.accuracy.smallest).round(1).tolist()))
        known = np.isfinite(friction.mean[0, STILL].real)
        sizes: dict[str, Any] = {
            "friction_percent": {name: percent[name] for name, learned in zip(friction.names, known) if learned},
            "orders": {},
            "unit": "" if orders is None else orders.unit,
        }
        if orders is not None:
            amplitude = ((1 + orders.accuracy.smallest) * orders.mean[0, STILL].real) ** 1.5
            each = zip(orders.names[: self.true.size], amplitude.tolist())
            sizes["orders"] = {name: float(f"{size:.3g}") for name, size in each if np.isfinite(size)}
        return sizes

    def rows(self, section: SampleSection, rate_hz: float) -> tuple[WindowRows, ...]:
        """A row for each of `tables`; NaN where a section does not show a component."""
        strokes, windows = self.model.section(section.data[0], section.data[1], rate_hz)
        rows = [_row(friction_values(strokes, self.middle), section)]
        if self.noise is not None:
            square, own = powers(windows, self.noise)
            each = normal_values(square, own, self.true, self.usual)
            whole = together(square, own, self.true, self.model.shafts)
            rows.append(_row(np.concatenate([each, whole]), section))
        return tuple(rows)


def friction_names(middle: float, model: TorqueModel, unit: str) -> tuple[str, ...]:
    """Names of `friction_values`; `unit` is that of the speed."""
    if not middle:
        return _WAYS
    low, high = float(model.speed[0]), float(model.speed[-1])
    spans = [Message("{low:.3g} … {high:.3g}", low=a, high=b) for a, b in ((low, middle), (middle, high))]
    if unit:
        spans = [Message("{span} {unit}", span=span, unit=unit) for span in spans]
    return tuple(Message("{friction} ({span})", friction=way, span=span) for way in _WAYS for span in spans)


def friction_values(strokes: StrokeFriction, middle: float) -> Floats:
    """Mean factor by direction and speed, weighted by the length of the strokes, (components,)."""
    classes = [
        part
        for sign in (1, -1)
        for part in (
            [np.abs(strokes.speed) < middle, np.abs(strokes.speed) >= middle] if middle else [strokes.speed != 0]
        )
        for part in [part & (np.sign(strokes.speed) == sign)]
    ]
    weight = [np.where(part, strokes.samples, 0.0) for part in classes]
    return np.array([column @ strokes.factor / column.sum() if column.any() else np.nan for column in weight])


def order_names(shafts: Sequence[Shaft]) -> tuple[str, ...]:
    """Names of the components of orders: each one, then all of each shaft."""
    each = [
        Message("order {order} of the {shaft}", order=order, shaft=shaft.name)
        for shaft in shafts
        for order in shaft.orders
    ]
    return (*each, *(Message("all orders of the {shaft}", shaft=shaft.name) for shaft in shafts))


def _row(value: Floats, section: SampleSection) -> WindowRows:
    unknown = np.array([np.nan])
    return WindowRows(
        value[np.newaxis].astype(np.complex128), np.zeros((1, value.size)), unknown, unknown,
        np.array([section.time_s]), np.array([section.sample]), np.array([bool(np.isfinite(value).any())]),
    )  # fmt: skip
