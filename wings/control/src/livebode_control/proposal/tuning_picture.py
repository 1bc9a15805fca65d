"""The picture of a proposed controller: L, Nyquist and Nichols plot and steps, before and after, with bands."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Literal

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.core import Model
from livebode.language import number, tr
from livebode.pictures import (
    ABOVE,
    BELOW,
    LIGHT,
    TITLE,
    Areas,
    Band,
    Dots,
    Entry,
    Figure,
    Mark,
    Panel,
    Scale,
    Tag,
    Trace,
    phase_scale,
    room,
    round_frequency_scale,
    save_svg,
    scale_around,
    stacked,
    value_scale,
)
from livebode_control.margins.loop_picture import discs, nyquist_panel, sensitivity_circle
from livebode_control.strokes.friction_picture import friction_dots, labelled, speed_unit
from livebode_control.tuning import ControllerProposal
from livebode_control.tuning.feedforward import Feedforward
from livebode_control.tuning.gain_schedule import GainSchedule
from livebode_control.tuning.predicted_steps import predicted_steps

_POINTS, _TIMES = 100, 400
_REACH = 2.2
_LOWEST_DEG = -460.0
_HEIGHT, _LARGE = 150.0, 260.0

Drawn = tuple[str, Scale, Scale, list[Mark]]
"""Title, scales and marks of a panel that is as wide as the picture."""


def save_tuning_picture(
    proposal: ControllerProposal,
    directory: str | PathLike[str],
    *,
    gains: GainSchedule | None = None,
    feedforward: Feedforward | None = None,
    title: str = "",
) -> Path:
    """Write tune.svg to an existing directory."""
    figure = tuning_figure(proposal, gains=gains, feedforward=feedforward, title=title)
    return save_svg(figure, Path(directory) / "tune.svg")


def tuning_figure(
    proposal: ControllerProposal,
    *,
    gains: GainSchedule | None = None,
    feedforward: Feedforward | None = None,
    title: str = "",
) -> Figure:
    """|L| and its phase, Nyquist and Nichols plot with the limits, the responses to steps of reference and disturbance.

    Bands of L are the discs of all lines together. The band of the steps holds, for every place, the middle 95 % of 100
    plants drawn with the noise of the lines. Dashed: before. Beyond the lines nothing is drawn.

    Below them, what was asked for: the noise of the plant input (a limit or the step of the encoder was specified), the
    gains over the position with their bandwidths, and the friction of the feedforward.
    """
    panels, top = _bode(proposal)
    below = [*_steps(proposal), *(draw() for draw in _extra(proposal, gains, feedforward))]
    scales = _nichols_scales()
    left = room(scales[1], *(y for _, _, y, _ in below))
    panels.append(nyquist_panel(_nyquist(proposal), left=left, top=top + ABOVE))
    top += ABOVE + panels[-1].height + BELOW + ABOVE
    panels.append(Panel(left, top, 588.0 - left, _LARGE, *scales, _nichols(proposal)))
    top += _LARGE + BELOW
    for name, x, y, marks in below:
        top += ABOVE + TITLE * bool(y.label)
        panels.append(Panel(left, top, 588.0 - left, _HEIGHT, x, y, marks, title=name))
        top += _HEIGHT + BELOW
    key = (
        Entry(tr("before"), LIGHT.muted, "dashed"), Entry(tr("proposed"), LIGHT.run),
        Entry(tr("95 % band"), LIGHT.run, "band"),
    )  # fmt: skip
    return Figure(title or tr("Loop"), _facts(proposal), key, panels, top)


def _curves(proposal: ControllerProposal) -> list[tuple[Model, bool]]:
    """The feedback before, if it is stable, and after; whether it is the proposed one."""
    before = proposal.loop.feedback
    assert before is not None
    return [(before, False), (proposal.feedback.model, True)]


def _line(x: Floats, y: Floats, proposed: bool) -> Trace:
    name = "proposed" if proposed else "before"
    return Trace(name, x, y, LIGHT.run if proposed else LIGHT.muted, 1.5, "" if proposed else "dashed")


def _bode(proposal: ControllerProposal) -> tuple[list[Panel], float]:
    plant = proposal.plant
    shown = ~plant.above & (plant.frequency_hz >= plant.lines_hz[0])
    f = plant.frequency_hz[shown]
    magnitude: list[Mark] = [_level(f, 0.0)]
    phase: list[Mark] = [_level(f, -180.0)]
    values: list[tuple[Floats, Floats]] = []
    for feedback, proposed in _curves(proposal):
        for loop, radius in zip(
            proposal.open_loop(feedback)[:, shown], plant.radius[:, shown] / np.abs(plant.value[:, shown])
        ):
            deg, db = _nichols_of(loop)
            inside = np.clip(radius, 0, 0.999)
            if proposed:
                spread = np.degrees(np.arcsin(inside))
                low, high = db + 20 * np.log10(1 - inside), db + 20 * np.log10(1 + inside)
                magnitude.append(Band("bound", f, low, high, LIGHT.run))
                phase.append(Band("bound", f, deg - spread, deg + spread, LIGHT.run))
            magnitude.append(_line(f, db, proposed))
            phase.append(_line(f, deg, proposed))
            values.append((db, deg))
    db, deg = (np.concatenate(part) for part in zip(*values))
    margin = 0.08 * float(np.ptp(db))
    scales = (
        value_scale(float(db.min()) - margin, float(db.max()) + margin, tr("|L| in dB")),
        phase_scale(max(float(deg.min()) - 20, _LOWEST_DEG), float(deg.max()) + 20, tr("phase of L in degrees")),
    )
    left = room(*scales)
    parts = list(zip(scales, (magnitude, phase), (180.0, 130.0)))
    return stacked(round_frequency_scale(f[0], f[-1]), parts, left=left, width=588.0 - left)


def _level(x: Floats, value: float) -> Trace:
    return Trace("level", x[[0, -1]], np.full(2, value), LIGHT.muted, 0.9)


def _nyquist(proposal: ControllerProposal) -> list[Mark]:
    plant = proposal.plant
    shown = ~plant.above & (plant.frequency_hz >= plant.lines_hz[0])
    marks: list[Mark] = []
    for feedback, proposed in _curves(proposal):
        behind = np.abs(feedback.response(plant.frequency_hz))
        for loop, radius in zip(proposal.open_loop(feedback), plant.radius * behind):
            if proposed:
                near = plant.measured & (np.abs(loop) < 2 * _REACH)
                marks.append(discs(loop[near], radius[near], 0.18))
            marks.append(_line(loop[shown].real, loop[shown].imag, proposed))
    return marks + sensitivity_circle(proposal.specification.max_sensitivity)


def _nichols_scales() -> tuple[Scale, Scale]:
    phase = phase_scale(-270.0, 90.0, tr("phase of L in degrees"), 4)
    return phase, value_scale(-30.0, 30.0, tr("|L| in dB"))


def _nichols(proposal: ControllerProposal) -> list[Mark]:
    """|L| in dB over the phase of L, both of −1 at (−180, 0); with the curve of the largest |S| and the discs."""
    plant = proposal.plant
    shown = ~plant.above & (plant.frequency_hz >= plant.lines_hz[0])
    turn = np.exp(1j * np.linspace(0, 2 * np.pi, 181))
    marks: list[Mark] = [
        _level(np.array([-270.0, 90.0]), 0.0),
        Trace("level", np.full(2, -180.0), np.array([-30.0, 30.0]), LIGHT.muted, 0.9),
    ]
    for feedback, proposed in _curves(proposal):
        behind = np.abs(feedback.response(plant.frequency_hz))
        for loop, radius in zip(proposal.open_loop(feedback), plant.radius * behind):
            deg, db = _nichols_of(loop[shown])
            share = radius[shown] / np.abs(loop[shown])
            near = plant.measured[shown] & (share < 1)  # a disc around 0 has every phase
            if proposed:
                disc = 1 + share[near, np.newaxis] * turn
                edges = zip(deg[near, np.newaxis] + np.degrees(np.angle(disc)), db[near, np.newaxis] + _db(disc))
                marks.append(Areas("disc", list(edges), LIGHT.newest, 0.18))
            marks.append(_line(deg, db, proposed))
    around = 1 - turn / proposal.specification.max_sensitivity  # −L
    marks.append(Trace("sensitivity", np.degrees(np.angle(around)) - 180, _db(around), LIGHT.ink, 1.2))
    return [*marks, Dots("critical", np.array([-180.0]), np.zeros(1), LIGHT.ink, 12.0, "plus")]


def _nichols_of(loop: Complex) -> tuple[Floats, Floats]:
    """Phase, deg, unwrapped from between −270 and 90 on, and size, dB."""
    deg = np.degrees(np.unwrap(np.angle(loop)))
    return deg - 360 * np.ceil((deg[0] - 90) / 360), _db(loop)


def _db(value: Complex) -> Floats:
    return np.asarray(20 * np.log10(np.abs(value)))


def _steps(proposal: ControllerProposal) -> list[Drawn]:
    """T and G·S of every place."""
    time_s = np.linspace(0, 3 / proposal.promised.bandwidth_hz, _TIMES)
    time_ms = 1e3 * time_s
    panels: tuple[list[Mark], list[Mark]] = ([], [])
    values: tuple[list[Floats], list[Floats]] = ([], [])
    for feedback, proposed in _curves(proposal):
        if not proposed and proposal.before is None:
            continue
        for marks, drawn, step in zip(panels, values, predicted_steps(proposal.plant, feedback, time_s)):
            if proposed:
                marks.append(Band("bound", time_ms, step.low, step.high, LIGHT.run))
            marks += [_line(time_ms, value, proposed) for value in step.value]
            drawn += [*step.value, *(np.nan_to_num(end) for end in (step.low, step.high) if proposed)]
    names = tr("step of the reference"), tr("step of the disturbance at the plant input")
    x = value_scale(0.0, float(time_ms[-1]), tr("time in ms"))
    return [(name, x, scale_around(drawn, "", 5), marks) for name, drawn, marks in zip(names, values, panels)]


def _extra(
    proposal: ControllerProposal, gains: GainSchedule | None, forward: Feedforward | None
) -> list[Callable[[], Drawn]]:
    """What draws each panel that was asked for."""
    asked: list[Callable[[], Drawn]] = []
    if proposal.specification.encoder_step is not None or proposal.specification.noise_limit is not None:
        asked.append(partial(_noise, proposal))
    if gains is not None:
        asked += [partial(_gains, gains), partial(_bandwidths, gains)]
    if forward is not None and forward.curve is not None:
        asked.append(partial(_friction, forward))
    return asked


def _noise(proposal: ControllerProposal) -> Drawn:
    """Rms of the plant input due to the noise up to each frequency, before and after; dotted: the limit."""
    before = proposal.loop.feedback
    curves: list[tuple[Model, bool]] = [(proposal.feedback.model, True)]
    if proposal.before is not None and before is not None:
        curves.append((before, False))
    shown = proposal.plant.frequency_hz >= proposal.plant.lines_hz[0]
    f = proposal.plant.frequency_hz[shown]
    values = [proposal.noise_up_to(feedback)[shown] for feedback, _ in curves]
    marks: list[Mark] = [_line(f, value, proposed) for value, (_, proposed) in zip(values, curves)]
    if (limit := proposal.specification.noise_limit) is not None:
        values.append(np.array([limit]))
        marks.append(Trace("limit", f[[0, -1]], np.full(2, limit), LIGHT.ink, 1.2, "dotted"))
    encoder = proposal.specification.encoder_step is not None
    title = tr("input noise by the encoder's rounding") if encoder else tr("input noise for white noise of 1")
    y = scale_around(values, tr("rms up to this frequency"), 5, 0.0)
    return title, round_frequency_scale(f[0], f[-1]), y, marks


def _gains(gains: GainSchedule) -> Drawn:
    """Gains and times of each place over those of one controller for all places."""
    marks: list[Mark] = [_level(gains.position, 1.0)]
    values = []
    ends: Mapping[int, Literal["start", "middle", "end"]] = {0: "start", -1: "end"}
    for i, (name, column) in enumerate(zip(gains.names, (gains.logarithms - gains.common_logarithms).T)):
        colour, value = LIGHT.traces[i % len(LIGHT.traces)], np.exp(column)
        marks += [Trace(name, gains.position, value, colour, 1.5), Dots(name, gains.position, value, colour, 4.0)]
        place = i % len(value)  # names beside each other overlap less than those at one end
        anchor = ends.get(place, ends.get(place - len(value), "middle"))
        marks.append(Tag(name.replace("_", " "), float(gains.position[place]), float(value[place]), colour, anchor))
        values.append(value)
    return tr("gains over those of one controller"), _positions(gains), scale_around(values, "", 5), marks


def _positions(gains: GainSchedule) -> Scale:
    return value_scale(float(gains.position.min()), float(gains.position.max()), tr("position"))


def _bandwidths(gains: GainSchedule) -> Drawn:
    """Promised bandwidth of each place; dashed: with one controller for all places."""
    marks: list[Mark] = []
    values = []
    for promised, proposed in ((gains.common_promised, False), (gains.promised, True)):
        hz = np.array([margins.bandwidth_hz for margins in promised])
        line = _line(gains.position, hz, proposed)
        marks += [line, Dots(line.name, gains.position, hz, line.colour, 4.0)]
        values.append(hz)
    title = tr("promised bandwidth; dashed: one controller")
    return title, _positions(gains), scale_around(values, tr("bandwidth in Hz"), 5, 0.0), marks


def _friction(forward: Feedforward) -> Drawn:
    """Measured friction over speed, and that of the feedforward with its band."""
    curve = forward.curve
    assert curve is not None
    dots = friction_dots(curve)
    marks: list[Mark] = [dots]
    for sign in (-1, 1):
        v = sign * np.linspace(0, curve.speed[1], _POINTS)
        value, bound = forward.friction(v, sign)
        marks += [
            Band("bound", v, value - bound, value + bound, LIGHT.run),
            Trace("friction", v, value, LIGHT.run, 1.5),
        ]
    words = {"inertia": number(forward.inertia, ".4g"), "bound": number(forward.inertia_bound, ".2g")}
    title = tr("feedforward: inertia {inertia} ± {bound}, friction", **words)
    y = scale_around([dots.y], labelled(tr("friction"), curve.units[curve.index("coulomb")]))
    reach = float(np.abs(dots.x).max())
    return title, value_scale(-reach, reach, labelled(tr("speed"), speed_unit(curve))), y, marks


def _facts(proposal: ControllerProposal) -> list[str]:
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
    return [tr("promised for the worst plant within the bounds:"), *words]
