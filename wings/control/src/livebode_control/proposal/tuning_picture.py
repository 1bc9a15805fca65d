"""The picture of a proposed controller: L, Nyquist and Nichols plot and steps, before and after, with bands."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.core import Model
from livebode.language import number, tr
from livebode.pictures import Style, drawing, heading, new_figure, plain, save, style
from livebode_control.margins.loop_picture import round_numbers
from livebode_control.strokes.friction_picture import labelled, speed_unit
from livebode_control.tuning import ControllerProposal
from livebode_control.tuning.feedforward import Feedforward
from livebode_control.tuning.gain_schedule import GainSchedule
from livebode_control.tuning.predicted_steps import predicted_steps

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.gridspec import SubplotSpec


_DOTS, _POINTS = 3000, 100


def extra_panels(
    proposal: ControllerProposal, gains: GainSchedule | None, forward: Feedforward | None
) -> list[Callable[[Axes, Style], None]]:
    """What draws each panel that was asked for."""
    asked: list[Callable[[Axes, Style], None]] = []
    if proposal.specification.encoder_step is not None or proposal.specification.noise_limit is not None:
        asked.append(partial(_noise, proposal))
    if gains is not None:
        asked += [partial(_gains, gains), partial(_bandwidths, gains)]
    if forward is not None and forward.curve is not None:
        asked.append(partial(_friction, forward))
    return asked


def _noise(proposal: ControllerProposal, axes: Axes, look: Style) -> None:
    """Rms of the plant input due to the noise up to each frequency, before and after; dotted: the limit."""
    from livebode.pictures import frequency_axis

    before = proposal.loop.feedback
    curves: list[tuple[Model, str, tuple[int, ...]]] = [(proposal.feedback.model, look.run, (1, 0))]
    if proposal.before is not None and before is not None:
        curves.append((before, look.muted, (4, 2)))
    f = proposal.plant.frequency_hz
    shown = f >= proposal.plant.lines_hz[0]
    for feedback, colour, dashes in curves:
        axes.plot(f[shown], proposal.noise_up_to(feedback)[shown], color=colour, linewidth=1.5, dashes=dashes)
    if (limit := proposal.specification.noise_limit) is not None:
        axes.axhline(limit, color=look.ink, linewidth=1.2, linestyle=":")
    encoder = proposal.specification.encoder_step is not None
    title = tr("input noise by the encoder's rounding") if encoder else tr("input noise for white noise of 1")
    axes.set_title(title, fontsize=10)
    axes.set_ylabel(tr("rms up to this frequency"))
    axes.set_xlabel(tr("frequency in Hz"))
    axes.set_ylim(bottom=0)
    plain(axes)
    frequency_axis(axes, np.delete(round_numbers(f[shown][0], f[-1]), -2), labels=True)


def _gains(gains: GainSchedule, axes: Axes, look: Style) -> None:
    """Gains and times of each place over those of one controller for all places."""
    for i, (name, column) in enumerate(zip(gains.names, (gains.logarithms - gains.common_logarithms).T)):
        dashes = ((1, 0), (4, 2), (1, 1), (4, 1, 1, 1))[i % 4]
        colour = look.run if i == 0 else look.ink
        axes.plot(gains.position, np.exp(column), color=colour, linewidth=1.5, marker="o", markersize=4, dashes=dashes,
                  label=name.replace("_", " "))  # fmt: skip
    axes.axhline(1, color=look.muted, linewidth=0.9)
    axes.set_title(tr("gains over those of one controller"), fontsize=10)
    axes.set_xlabel(tr("position"))
    axes.legend(fontsize=9)
    plain(axes)


def _bandwidths(gains: GainSchedule, axes: Axes, look: Style) -> None:
    """Promised bandwidth of each place; dashed: with one controller for all places."""
    highest_hz = 0.0
    for promised, colour, dashes in (
        (gains.common_promised, look.muted, (4, 2)), (gains.promised, look.run, (1, 0)),
    ):  # fmt: skip
        hz = [margins.bandwidth_hz for margins in promised]
        axes.plot(gains.position, hz, color=colour, linewidth=1.5, marker="o", markersize=4, dashes=dashes)
        highest_hz = max(highest_hz, *hz)
    axes.set_title(tr("promised bandwidth; dashed: one controller"), fontsize=10)
    axes.set_xlabel(tr("position"))
    axes.set_ylabel(tr("bandwidth in Hz"))
    axes.set_ylim(0, 1.1 * highest_hz)
    plain(axes)


def _friction(forward: Feedforward, axes: Axes, look: Style) -> None:
    """Measured friction over speed, and that of the feedforward with its band."""
    curve = forward.curve
    assert curve is not None
    speed, friction = curve.measured[:, :: max(curve.measured.shape[1] // _DOTS, 1)]
    axes.plot(speed, friction, ".", color=look.muted, alpha=0.35, markersize=3)
    for sign in (-1, 1):
        v = sign * np.linspace(0, curve.speed[1], _POINTS)
        value, bound = forward.friction(v, sign)
        axes.fill_between(v, value - bound, value + bound, color=look.run, alpha=0.25, linewidth=0)
        axes.plot(v, value, color=look.run, linewidth=1.5)
    words = {"inertia": number(forward.inertia, ".4g"), "bound": number(forward.inertia_bound, ".2g")}
    axes.set_title(tr("feedforward: inertia {inertia} ± {bound}, friction", **words), fontsize=10)
    axes.set_xlabel(labelled(tr("speed"), speed_unit(curve)))
    axes.set_ylabel(labelled(tr("friction"), curve.units[curve.index("coulomb")]))
    plain(axes)


_REACH = 2.2
_LOWEST_DEG = -460.0
_TIMES = 400
_BELOW_IN = 3.6
_FOLDED_IN = 12.0


def save_tuning_picture(
    proposal: ControllerProposal,
    directory: str | PathLike[str],
    *,
    gains: GainSchedule | None = None,
    feedforward: Feedforward | None = None,
    title: str = "",
    dark: bool = False,
) -> Path:
    """Write tune.png to an existing directory."""
    figure = tuning_figure(proposal, gains=gains, feedforward=feedforward, title=title, dark=dark)
    return save(figure, Path(directory) / "tune.png", style(dark))


def tuning_figure(
    proposal: ControllerProposal,
    *,
    gains: GainSchedule | None = None,
    feedforward: Feedforward | None = None,
    title: str = "",
    dark: bool = False,
) -> Figure:
    """|L| and its phase, Nyquist and Nichols plot with the limits, the responses to steps of reference and disturbance.

    Bands of L are the discs of all lines together. The band of the steps holds, for every place, the middle 95 % of 100
    plants drawn with the noise of the lines. Dashed: before. Beyond the lines nothing is drawn.

    Below them, what was asked for: the noise of the plant input (a limit or the step of the encoder was specified), the
    gains over the position with their bandwidths, and the friction of the feedforward.
    """
    look = style(dark)
    panels = extra_panels(proposal, gains, feedforward)
    with drawing(look):
        below_in = _BELOW_IN if panels else 0.0
        figure = new_figure(18.0, 6.4 + below_in)
        height_in = figure.get_size_inches()[1]
        sides = {"left": 0.05, "right": 0.985}
        top, bottom = (below_in + 5.25) / height_in, (below_in + 0.58) / height_in
        grid = figure.add_gridspec(
            2, 4, width_ratios=[1.15, 1, 1, 1], top=top, bottom=bottom, hspace=0.28, wspace=0.2, **sides
        )
        heading(figure, look, title or tr("Loop"), _facts(proposal), 0.05)
        _drawn(figure, look, proposal, (grid[0, 0], grid[1, 0], grid[:, 1], grid[:, 2], grid[0, 3], grid[1, 3]))
        if panels:
            top, bottom = (below_in - 0.4) / height_in, 0.58 / height_in
            row = figure.add_gridspec(1, 4, top=top, bottom=bottom, wspace=0.2, **sides)
            for column, draw in enumerate(panels):
                draw(figure.add_subplot(row[0, column]), look)
        _legend(figure, look)
    return figure


def folded_tuning_figure(proposal: ControllerProposal, *, width_in: float) -> Figure:
    """The upper panels of `tuning_figure` in two columns, for the width of a page."""
    look = style(False)
    with drawing(look):
        figure = new_figure(width_in, _FOLDED_IN)
        grid = figure.add_gridspec(4, 2, left=0.09, right=0.98, top=0.905, bottom=0.05, hspace=0.42, wspace=0.2)
        heading(figure, look, tr("Loop"), _facts(proposal), 0.09)
        _drawn(figure, look, proposal, (grid[0, 0], grid[1, 0], grid[:2, 1], grid[2:, 1], grid[2, 0], grid[3, 0]))
        _legend(figure, look, 0.09)
    return figure


def _drawn(figure: Figure, look: Style, proposal: ControllerProposal, cells: tuple[SubplotSpec, ...]) -> None:
    """Into cells for magnitude, phase, Nyquist plot, Nichols plot, step of the reference and of a disturbance."""
    magnitude = figure.add_subplot(cells[0])
    phase = figure.add_subplot(cells[1], sharex=magnitude)
    _bode(magnitude, phase, look, proposal)
    _nyquist(figure.add_subplot(cells[2]), look, proposal)
    _nichols(figure.add_subplot(cells[3]), look, proposal)
    _steps(figure.add_subplot(cells[4]), figure.add_subplot(cells[5]), look, proposal)


def _curves(proposal: ControllerProposal) -> list[tuple[Model, bool]]:
    """The feedback before, if it is stable, and after; whether it is the proposed one."""
    before = proposal.loop.feedback
    assert before is not None
    return [(before, False), (proposal.feedback.model, True)]


def _bode(magnitude: Axes, phase: Axes, look: Style, proposal: ControllerProposal) -> None:
    from livebode.pictures import frequency_axis

    plant = proposal.plant
    shown = ~plant.above & (plant.frequency_hz >= plant.lines_hz[0])
    f = plant.frequency_hz[shown]
    for feedback, proposed in _curves(proposal):
        colour, dashes = (look.run, (1, 0)) if proposed else (look.muted, (4, 2))
        for loop, radius in zip(
            proposal.open_loop(feedback)[:, shown], plant.radius[:, shown] / np.abs(plant.value[:, shown])
        ):
            deg, db = _nichols_of(loop)
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


def _nyquist(axes: Axes, look: Style, proposal: ControllerProposal) -> None:
    from matplotlib.patches import Circle

    plant = proposal.plant
    shown = ~plant.above & (plant.frequency_hz >= plant.lines_hz[0])
    axes.axhline(0, color=look.muted, linewidth=0.8)
    axes.axvline(0, color=look.muted, linewidth=0.8)
    axes.add_patch(Circle((0, 0), 1.0, fill=False, edgecolor=look.muted, linewidth=0.9, linestyle=":"))
    for feedback, proposed in _curves(proposal):
        behind = np.abs(feedback.response(plant.frequency_hz))
        colour, dashes = (look.run, (1, 0)) if proposed else (look.muted, (4, 2))
        for loop, radius in zip(proposal.open_loop(feedback), plant.radius * behind):
            axes.plot(loop[shown].real, loop[shown].imag, color=colour, linewidth=1.5, dashes=dashes, zorder=3)
            for point, size in zip(loop[plant.measured], radius[plant.measured]) if proposed else ():
                if abs(point) < 2 * _REACH:
                    disc: dict[str, Any] = {"facecolor": look.newest, "alpha": 0.18, "linewidth": 0, "zorder": 2}
                    axes.add_patch(Circle((point.real, point.imag), size, **disc))
    ms = proposal.specification.max_sensitivity
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


def _nichols(axes: Axes, look: Style, proposal: ControllerProposal) -> None:
    """|L| in dB over the phase of L, both of −1 at (−180, 0); with the curve of the largest |S| and the discs."""
    from matplotlib.collections import PolyCollection

    plant = proposal.plant
    shown = ~plant.above & (plant.frequency_hz >= plant.lines_hz[0])
    axes.axhline(0, color=look.muted, linewidth=0.8)
    axes.axvline(-180, color=look.muted, linewidth=0.8)
    turn = np.exp(1j * np.linspace(0, 2 * np.pi, 181))
    for feedback, proposed in _curves(proposal):
        behind = np.abs(feedback.response(plant.frequency_hz))
        colour, dashes = (look.run, (1, 0)) if proposed else (look.muted, (4, 2))
        for loop, radius in zip(proposal.open_loop(feedback), plant.radius * behind):
            deg, db = _nichols_of(loop[shown])
            axes.plot(deg, db, color=colour, linewidth=1.5, dashes=dashes, zorder=3)
            share = radius[shown] / np.abs(loop[shown])
            near = plant.measured[shown] & (share < 1)  # a disc around 0 has every phase
            if proposed:
                disc = 1 + share[near, np.newaxis] * turn
                edge = [deg[near, np.newaxis] + np.degrees(np.angle(disc)), db[near, np.newaxis] + _db(disc)]
                words: dict[str, Any] = {"facecolor": look.newest, "alpha": 0.18, "linewidth": 0}
                axes.add_collection(PolyCollection(list(np.stack(edge, axis=-1)), **words), autolim=False)
    ms = proposal.specification.max_sensitivity
    around = 1 - turn / ms  # −L
    axes.plot(np.degrees(np.angle(around)) - 180, _db(around), color=look.ink, linewidth=1.2, zorder=4)
    axes.plot([-180], [0], "+", markersize=12, markeredgewidth=2.0, color=look.ink, zorder=6)
    axes.set_xlim(-270, 90)
    axes.set_xticks(range(-270, 91, 90))
    axes.set_ylim(-30, 30)
    axes.set_xlabel(tr("phase of L in degrees"))
    axes.set_ylabel(tr("|L| in dB"))
    plain(axes)


def _nichols_of(loop: Complex) -> tuple[Floats, Floats]:
    """Phase, deg, unwrapped from between −270 and 90 on, and size, dB."""
    deg = np.degrees(np.unwrap(np.angle(loop)))
    return deg - 360 * np.ceil((deg[0] - 90) / 360), _db(loop)


def _db(value: Complex) -> Floats:
    return np.asarray(20 * np.log10(np.abs(value)))


def _steps(reference: Axes, disturbance: Axes, look: Style, proposal: ControllerProposal) -> None:
    """T and G·S of every place."""
    time_s = np.linspace(0, 3 / proposal.promised.bandwidth_hz, _TIMES)
    for feedback, proposed in _curves(proposal):
        if not proposed and proposal.before is None:
            continue
        colour, dashes = (look.run, (1, 0)) if proposed else (look.muted, (4, 2))
        for axes, step in zip((reference, disturbance), predicted_steps(proposal.plant, feedback, time_s)):
            if proposed:
                axes.fill_between(1e3 * time_s, step.low, step.high, color=colour, alpha=0.25, linewidth=0)
            axes.plot(1e3 * time_s, step.value.T, color=colour, dashes=dashes, linewidth=1.5)
    reference.set_title(tr("step of the reference"), fontsize=10)
    disturbance.set_title(tr("step of the disturbance at the plant input"), fontsize=10)
    disturbance.set_xlabel(tr("time in ms"))
    for axes in (reference, disturbance):
        plain(axes)


def _facts(proposal: ControllerProposal) -> str:
    promised = proposal.promised
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
    reach = proposal.reach
    hz, db = number(reach.highest_line_hz, ".4g"), number(reach.resonance_db[0][1], ".0f")
    words.append(tr("up to {hz} Hz, above it with resonances of up to {db} dB", hz=hz, db=db))
    return tr("promised for the worst plant within the bounds: {margins}", margins=" · ".join(words))


def _legend(figure: Figure, look: Style, left: float = 0.05) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = [
        Line2D([], [], color=look.muted, linewidth=1.5, dashes=(4, 2)),
        Line2D([], [], color=look.run, linewidth=1.5),
        Patch(facecolor=look.run, alpha=0.25),
    ]
    texts = [tr("before"), tr("proposed"), tr("95 % band")]
    corner = (left, 1 - 0.7 / figure.get_size_inches()[1])
    figure.legend(handles, texts, loc="upper left", bbox_to_anchor=corner, ncols=3, borderpad=0.0)
