"""The picture of a proposed controller: L, Nyquist plot and steps, before and after, with bands."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import Model
from livebode.language import number, tr
from livebode.report.loop import round_numbers
from livebode.report.pictures import save
from livebode.report.style import Style, drawing, heading, new_figure, plain, style
from livebode.tuning import ControllerProposal
from livebode.tuning.step_response import step_response

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

_DRAWS = 100  # of the plant, for the bands of the steps
_REACH = 2.2
_LOWEST_DEG = -460.0
_TIMES = 400


def save_tuning_picture(
    found: ControllerProposal, directory: str | PathLike[str], *, title: str = "", dark: bool = False
) -> Path:
    """Write tune.png to an existing directory."""
    return save(tuning_figure(found, title=title, dark=dark), Path(directory) / "tune.png", style(dark))


def tuning_figure(found: ControllerProposal, *, title: str = "", dark: bool = False) -> Figure:
    """|L| and its phase, the Nyquist plot with the limits, and the responses to steps of reference and disturbance.

    Bands of L are the discs of all lines together. Bands of the steps are the middle 95 % of 100 plants drawn with the
    noise of the lines. Dashed: before. Beyond the lines nothing is drawn.
    """
    look = style(dark)
    with drawing(look):
        figure = new_figure(14.0, 6.4)
        grid = figure.add_gridspec(
            2, 3, width_ratios=[1.15, 1, 1], left=0.06, right=0.985, top=0.82, bottom=0.09, hspace=0.28, wspace=0.2
        )
        heading(figure, look, title or tr("Loop"), _facts(found), 0.06)
        magnitude = figure.add_subplot(grid[0, 0])
        phase = figure.add_subplot(grid[1, 0], sharex=magnitude)
        _bode(magnitude, phase, look, found)
        _nyquist(figure.add_subplot(grid[:, 1]), look, found)
        _steps(figure.add_subplot(grid[0, 2]), figure.add_subplot(grid[1, 2]), look, found)
        _legend(figure, look)
    return figure


def _curves(found: ControllerProposal) -> list[tuple[Model, bool]]:
    """The feedback before, if it is stable, and after; whether it is the proposed one."""
    before = found.loop.feedback
    assert before is not None
    return [(before, False), (found.feedback.model, True)]


def _bode(magnitude: Axes, phase: Axes, look: Style, found: ControllerProposal) -> None:
    from livebode.drawing.scales import frequency_axis

    plant = found.plant
    at = ~plant.above & (plant.frequency_hz >= plant.lines_hz[0])
    f = plant.frequency_hz[at]
    for feedback, proposed in _curves(found):
        colour, dashes = (look.run, (1, 0)) if proposed else (look.muted, (4, 2))
        for loop, radius in zip(found.open_loop(feedback)[:, at], plant.radius[:, at] / np.abs(plant.value[:, at])):
            db = 20 * np.log10(np.abs(loop))
            deg = np.degrees(np.unwrap(np.angle(loop)))
            deg -= 360 * np.ceil((deg[0] - 90) / 360)
            inside = np.clip(radius, 0, 0.999)
            if proposed:
                spread = np.degrees(np.arcsin(inside))
                ends = db + 20 * np.log10(1 - inside), db + 20 * np.log10(1 + inside)
                magnitude.fill_between(f, *ends, color=colour, alpha=0.25, linewidth=0)
                phase.fill_between(f, deg - spread, deg + spread, color=colour, alpha=0.25, linewidth=0)
            magnitude.plot(f, db, color=colour, linewidth=1.5, dashes=dashes)
            phase.plot(f, deg, color=colour, linewidth=1.5, dashes=dashes)
    magnitude.axhline(0, color=look.muted, linewidth=0.9)
    phase.axhline(-180, color=look.muted, linewidth=0.9)
    magnitude.set_ylabel(tr("|L| in dB"))
    phase.set_ylabel(tr("phase of L in degrees"))
    phase.set_xlabel(tr("frequency in Hz"))
    bottom, top = phase.get_ylim()
    phase.set_ylim(max(bottom, _LOWEST_DEG), top)
    for axes in (magnitude, phase):
        plain(axes)
        frequency_axis(axes, round_numbers(f[0], f[-1]), labels=axes is phase)


def _nyquist(axes: Axes, look: Style, found: ControllerProposal) -> None:
    from matplotlib.patches import Circle

    plant = found.plant
    at = ~plant.above & (plant.frequency_hz >= plant.lines_hz[0])
    axes.axhline(0, color=look.muted, linewidth=0.8)
    axes.axvline(0, color=look.muted, linewidth=0.8)
    axes.add_patch(Circle((0, 0), 1.0, fill=False, edgecolor=look.muted, linewidth=0.9, linestyle=":"))
    for feedback, proposed in _curves(found):
        behind = np.abs(feedback.response(plant.frequency_hz))
        colour, dashes = (look.run, (1, 0)) if proposed else (look.muted, (4, 2))
        for loop, radius in zip(found.open_loop(feedback), plant.radius * behind):
            axes.plot(loop[at].real, loop[at].imag, color=colour, linewidth=1.5, dashes=dashes, zorder=3)
            for point, size in zip(loop[plant.measured], radius[plant.measured]) if proposed else ():
                if abs(point) < 2 * _REACH:
                    disc: dict[str, Any] = {"facecolor": look.newest, "alpha": 0.18, "linewidth": 0, "zorder": 2}
                    axes.add_patch(Circle((point.real, point.imag), size, **disc))
    ms = found.specification.max_sensitivity
    axes.add_patch(Circle((-1, 0), 1 / ms, fill=False, edgecolor=look.ink, linewidth=1.2, zorder=4))
    axes.annotate(
        f"Ms = {number(ms, '.3g')}", (-1, 1 / ms), (0, 5), textcoords="offset points", ha="center", color=look.ink
    )
    axes.plot([-1], [0], "+", markersize=12, markeredgewidth=2.0, color=look.ink, zorder=6)
    axes.set_xlim(-_REACH, _REACH * 0.75)
    axes.set_ylim(-_REACH, _REACH)
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlabel("Re L")
    axes.set_ylabel("Im L")
    plain(axes)


def _steps(reference: Axes, disturbance: Axes, look: Style, found: ControllerProposal) -> None:
    """T and G·S of the first place."""
    plant = found.plant
    at = ~plant.above
    f = plant.frequency_hz[at]
    until = 3 / found.promised.bandwidth_hz
    time_s = np.linspace(0, until, _TIMES)
    plants = plant.value[:1, at] + plant.sigma[:1, at] * _noise(f, plant.lines_hz)
    for feedback, proposed in _curves(found):
        if not proposed and found.before is None:
            continue
        colour, dashes = (look.run, (1, 0)) if proposed else (look.muted, (4, 2))
        behind = feedback.response(f)
        for axes, top in ((reference, behind), (disturbance, np.ones(f.size))):
            middle = plant.value[:1, at] / (1 + plant.value[:1, at] * behind)
            around = plants / (1 + plants * behind)
            if proposed:
                low, high = np.quantile(step_response(f, around * top, time_s), [0.025, 0.975], axis=0)
                axes.fill_between(1e3 * time_s, low, high, color=colour, alpha=0.25, linewidth=0)
            axes.plot(
                1e3 * time_s, step_response(f, middle * top, time_s)[0], color=colour, dashes=dashes, linewidth=1.5
            )
    reference.set_title(tr("step of the reference"), fontsize=10)
    disturbance.set_title(tr("step of the disturbance at the plant input"), fontsize=10)
    disturbance.set_xlabel(tr("time in ms"))
    for axes in (reference, disturbance):
        plain(axes)


def _noise(frequency_hz: Floats, lines_hz: Floats) -> Complex:
    """Circular noise of the lines, interpolated between them, shape (draws, frequencies)."""
    drawn = np.random.default_rng(0).standard_normal((2 * _DRAWS, lines_hz.size)) / np.sqrt(2)
    between = np.stack([np.interp(frequency_hz, lines_hz, row) for row in drawn])
    return np.asarray(between[:_DRAWS] + 1j * between[_DRAWS:])


def _facts(found: ControllerProposal) -> str:
    promised = found.promised
    words = [
        f"{label} {number(value, '.3g')}{unit}"
        for label, value, unit in (
            (tr("bandwidth"), promised.bandwidth_hz, " Hz"),
            ("Ms", promised.max_sensitivity, ""),
            (tr("gain margin"), promised.gain_margin_db, " dB"),
            (tr("phase margin"), promised.phase_margin_deg, "°"),
        )
        if np.isfinite(value)
    ]
    return tr("promised for the worst plant within the bounds: {margins}", margins=" · ".join(words))


def _legend(figure: Figure, look: Style) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = [
        Line2D([], [], color=look.muted, linewidth=1.5, dashes=(4, 2)),
        Line2D([], [], color=look.run, linewidth=1.5),
        Patch(facecolor=look.run, alpha=0.25),
    ]
    texts = [tr("before"), tr("proposed"), tr("95 % band")]
    figure.legend(handles, texts, loc="upper left", bbox_to_anchor=(0.06, 0.89), ncols=3, borderpad=0.0)
