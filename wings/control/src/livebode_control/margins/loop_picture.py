"""The picture of a loop: Bode plot of L with its crossovers, and the Nyquist plot with the circle of Ms."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Literal, Protocol

import numpy as np

from livebode.analysis import Margins, OpenLoop
from livebode.arrays import Complex, Floats
from livebode.core import INTERVAL_FACTOR, Responses
from livebode.fitting import Fit
from livebode.language import number, tr, worded
from livebode.pictures import (
    ABOVE,
    BELOW,
    LIGHT,
    Areas,
    Band,
    Bars,
    Dots,
    Entry,
    Figure,
    Mark,
    Panel,
    Tag,
    Trace,
    phase_scale,
    room,
    round_frequency_scale,
    save_svg,
    stacked,
    value_scale,
)

_POINTS = 1200
_DRAWS = 100  # of the fit's parameters, for the band
_LOWEST_DEG = -460.0  # below it only the delay acts
_REACH = 2.2  # of the Nyquist plot
_CORNERS = np.exp(2j * np.pi * np.arange(73) / 72)


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


def save_loop_picture(curves: LoopCurves, directory: str | PathLike[str], *, title: str = "") -> Path:
    """Write margins.svg to an existing directory."""
    return save_svg(loop_figure(curves, title=title), Path(directory) / "margins.svg")


def loop_figure(curves: LoopCurves, *, title: str = "") -> Figure:
    """|L| and its phase over frequency above the Nyquist plot, from the fit with a 95 % band.

    Dots are the measured lines, F·G, with 95 % bounds. Diamonds mark |L| = 1 and squares negative L, if a margin was
    computed there. Beyond the lines the curve is dashed: it is from the model only.
    """
    f = np.geomspace(curves.fit.band_hz[0] / 4, curves.loop.rate_hz / 2, _POINTS)
    value, low, high = _curves(curves, f)
    db, deg = 20 * np.log10(np.abs(value)), _degrees(value)
    margin_db = 0.05 * float(np.ptp(db))
    lowest, highest = max(float(deg.min()) - 20, _LOWEST_DEG), float(deg.max()) + 20
    scales = (
        value_scale(float(db.min()) - margin_db, float(db.max()) + margin_db, tr("|L| in dB")),
        phase_scale(lowest, highest, tr("phase of L in degrees")),
    )
    marks = _bode(curves, f, (db, deg), (low, high))
    left = room(*scales)
    parts = list(zip(scales, marks, (180.0, 130.0)))
    panels, top = stacked(round_frequency_scale(f[0], f[-1]), parts, left=left, width=588.0 - left)
    panels.append(nyquist_panel(_nyquist(curves, f, value), left=left, top=top + ABOVE))
    key = (
        Entry(tr("L of the fit, 95 % band"), LIGHT.run), Entry(tr("beyond the lines"), LIGHT.run, "dashed"),
        Entry(tr("measured lines, 95 %"), LIGHT.newest, "dot"), Entry("|L| = 1", LIGHT.ink, "diamond"),
        Entry(tr("L negative"), LIGHT.ink, "square"),
    )  # fmt: skip
    height = top + ABOVE + panels[-1].height + BELOW
    return Figure(title or tr("Loop"), _facts(curves), key, panels, height)


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
    loop_curves: LoopCurves, f: Floats, middle: tuple[Floats, Floats], ends: tuple[tuple[Floats, Floats], ...]
) -> tuple[list[Mark], list[Mark]]:
    """Marks of magnitude and phase."""
    inside = (f >= loop_curves.fit.band_hz[0]) & (f <= loop_curves.fit.band_hz[1])
    limits_hz = f[[0, -1]]
    turns = range(int(np.min(middle[1]) // 360) - 1, 2)
    levels = ((0.0,), tuple(-180.0 + 360 * k for k in turns))
    panels: list[list[Mark]] = []
    for i, values in enumerate(middle):
        marks: list[Mark] = [Trace("level", limits_hz, np.full(2, at), LIGHT.muted, 0.9) for at in levels[i]]
        marks.append(Band("bound", f, ends[0][i], ends[1][i], LIGHT.run))
        marks.append(Trace("model", f, values, LIGHT.run, 1.0, "dashed"))
        marks.append(Trace("fit", f, np.where(inside, values, np.nan), LIGHT.run, 1.6))
        panels.append(marks)
    measured_hz, measured, bound = _measured(loop_curves)
    size = np.abs(measured)
    error = np.clip(bound / size, 0, 0.999)
    low_db, high_db = 20 * np.log10(np.stack([1 - error, 1 + error])) + 20 * np.log10(size)
    near = np.interp(measured_hz, f, middle[1])
    turned = np.degrees(np.angle(measured))
    turned += 360 * np.rint((near - turned) / 360)
    half = np.degrees(np.arcsin(error))
    panels[0] += _points(measured_hz, 20 * np.log10(size), low_db, high_db)
    panels[1] += _points(measured_hz, turned, turned - half, turned + half)
    for kind, where in _marked(loop_curves):
        level = loop_curves.loop.at(loop_curves.fit.parameters.value[:1], where)[0]
        panels[0].append(Dots("margin", where, 20 * np.log10(np.abs(level)), LIGHT.ink, 9.0, kind))
        panels[1].append(Dots("margin", where, np.interp(where, f, middle[1]), LIGHT.ink, 9.0, kind))
    return panels[0], panels[1]


def _points(f: Floats, value: Floats, low: Floats, high: Floats) -> list[Mark]:
    return [Bars("measured-bound", f, low, high, LIGHT.newest, 1.4), Dots("measured", f, value, LIGHT.newest, 4.0)]


def nyquist_panel(marks: list[Mark], *, left: float, top: float) -> Panel:
    """The plane of L around −1, with the same scale in both directions, the unit circle and −1."""
    ring = _CORNERS
    axes: list[Mark] = [
        Trace("level", np.array([-_REACH, _REACH]), np.zeros(2), LIGHT.muted, 0.8),
        Trace("level", np.zeros(2), np.array([-_REACH, _REACH]), LIGHT.muted, 0.8),
        Trace("unit-circle", ring.real, ring.imag, LIGHT.muted, 0.9, "dotted"),
    ]
    critical = Dots("critical", np.array([-1.0]), np.zeros(1), LIGHT.ink, 12.0, "plus")
    width = 588.0 - left
    x, y = value_scale(-_REACH, 0.75 * _REACH, "Re L"), value_scale(-_REACH, _REACH, "Im L")
    height = width * (y.high - y.low) / (x.high - x.low)
    shrunk = min(1.0, 440.0 / height)
    return Panel(left, top, shrunk * width, shrunk * height, x, y, [*axes, *marks, critical])


def sensitivity_circle(max_sensitivity: float) -> list[Mark]:
    """The circle around −1 that L touches at its largest sensitivity, with its value."""
    ring = -1 + _CORNERS / max_sensitivity
    name = Tag(f"Ms = {number(max_sensitivity, '.3g')}", -1.0, 1 / max_sensitivity, LIGHT.ink)
    return [Trace("sensitivity", ring.real, ring.imag, LIGHT.ink, 1.2), name]


def discs(value: Complex, radius: Floats, alpha: float) -> Areas:
    """A disc around each value."""
    corners = value[:, np.newaxis] + radius[:, np.newaxis] * _CORNERS
    return Areas("disc", [(ring.real, ring.imag) for ring in corners], LIGHT.newest, alpha)


def _nyquist(curves: LoopCurves, f: Floats, value: Complex) -> list[Mark]:
    """The curve near −1, the circle that touches it, and the measured lines."""
    inside = (f >= curves.fit.band_hz[0]) & (f <= curves.fit.band_hz[1])
    _, measured, bound = _measured(curves)
    marks: list[Mark] = [
        Trace("model", value.real, value.imag, LIGHT.run, 1.0, "dashed"),
        Trace("fit", np.where(inside, value.real, np.nan), value.imag, LIGHT.run, 1.6),
        discs(measured, bound, 0.3),
        Dots("measured", measured.real, measured.imag, LIGHT.newest, 4.0),
    ]
    ms = curves.margins.of("peak_sensitivity")[0]
    if np.isfinite(ms):
        marks += sensitivity_circle(float(ms))
    for kind, where in _marked(curves):
        level = curves.loop.at(curves.fit.parameters.value[:1], where)[0]
        marks.append(Dots("margin", level.real, level.imag, LIGHT.ink, 9.0, kind))
    return marks


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


def _marked(curves: LoopCurves) -> list[tuple[Literal["diamond", "square"], Floats]]:
    """Mark the frequencies of the margins: |L| = 1 (diamonds), L negative (squares)."""
    f = dict(zip(curves.margins.names, curves.margins.frequency_hz[0]))
    kinds: tuple[tuple[Literal["diamond", "square"], tuple[str, ...]], ...] = (
        ("diamond", ("phase_margin", "delay_margin")), ("square", ("gain_margin", "gain_reduction")),
    )  # fmt: skip
    low = curves.fit.band_hz[0] / 4
    return [(m, np.unique([f[n] for n in names if np.isfinite(f[n]) and f[n] >= low])) for m, names in kinds]


def _facts(curves: LoopCurves) -> list[str]:
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
    return words or [worded(str(curves.margins.status[0]))]
