"""A Bode plot on two axes: magnitude and unwrapped phase over logarithmic frequency."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from livebode.drawing._bounds import without_stretching
from livebode.drawing._curve import Cloud, Curve
from livebode.drawing._curves import bound_db, bound_deg, circular, decibels, near, quantiles
from livebode.drawing.panel import FEW_LINES, alone, band, bound
from livebode.drawing.scales import free_frequency_axis, phase_axis

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_CLOUD_ALPHA = 0.18


def draw_bode(magnitude: Axes, phase: Axes, curve: Curve, cloud: Cloud | None = None) -> None:
    """Draw the curve with its bound, and behind it the range of 5–95 % of the cloud at each line."""
    f, deg = curve.frequency_hz, curve.phase_deg
    look: dict[str, Any] = {"marker": "o", "markersize": 3.5, "linewidth": 1.0} if len(f) <= FEW_LINES else {}
    db = decibels(curve.value)
    colour = magnitude.plot(f, db, color=curve.color, label=curve.label, zorder=5, **look)[0].get_color()
    for axes, values in ((magnitude, db), (phase, deg)):
        single = alone(values) & (len(f) > FEW_LINES)
        axes.plot(f[single], values[single], "o", color=colour, markersize=3, zorder=5)
    phase.plot(f, deg, color=colour, zorder=5, **look)
    if cloud is not None:
        middle, spread = circular(cloud.value)
        for axes, low, _, high in (
            (magnitude, *quantiles(decibels(cloud.value))),
            (phase, *(near(middle, deg) + spread - spread[1])),
        ):
            band(axes, f, low, high, colour, _CLOUD_ALPHA, label=cloud.label)
    if curve.bounded:
        with without_stretching(magnitude):
            bound(magnitude, f, *bound_db(curve.value, curve.radius), colour, label=curve.bound_label)
        half = bound_deg(curve.value, curve.radius)
        with without_stretching(phase):
            bound(phase, f, deg - half, deg + half, colour, label=curve.bound_label)
    _scales(magnitude, phase)


def _scales(magnitude: Axes, phase: Axes) -> None:
    for axes in (magnitude, phase):
        free_frequency_axis(axes)
        axes.grid(True, which="major", linewidth=0.6, alpha=0.5)
    phase_axis(phase.yaxis)
    phase.set_xlabel("frequency in Hz")
    phase.set_ylabel("phase in degrees")
