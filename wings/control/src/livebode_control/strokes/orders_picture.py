"""The picture of orders: their amplitudes with bounds, and the torque over one turn."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from livebode.pictures import (
    ABOVE,
    BELOW,
    LIGHT,
    Bars,
    Dots,
    Entry,
    Figure,
    Panel,
    Trace,
    phase_scale,
    room,
    save_svg,
    scale_around,
)

if TYPE_CHECKING:
    from livebode_control.strokes.shaft_orders import ShaftOrders

_POINTS = 1000
_HEIGHT = 150.0


class OrdersOfShafts(Protocol):
    """The part of an order report that is drawn."""

    @property
    def shafts(self) -> Sequence[ShaftOrders]: ...
    @property
    def unit(self) -> str: ...


def save_orders_picture(report: OrdersOfShafts, path: Path, *, title: str = "") -> Path:
    """Write the picture."""
    return save_svg(orders_figure(report, title=title), path)


def orders_figure(report: OrdersOfShafts, *, title: str = "") -> Figure:
    """Of each shaft: amplitudes with 95 % bounds, filled where an order is seen; below, the torque over one turn."""
    unit = f", {report.unit}" if report.unit else ""
    panels: list[Panel] = []
    top = 0.0
    for shaft in report.shafts:
        one = ABOVE + _HEIGHT + BELOW
        panels += [_amplitudes(shaft, unit, top + ABOVE), _torque(shaft, unit, top + one + ABOVE)]
        top += 2 * one
    key = Entry("seen", LIGHT.run, "dot"), Entry("not seen", LIGHT.run, "ring")
    return Figure(title or "Orders", ("95 % bounds",), key, panels, top)


def _amplitudes(shaft: ShaftOrders, unit: str, top: float) -> Panel:
    orders, bound = np.array(shaft.shaft.orders, dtype=float), shaft.bound()
    y = scale_around([shaft.amplitude + bound], f"amplitude{unit}", low=0.0)
    x = scale_around([orders], f"order, cycles a turn of the {shaft.shaft.name}")
    low, high, seen = shaft.amplitude - bound, shaft.amplitude + bound, shaft.seen
    marks = (
        Bars("bound", orders, low, high, LIGHT.run, 1.2),
        Dots("seen", orders[seen], shaft.amplitude[seen], LIGHT.run, 5.5),
        Dots("not-seen", orders[~seen], shaft.amplitude[~seen], LIGHT.run, 5.5, "ring"),
    )
    left = room(y)
    return Panel(left, top, 588.0 - left, _HEIGHT, x, y, marks)


def _torque(shaft: ShaftOrders, unit: str, top: float) -> Panel:
    angle = np.linspace(0, 2 * np.pi, _POINTS)
    torque = shaft.torque(angle)
    y = scale_around([torque], f"torque{unit}")
    x = phase_scale(0.0, 360.0, f"angle of the {shaft.shaft.name}, °")
    left = room(y)
    return Panel(
        left, top, 588.0 - left, _HEIGHT, x, y, [Trace("torque", np.degrees(angle), torque, LIGHT.newest, 1.2)]
    )
