"""The picture of orders: their amplitudes with bounds, and the torque over one turn."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from livebode.pictures import drawing, heading, new_figure, save, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from livebode_control.strokes.shaft_orders import ShaftOrders

_POINTS = 1000


class OrdersOfShafts(Protocol):
    """The part of an order report that is drawn."""

    @property
    def shafts(self) -> Sequence[ShaftOrders]: ...
    @property
    def unit(self) -> str: ...


def save_orders_picture(report: OrdersOfShafts, path: Path, *, title: str = "", dark: bool = False) -> Path:
    """Write the picture."""
    return save(orders_figure(report, title=title, dark=dark), path, style(dark))


def orders_figure(report: OrdersOfShafts, *, title: str = "", dark: bool = False) -> Figure:
    """A row for each shaft: amplitudes with 95 % bounds, filled where an order is seen; the torque over one turn."""
    look, rows = style(dark), len(report.shafts)
    unit = f", {report.unit}" if report.unit else ""
    with drawing(look):
        figure = new_figure(11.0, 1.5 + 2.8 * rows)
        width, height = figure.get_size_inches()
        grid = figure.add_gridspec(
            rows, 2, width_ratios=[1.5, 1.0], left=0.85 / width, right=0.985, top=1 - 1.0 / height,
            bottom=0.6 / height, wspace=0.24, hspace=0.4,
        )  # fmt: skip
        heading(figure, look, title or "Orders", "95 % bounds · filled: seen", 0.85 / width)
        for row, shaft in enumerate(report.shafts):
            left, right = figure.add_subplot(grid[row, 0]), figure.add_subplot(grid[row, 1])
            orders, bound = np.array(shaft.shaft.orders), shaft.bound()
            for chosen, face in ((shaft.seen, look.run), (~shaft.seen, look.paper)):
                left.errorbar(
                    orders[chosen], shaft.amplitude[chosen], bound[chosen], fmt="o", color=look.run,
                    markerfacecolor=face, markersize=4, capsize=2, linewidth=1.0,
                )  # fmt: skip
            left.set_ylim(bottom=0.0)
            left.set_xlabel(f"order, cycles a turn of the {shaft.shaft.name}")
            left.set_ylabel(f"amplitude{unit}")
            angle = np.linspace(0, 2 * np.pi, _POINTS)
            right.plot(np.degrees(angle), shaft.torque(angle), color=look.newest, linewidth=1.2)
            right.set_xlim(0, 360)
            right.set_xticks([0, 90, 180, 270, 360])
            right.set_xlabel(f"angle of the {shaft.shaft.name}, °")
            right.set_ylabel(f"torque{unit}")
    return figure
