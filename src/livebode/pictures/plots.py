"""Curves with bounds on Matplotlib axes, from arrays or responses: Bode plot, Nyquist plot, Nichols chart.

Text and colours that are not specified here follow the settings of the caller's Matplotlib.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, get_args

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.core import PlotKind, Response, Responses, UsageError, decibels, needing
from livebode.pictures.curves import FLOOR_DB, Cloud, Curve, bound_db, bound_deg, circular, near, quantiles
from livebode.pictures.figure import FEW_LINES, alone
from livebode.pictures.ticks import frequency_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from livebode.core import MatrixResponses

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


def plot_responses(
    responses: Responses, kind: PlotKind, *, axes: Any, c: float | None, label: str | None, color: Any,
    front: Response | None = None,
) -> Any:  # fmt: skip
    """For `FrequencyResponse.plot`; `front` is drawn instead of the newest response, and `c` None draws no bound."""
    if kind not in get_args(PlotKind):
        raise UsageError(
            "not-one-of",
            f"{kind!r} is not a kind of plot",
            f"choose {', '.join(get_args(PlotKind))}",
            argument="kind",
            value=kind,
            allowed=list(get_args(PlotKind)),
        )
    panels = _panels(kind, axes)
    response = front or responses.newest()
    if response is not None:
        _draw_responses(kind, panels, responses, response, _curve(response, c, label, color))
    _labels(kind, panels, responses)
    if axes is None and response is not None:
        panels[0].legend(frameon=False, fontsize="small")
    return panels if kind == "bode" else panels[0]


def _panels(kind: PlotKind, axes: Any) -> Any:
    """The axes as an array of two or one; a new figure of pyplot by default, as pandas and xarray do."""
    count = 2 if kind == "bode" else 1
    if axes is None:
        with needing("Matplotlib", "plots", "a picture"):
            from matplotlib import pyplot

        ratios = {"height_ratios": [3, 2]} if count == 2 else {}
        _, panels = pyplot.subplots(
            count, 1, sharex=True, squeeze=False, gridspec_kw=ratios, layout="constrained", figsize=(7.0, 5.2)
        )
        return panels[:, 0]
    given = np.atleast_1d(np.asarray(axes, dtype=object)).ravel()
    if len(given) != count or not all(hasattr(panel, "plot") for panel in given):
        raise UsageError(
            "wrong-shape",
            f"a {kind} plot needs {'two axes, of magnitude and phase' if count == 2 else 'one axes'}, "
            f"and these are {len(given)}",
            f"give those of plt.subplots({count}), or none for a new figure",
            argument="axes",
            value=len(given),
        )
    return given


def _curve(response: Response, c: float | None, label: str | None, color: Any) -> Curve:
    use = response.valid & np.isfinite(response.value) & (response.value != 0)
    # Also without a drawn bound: the phase of a line that may be zero follows the other lines.
    radius = response.bound() if c is None else response.bound(c)
    words = "" if c is None else f"bound: {100 * -np.expm1(-(c**2)):.3g} %"
    value = np.where(use, response.value, np.nan)
    return Curve(response.frequency_hz, value, np.where(use, radius, np.nan), label or response.quantity, words, color)


def _draw_responses(kind: PlotKind, panels: Any, responses: Responses, response: Response, curve: Curve) -> None:
    use = responses.valid & np.isfinite(responses.value) & (responses.value != 0)
    rows = use.any(axis=1)
    cloud = Cloud(np.where(use, responses.value, np.nan)[rows]) if np.count_nonzero(rows) > 1 else None
    if kind == "bode":
        draw_bode(panels[0], panels[1], curve, cloud)
        return
    draw = draw_nyquist if kind == "nyquist" else draw_nichols
    draw(panels[0], curve, cloud, critical=response.quantity == "open loop")


def _labels(kind: PlotKind, panels: Any, responses: Responses) -> None:
    unit = responses.unit
    if kind == "nyquist":
        panels[0].set_xlabel(f"real part in {unit}" if unit else "real part")
        panels[0].set_ylabel(f"imaginary part in {unit}" if unit else "imaginary part")
    else:
        panels[0].set_ylabel(f"magnitude in dB re 1 {unit}" if unit else "magnitude in dB")


def plot_matrix(responses: MatrixResponses, *, axes: Any, c: float | None, label: str | None, color: Any) -> Any:
    """For `MatrixResponses.plot`; `c` None draws no bound."""
    shape = 2 * len(responses.outputs), len(responses.inputs)
    panels = _new_matrix(*shape) if axes is None else np.asarray(axes, dtype=object)
    if panels.shape != shape:
        raise UsageError(
            "wrong-shape",
            f"{shape[0] // 2} outputs and {shape[1]} inputs need axes of shape {shape}, and these have {panels.shape}",
            f"give those of plt.subplots({shape[0]}, {shape[1]}, squeeze=False), or none for a new figure",
            argument="axes",
            value=list(panels.shape),
        )
    for o, output in enumerate(responses.outputs):
        for i, input in enumerate(responses.inputs):
            pair = panels[2 * o : 2 * o + 2, i]
            plot_responses(responses.entry(o, i), "bode", axes=pair, c=c, label=label, color=color)
            pair[0].set_title(f"{input} → {output}", fontsize="medium")
    _outer_labels(panels)
    return panels


def _new_matrix(rows: int, columns: int) -> Any:
    with needing("Matplotlib", "plots", "a picture"):
        from matplotlib import pyplot

    ratios = {"height_ratios": [3, 2] * (rows // 2)}
    size = (2.0 + 3.4 * columns, 1.0 + 1.5 * rows)
    _, panels = pyplot.subplots(
        rows, columns, sharex=True, sharey="row", squeeze=False, gridspec_kw=ratios, layout="constrained", figsize=size
    )
    return panels


def _outer_labels(panels: Any) -> None:
    """Labels at the left and at the bottom only."""
    for inner in panels[:, 1:].ravel():
        inner.set_ylabel("")
    for upper in panels[:-1].ravel():
        upper.set_xlabel("")
