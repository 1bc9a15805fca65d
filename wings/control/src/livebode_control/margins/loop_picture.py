"""The picture of a loop: Bode plot of L with its crossovers, and the Nyquist plot with the circle of Ms."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from livebode.analysis import Margins, OpenLoop
from livebode.arrays import Complex, Floats
from livebode.core import INTERVAL_FACTOR, Responses
from livebode.fitting import Fit
from livebode.language import number, tr, worded
from livebode.pictures import Style, drawing, heading, new_figure, plain, save, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_POINTS = 1200
_DRAWS = 100  # of the fit's parameters, for the band
_LOWEST_DEG = -460.0  # below it only the delay acts
_REACH = 2.2  # of the Nyquist plot


class LoopCurves(Protocol):
    """The part of a loop report that is drawn."""

    @property
    def fit(self) -> Fit: ...
    @property
    def loop(self) -> OpenLoop: ...
    @property
    def margins(self) -> Margins: ...
    @property
    def responses(self) -> Responses: ...


def save_loop_picture(
    curves: LoopCurves, directory: str | PathLike[str], *, title: str = "", dark: bool = False
) -> Path:
    """Write margins.png to an existing directory."""
    return save(loop_figure(curves, title=title, dark=dark), Path(directory) / "margins.png", style(dark))


def loop_figure(curves: LoopCurves, *, title: str = "", dark: bool = False, width_in: float = 12.0) -> Figure:
    """|L| and its phase over frequency beside the Nyquist plot, from the fit with a 95 % band.

    Dots are the measured lines, F·G, with 95 % bounds. Open diamonds mark |L| = 1 and squares negative L, if a margin
    was computed there. Beyond the lines the curve is dashed: it is from the model only.
    """
    look = style(dark)
    f = np.geomspace(curves.fit.band_hz[0] / 4, curves.loop.rate_hz / 2, _POINTS)
    value, low, high = _curves(curves, f)
    with drawing(look):
        figure = new_figure(width_in, 6.4 * (0.5 + width_in / 24))
        height = figure.get_size_inches()[1]
        grid = figure.add_gridspec(
            2, 2, width_ratios=[1.25, 1], height_ratios=[3, 2], left=0.78 / width_in, right=0.985,
            top=1 - 1.15 / height, bottom=0.55 / height, hspace=0.09, wspace=0.17,
        )  # fmt: skip
        heading(figure, look, title or tr("Loop"), _facts(curves), 0.78 / width_in)
        magnitude = figure.add_subplot(grid[0, 0])
        phase = figure.add_subplot(grid[1, 0], sharex=magnitude)
        nyquist = figure.add_subplot(grid[:, 1])
        _bode(magnitude, phase, look, curves, f, (value, low, high))
        for axes in (magnitude, phase):
            axes.yaxis.set_label_coords(-0.98 / width_in, 0.5)
        _nyquist(nyquist, look, curves, f, value)
        _legend(figure, look, 0.78 / width_in)
    return figure


def _curves(loop_curves: LoopCurves, f: Floats) -> tuple[Complex, tuple[Floats, Floats], tuple[Floats, Floats]]:
    """L of the fit, and (dB, degrees) at both ends of its 95 % band."""
    values = loop_curves.fit.parameters.value[:1]
    covariance = loop_curves.fit.parameters.covariance[0]
    size, turned = np.linalg.eigh(covariance)
    drawn = np.random.default_rng(0).standard_normal((_DRAWS, len(size))) * np.sqrt(size.clip(0)) @ turned.T
    value = loop_curves.loop.at(values, f)[0]
    around = loop_curves.loop.at(values + drawn, f) / value
    db = INTERVAL_FACTOR * np.std(20 * np.log10(np.abs(around)), axis=0)
    deg = INTERVAL_FACTOR * np.std(np.degrees(np.angle(around)), axis=0)
    middle_db, middle_deg = 20 * np.log10(np.abs(value)), _degrees(value)
    return value, (middle_db - db, middle_deg - deg), (middle_db + db, middle_deg + deg)


def _degrees(value: Complex) -> Floats:
    """Unwrapped along the curve, the first in (−270°, 90°]."""
    turned = np.degrees(np.unwrap(np.angle(value)))
    return np.asarray(turned - 360 * np.ceil((turned[0] - 90) / 360))


def _bode(
    magnitude: Axes, phase: Axes, look: Style, loop_curves: LoopCurves, f: Floats, curves: tuple[Complex, Any, Any]
) -> None:
    from livebode.pictures import frequency_axis

    value, low, high = curves
    inside = (f >= loop_curves.fit.band_hz[0]) & (f <= loop_curves.fit.band_hz[1])
    for axes, middle, i in ((magnitude, 20 * np.log10(np.abs(value)), 0), (phase, _degrees(value), 1)):
        axes.fill_between(f, low[i], high[i], color=look.run, alpha=0.25, linewidth=0, zorder=2)
        axes.plot(f, middle, color=look.run, linewidth=1.0, dashes=(4, 2), zorder=3)
        axes.plot(f[inside], middle[inside], color=look.run, linewidth=1.6, zorder=3)
        plain(axes)
    measured_hz, measured, bound = _measured(loop_curves)
    size = np.abs(measured)
    error = np.clip(bound / size, 0, 0.999)
    db = 20 * np.log10(np.stack([1 - error, 1 + error])) + 20 * np.log10(size)
    magnitude.vlines(measured_hz, *db, color=look.newest, linewidth=1.4, zorder=4)
    magnitude.plot(measured_hz, 20 * np.log10(size), "o", markersize=3.5, color=look.newest, zorder=5)
    near = np.interp(measured_hz, f, _degrees(value))
    turned = np.degrees(np.angle(measured))
    turned += 360 * np.rint((near - turned) / 360)
    half = np.degrees(np.arcsin(error))
    phase.vlines(measured_hz, turned - half, turned + half, color=look.newest, linewidth=1.4, zorder=4)
    phase.plot(measured_hz, turned, "o", markersize=3.5, color=look.newest, zorder=5)
    magnitude.axhline(0, color=look.muted, linewidth=0.9)
    for k in range(int(np.min(_degrees(value)) // 360) - 1, 2):
        phase.axhline(-180 + 360 * k, color=look.muted, linewidth=0.9)
    for marker, where in _marked(loop_curves):
        level = loop_curves.loop.at(loop_curves.fit.parameters.value[:1], where)[0]
        magnitude.plot(where, 20 * np.log10(np.abs(level)), marker, markersize=9, markerfacecolor="none",
                       markeredgecolor=look.ink, markeredgewidth=1.6, zorder=6)  # fmt: skip
        phase.plot(where, np.interp(where, f, _degrees(value)), marker, markersize=9, markerfacecolor="none",
                   markeredgecolor=look.ink, markeredgewidth=1.6, zorder=6)  # fmt: skip
    magnitude.set_ylabel(tr("|L| in dB"))
    phase.set_ylabel(tr("phase of L in degrees"))
    phase.set_xlabel(tr("frequency in Hz"))
    bottom, top = np.min(_degrees(value)) - 20, np.max(_degrees(value)) + 20
    phase.set_ylim(max(bottom, _LOWEST_DEG), top)
    phase.set_yticks(np.arange(np.ceil(max(bottom, _LOWEST_DEG) / 90) * 90, top, 90))
    for axes in (magnitude, phase):
        frequency_axis(axes, round_numbers(f[0], f[-1]), labels=axes is phase)


def round_numbers(low_hz: float, high_hz: float) -> Floats:
    """Both ends, and 1, 2 and 5 of each decade between them."""
    decades = np.arange(np.floor(np.log10(low_hz)), np.ceil(np.log10(high_hz)) + 1)
    round_ones = np.outer(10.0**decades, [1, 2, 5]).ravel()
    inside = round_ones[(round_ones > 1.2 * low_hz) & (round_ones < high_hz / 1.2)]
    return np.concatenate([[low_hz], inside, [high_hz]])


def _nyquist(axes: Axes, look: Style, curves: LoopCurves, f: Floats, value: Complex) -> None:
    """The curve near −1, the circle that touches it, and the measured lines."""
    from matplotlib.patches import Circle

    inside = (f >= curves.fit.band_hz[0]) & (f <= curves.fit.band_hz[1])
    axes.axhline(0, color=look.muted, linewidth=0.8)
    axes.axvline(0, color=look.muted, linewidth=0.8)
    axes.add_patch(Circle((0, 0), 1.0, fill=False, edgecolor=look.muted, linewidth=0.9, linestyle=":"))
    axes.plot(value.real, value.imag, color=look.run, linewidth=1.0, dashes=(4, 2), zorder=3)
    axes.plot(np.where(inside, value.real, np.nan), value.imag, color=look.run, linewidth=1.6, zorder=3)
    _, measured, bound = _measured(curves)
    for point, radius in zip(measured, bound):
        axes.add_patch(
            Circle((point.real, point.imag), radius, facecolor=look.newest, alpha=0.3, linewidth=0, zorder=3)
        )
    axes.plot(measured.real, measured.imag, "o", markersize=3.5, color=look.newest, zorder=5)
    axes.plot([-1], [0], "+", markersize=12, markeredgewidth=2.0, color=look.ink, zorder=6)
    ms = curves.margins.of("peak_sensitivity")[0]
    if np.isfinite(ms):
        axes.add_patch(Circle((-1, 0), 1 / ms, fill=False, edgecolor=look.ink, linewidth=1.2, zorder=4))
        axes.annotate(
            f"Ms = {number(ms, '.3g')}", (-1, 1 / ms), (0, 5), textcoords="offset points", ha="center", color=look.ink
        )
    for marker, where in _marked(curves):
        level = curves.loop.at(curves.fit.parameters.value[:1], where)[0]
        axes.plot(level.real, level.imag, marker, markersize=9, markerfacecolor="none", markeredgecolor=look.ink,
                  markeredgewidth=1.6, zorder=6)  # fmt: skip
    axes.set_xlim(-_REACH, _REACH * 0.75)
    axes.set_ylim(-_REACH, _REACH)
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlabel("Re L")
    axes.set_ylabel("Im L")
    plain(axes)


def _measured(curves: LoopCurves) -> tuple[Floats, Complex, Floats]:
    """Frequency, F·G and its 95 % bound at the valid lines."""
    responses = curves.responses
    use = responses.valid[0]
    f = responses.lines.frequency_hz[use]
    behind = curves.loop.loop.feedback_at(f)
    return (
        f,
        responses.value[0, use] * behind,
        np.nan_to_num(responses.bound()[0, use]) * np.abs(behind),
    )


def _marked(curves: LoopCurves) -> list[tuple[str, Floats]]:
    """Mark the frequencies of the margins: |L| = 1 (diamonds), L negative (squares)."""
    f = dict(zip(curves.margins.names, curves.margins.frequency_hz[0]))
    kinds = (("D", ("phase_margin", "delay_margin")), ("s", ("gain_margin", "gain_reduction")))
    low = curves.fit.band_hz[0] / 4
    return [(m, np.unique([f[n] for n in names if np.isfinite(f[n]) and f[n] >= low])) for m, names in kinds]


def _facts(curves: LoopCurves) -> str:
    bound = curves.margins.bound()[0]
    words = [
        f"{label} {number(curves.margins.value[0, i], '.3g')} ± {number(bound[i], '.2g')}{unit}"
        for label, name, unit in (
            (tr("gain margin"), "gain_margin", " dB"),
            (tr("phase margin"), "phase_margin", "°"),
            (tr("delay margin"), "delay_margin", " ms"),
            ("Ms", "peak_sensitivity", ""),
            (tr("bandwidth"), "bandwidth", " Hz"),
        )
        if np.isfinite(curves.margins.value[0, (i := curves.margins.index(name))])
    ]
    return " · ".join(words) or worded(str(curves.margins.status[0]))


def _legend(figure: Figure, look: Style, left: float) -> None:
    from matplotlib.lines import Line2D

    mark: dict[str, Any] = {"linestyle": "", "markerfacecolor": "none", "markeredgecolor": look.ink, "markersize": 7}
    handles = [
        Line2D([], [], color=look.run, linewidth=1.6),
        Line2D([], [], color=look.run, linewidth=1.0, dashes=(4, 2)),
        Line2D([], [], color=look.newest, linestyle="", marker="o", markersize=4),
        Line2D([], [], marker="D", **mark),
        Line2D([], [], marker="s", **mark),
    ]
    texts = [
        tr("L of the fit, 95 % band"), tr("beyond the lines"), tr("measured lines, 95 %"), "|L| = 1", tr("L negative"),
    ]  # fmt: skip
    figure.legend(
        handles, texts, loc="upper left", bbox_to_anchor=(left, 1 - 0.76 / figure.get_size_inches()[1]), ncols=5,
        borderpad=0.0, borderaxespad=0.0, handlelength=1.8, columnspacing=1.8,
    )  # fmt: skip
