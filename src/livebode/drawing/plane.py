"""Curves over the complex plane: Nyquist plot and Nichols chart."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from livebode.arrays import Floats
from livebode.drawing._bounds import circles, nichols_regions, without_stretching
from livebode.drawing._curve import Cloud, Curve
from livebode.drawing._curves import decibels, near
from livebode.drawing.scales import phase_axis
from livebode.drawing.ticks import frequency_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_CLOUD_MAX = 200  # responses


def draw_nyquist(axes: Axes, curve: Curve, cloud: Cloud | None = None, *, critical: bool = False) -> None:
    """Imaginary over real part in the same scale; `critical` marks −1."""
    value = curve.value
    behind = None if cloud is None else (cloud.value.real, cloud.value.imag)
    regions = circles(value, curve.radius)
    _draw(axes, curve, (value.real, value.imag), regions, behind, same_scale=True)
    for line in (axes.axhline, axes.axvline):
        line(0, color="0.5", linewidth=0.7, zorder=1)
    if critical:
        axes.plot([-1], [0], "+", color="0.5", markersize=11, markeredgewidth=1.6, zorder=6)
    axes.set_aspect("equal", adjustable="datalim")


def draw_nichols(axes: Axes, curve: Curve, cloud: Cloud | None = None, *, critical: bool = False) -> None:
    """Decibels over unwrapped degrees; `critical` marks 0 dB at −180°."""
    deg = curve.phase_deg
    behind = None
    if cloud is not None:
        behind = near(np.degrees(np.angle(cloud.value)), deg), decibels(cloud.value)
    regions = nichols_regions(curve.value, curve.radius, deg)
    _draw(axes, curve, (deg, decibels(curve.value)), regions, behind)
    if critical:
        axes.plot([-180], [0], "+", color="0.5", markersize=11, markeredgewidth=1.6, zorder=6)
    phase_axis(axes.xaxis)
    axes.set_xlabel("phase in degrees")


def _draw(
    axes: Axes,
    curve: Curve,
    at: tuple[Floats, Floats],
    regions: list[Floats],
    behind: tuple[Floats, Floats] | None,
    same_scale: bool = False,
) -> None:
    """The curve, its regions, the dots of the cloud behind it, and the frequencies of its ends."""
    from matplotlib.collections import PolyCollection

    line = axes.plot(*at, marker="o", markersize=3.5, linewidth=1.0, color=curve.color, label=curve.label, zorder=5)[0]
    look: dict[str, Any] = {"facecolor": line.get_color(), "linewidth": 0}
    if behind is not None:
        step = -(-len(behind[0]) // _CLOUD_MAX)
        axes.plot(
            *(part[::step].ravel() for part in behind), ".", color=line.get_color(), alpha=0.4, markersize=3, zorder=2,
            rasterized=True,
        )  # fmt: skip
    if curve.bounded:
        known = [region for region in regions if np.isfinite(region).all()]
        with without_stretching(axes, same_scale=same_scale):
            axes.add_collection(
                PolyCollection(known, alpha=0.25, label=curve.bound_label, zorder=3, **look), autolim=False
            )
            axes.update_datalim(np.concatenate(known))
    axes.grid(True, linewidth=0.6, alpha=0.5)
    drawn = np.flatnonzero(np.isfinite(at[0]) & np.isfinite(at[1]))
    for i in drawn[[0, -1]] if drawn.size else ():
        axes.annotate(
            f"{frequency_label(curve.frequency_hz[i])} Hz", (at[0][i], at[1][i]), (5, 4), textcoords="offset points",
            fontsize="small", color=line.get_color(), zorder=6,
        )  # fmt: skip
