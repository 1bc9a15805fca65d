"""Curves with bounds on Matplotlib axes, from arrays: Bode plot, Nyquist plot, Nichols chart.

Text and colours that are not specified here follow the settings of the caller's Matplotlib.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import decibels
from livebode.pictures.curves import FLOOR_DB, Cloud, Curve, bound_db, bound_deg, circular, near, quantiles
from livebode.pictures.ticks import frequency_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FEW_LINES = 40
"""Up to this many lines each has a marker and an error bar; more are drawn as a band."""
_CLOUD_ALPHA = 0.18
_CLOUD_MAX = 200  # responses
_CORNERS = 72
_REACH = 0.35  # of the range of the values: as far as bounds move the limits


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
        with _without_stretching(magnitude):
            bound(magnitude, f, *bound_db(curve.value, curve.radius), colour, label=curve.bound_label)
        half = bound_deg(curve.value, curve.radius)
        with _without_stretching(phase):
            bound(phase, f, deg - half, deg + half, colour, label=curve.bound_label)
    _scales(magnitude, phase)


def _scales(magnitude: Axes, phase: Axes) -> None:
    from livebode.pictures.scales import free_frequency_axis, phase_axis

    for axes in (magnitude, phase):
        free_frequency_axis(axes)
        axes.grid(True, which="major", linewidth=0.6, alpha=0.5)
    phase_axis(phase.yaxis)
    phase.set_xlabel("frequency in Hz")
    phase.set_ylabel("phase in degrees")


def draw_nyquist(axes: Axes, curve: Curve, cloud: Cloud | None = None, *, critical: bool = False) -> None:
    """Imaginary over real part in the same scale; `critical` marks −1."""
    value = curve.value
    behind = None if cloud is None else (cloud.value.real, cloud.value.imag)
    regions = _circles(value, curve.radius)
    _draw(axes, curve, (value.real, value.imag), regions, behind, same_scale=True)
    for line in (axes.axhline, axes.axvline):
        line(0, color="0.5", linewidth=0.7, zorder=1)
    if critical:
        axes.plot([-1], [0], "+", color="0.5", markersize=11, markeredgewidth=1.6, zorder=6)
    axes.set_aspect("equal", adjustable="datalim")


def draw_nichols(axes: Axes, curve: Curve, cloud: Cloud | None = None, *, critical: bool = False) -> None:
    """Decibels over unwrapped degrees; `critical` marks 0 dB at −180°."""
    from livebode.pictures.scales import phase_axis

    deg = curve.phase_deg
    behind = None
    if cloud is not None:
        behind = near(np.degrees(np.angle(cloud.value)), deg), decibels(cloud.value)
    regions = _nichols_regions(curve.value, curve.radius, deg)
    _draw(axes, curve, (deg, decibels(curve.value)), regions, behind)
    if critical:
        axes.plot([-180], [0], "+", color="0.5", markersize=11, markeredgewidth=1.6, zorder=6)
    phase_axis(axes.xaxis)
    axes.set_xlabel("phase in degrees")


def _draw(
    axes: Axes,
    curve: Curve,
    xy: tuple[Floats, Floats],
    regions: list[Floats],
    behind: tuple[Floats, Floats] | None,
    same_scale: bool = False,
) -> None:
    """The curve, its regions, the dots of the cloud behind it, and the frequencies of its ends."""
    from matplotlib.collections import PolyCollection

    line = axes.plot(*xy, marker="o", markersize=3.5, linewidth=1.0, color=curve.color, label=curve.label, zorder=5)[0]
    look: dict[str, Any] = {"facecolor": line.get_color(), "linewidth": 0}
    if behind is not None:
        step = -(-len(behind[0]) // _CLOUD_MAX)
        axes.plot(
            *(part[::step].ravel() for part in behind), ".", color=line.get_color(), alpha=0.4, markersize=3, zorder=2,
            rasterized=True,
        )  # fmt: skip
    if curve.bounded:
        known = [region for region in regions if np.isfinite(region).all()]
        with _without_stretching(axes, same_scale=same_scale):
            axes.add_collection(
                PolyCollection(known, alpha=0.25, label=curve.bound_label, zorder=3, **look), autolim=False
            )
            axes.update_datalim(np.concatenate(known))
    axes.grid(True, linewidth=0.6, alpha=0.5)
    drawn = np.flatnonzero(np.isfinite(xy[0]) & np.isfinite(xy[1]))
    for i in drawn[[0, -1]] if drawn.size else ():
        axes.annotate(
            f"{frequency_label(curve.frequency_hz[i])} Hz", (xy[0][i], xy[1][i]), (5, 4), textcoords="offset points",
            fontsize="small", color=line.get_color(), zorder=6,
        )  # fmt: skip


def band(axes: Axes, f: Floats, low: Floats, high: Floats, colour: Any, alpha: float, **more: Any) -> None:
    """Fill the range between neighbouring lines; a line without neighbours gets a bar, to be visible."""
    axes.fill_between(f, low, high, color=colour, alpha=alpha, linewidth=0, zorder=2, **more)
    single = alone(low + high)
    if single.any():
        axes.vlines(f[single], low[single], high[single], color=colour, alpha=alpha * 1.5, linewidth=8, zorder=2)


def bound(axes: Axes, f: Floats, low: Floats, high: Floats, colour: Any, alpha: float = 0.28, **more: Any) -> None:
    """Error bars at few lines, a band at many; nothing where an end is not known."""
    if len(f) > FEW_LINES:
        band(axes, f, low, high, colour, alpha, **more)
        return
    known = np.isfinite(low) & np.isfinite(high)
    axes.vlines(f[known], low[known], high[known], color=colour, linewidth=1.6, zorder=4, **more)


def alone(values: Floats) -> NDArray[np.bool_]:
    """Known values without a known neighbour: a line plot would not show them."""
    known = np.isfinite(values)
    beside = np.zeros_like(known)
    beside[1:] |= known[:-1]
    beside[:-1] |= known[1:]
    return known & ~beside


def _circles(value: Complex, radius: Floats) -> list[Floats]:
    """Each circle as a polygon of (real, imaginary), (corners, 2)."""
    turn = np.exp(2j * np.pi * np.arange(_CORNERS) / _CORNERS)
    return [np.column_stack([corners.real, corners.imag]) for corners in value[:, None] + radius[:, None] * turn]


def _nichols_regions(value: Complex, radius: Floats, phase_deg: Floats) -> list[Floats]:
    """The image of each circle as a polygon of (degrees, dB), (corners, 2), around its `phase_deg`.

    A circle that contains the origin has every phase, and reaches down to `FLOOR_DB`.
    """
    turn = np.exp(2j * np.pi * np.arange(_CORNERS) / _CORNERS)
    regions = []
    for centre, reach, deg in zip(value, radius, phase_deg):
        if reach < abs(centre):
            around = 1 + reach / abs(centre) * turn
            regions.append(np.column_stack([deg + np.degrees(np.angle(around)), decibels(centre * around)]))
            continue
        away = np.linspace(-np.pi, np.pi, _CORNERS)
        far = abs(centre) * np.cos(away) + np.sqrt(reach**2 - (abs(centre) * np.sin(away)) ** 2)
        top = np.column_stack([deg + np.degrees(away), np.maximum(decibels(far), FLOOR_DB)])
        regions.append(np.concatenate([top, [[deg + 180, FLOOR_DB], [deg - 180, FLOOR_DB]]]))
    return regions


@contextmanager
def _without_stretching(axes: Axes, *, same_scale: bool = False) -> Iterator[None]:
    """What is drawn within moves the limits by a third of the present range at most: a wide bound hides no curve.

    With `same_scale` the larger of the two ranges counts for both.
    """
    before = axes.dataLim.frozen()
    yield
    after = axes.dataLim.frozen()
    size = np.asarray(before.size)
    room = _REACH * (size.max() if same_scale else size)
    axes.dataLim.set_points(
        np.array([np.maximum(after.min, before.min - room), np.minimum(after.max, before.max + room)])
    )
    axes.autoscale_view()
