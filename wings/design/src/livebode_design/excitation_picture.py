"""The picture of an excitation: one period, its lines with their phases, and the histogram of its samples."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from livebode.arrays import Floats
from livebode.pictures import (
    ABOVE,
    BELOW,
    FEW_LINES,
    LIGHT,
    Areas,
    Band,
    Bars,
    Dots,
    Entry,
    Figure,
    Mark,
    Panel,
    Scale,
    Trace,
    frequency_scale,
    phase_scale,
    room,
    save_svg,
    scale_around,
    stacked,
    unlabelled,
    value_scale,
)

if TYPE_CHECKING:
    from livebode.excitation import Waveform
    from livebode_design.design import Design


_CLASSES = 41
_POINTS_MAX = 20_000  # of a period; of a longer one only the extremes are drawn
_HEIGHT, _SHARES = 170.0, 96.0


def save_excitation_picture(design: Design, path: str | PathLike[str]) -> Path:
    """Write the picture as SVG."""
    return save_svg(excitation_figure(design), Path(path))


def excitation_figure(design: Design) -> Figure:
    """One period over time beside the histogram of its samples; below, amplitude and phase of each line.

    Broken lines are the predicted extremes of the torque, motion included, and its limit if one is set.
    """
    waveform = design.waveform
    levels = _levels(design)
    y = scale_around([waveform.samples, *(level.y for level in levels)], "torque in N m")
    left = room(y)
    ms = 1000 * waveform.samples.size / waveform.lines.rate_hz
    x = value_scale(0.0, ms, "time in one period in ms", 5)
    width = 588.0 - _SHARES - 12.0 - left
    period = Panel(left, ABOVE, width, _HEIGHT, x, y, [_period(waveform), *(_across(level, ms) for level in levels)])
    panels = [period, _shares(waveform, y, levels)]
    top = ABOVE + _HEIGHT + BELOW
    key = [Entry("excitation", LIGHT.run), Entry("predicted torque, motion included", LIGHT.newest, "dashed")]
    if any(level.name == "limit" for level in levels):
        key.append(Entry("limit", LIGHT.ink, "dotted"))
    odd = _odd_without(waveform)
    if odd.size:
        key.append(Entry("odd bins without excitation", LIGHT.newest, "ring"))
    below, height = _lines(waveform, odd, top)
    return Figure(f"Excitation: {_kind(waveform)}", _facts(design), key, panels + below, height)


def _kind(waveform: Waveform) -> str:
    words = [str(waveform.about.get("kind", ""))]
    words += [str(waveform.about[key]) for key in ("phases", "sweep") if key in waveform.about]
    return ", ".join(words)


def _facts(design: Design) -> list[str]:
    waveform, lines = design.waveform, design.waveform.lines
    f = lines.frequency_hz
    many = f"{len(f)} lines from {f[0]:g} to {f[-1]:g} Hz" if len(f) > 1 else f"one line at {f[0]:g} Hz"
    return [
        many, f"{lines.window} samples at {lines.rate_hz:g} Hz", f"peak {waveform.peak:.3g} N m",
        f"rms {waveform.rms:.3g} N m", f"crest factor {waveform.crest_factor:.3f}",
    ]  # fmt: skip


def _period(waveform: Waveform) -> Trace | Band:
    samples, rate_hz = waveform.samples, waveform.lines.rate_hz
    ms = 1000 * np.arange(samples.size + 1) / rate_hz
    if samples.size < _POINTS_MAX:
        # A drive outputs each sample until the next.
        return Trace("excitation", np.repeat(ms, 2)[1:-1], np.repeat(samples, 2), LIGHT.run, 1.2)
    each = -(-samples.size // (_POINTS_MAX // 2))
    parts = np.array_split(samples, -(-samples.size // each))
    times = ms[np.cumsum([0, *(part.size for part in parts[:-1])])]
    low, high = np.array([part.min() for part in parts]), np.array([part.max() for part in parts])
    return Band("excitation", times, low, high, LIGHT.run, 1.0)


def _shares(waveform: Waveform, y: Scale, levels: list[Trace]) -> Panel:
    """The histogram of the samples, beside them."""
    counts, edges = np.histogram(waveform.samples, bins=_CLASSES)
    percent = 100 * counts / waveform.samples.size
    x = scale_around([percent], "samples in %", 3, 0.0)
    corners = [
        (np.array([0.0, share, share, 0.0]), np.array([low, low, high, high]))
        for share, low, high in zip(percent, edges[:-1], edges[1:])
    ]
    marks: list[Mark] = [Areas("shares", corners, LIGHT.run, 0.75), *(_across(level, x.high) for level in levels)]
    return Panel(588.0 - _SHARES, ABOVE, _SHARES, _HEIGHT, x, unlabelled(y), marks)


def _levels(design: Design) -> list[Trace]:
    """The predicted extremes of the torque and its limits, as lines of one point."""
    torque = [peak for peak in design.peaks if peak.quantity == "torque"]
    _, limit = design.limits.of("torque")
    levels = [
        Trace("predicted", np.zeros(1), np.array([value]), LIGHT.newest, 1.2, "dashed")
        for value in (min(peak.low for peak in torque), max(peak.high for peak in torque))
    ]
    if np.isfinite(limit):
        limits = (-limit, limit)
        levels += [Trace("limit", np.zeros(1), np.array([v]), LIGHT.ink, 1.2, "dotted") for v in limits]
    return levels


def _across(level: Trace, end: float) -> Trace:
    return Trace(level.name, np.array([0.0, end]), np.repeat(level.y, 2), level.colour, level.width, level.dashes)


def _odd_without(waveform: Waveform) -> Floats:
    """Frequencies of the odd bins that an odd excitation leaves out."""
    lines = waveform.lines
    if not lines.quiet or waveform.about.get("kind") != "odd":
        return np.zeros(0)
    return np.asarray([k for k in lines.quiet if k % 2]) * lines.resolution_hz


def _lines(waveform: Waveform, odd: Floats, top: float) -> tuple[list[Panel], float]:
    """Amplitude and phase of each line."""
    lines = waveform.lines
    f, spectrum = lines.frequency_hz, waveform.spectrum[list(lines.bins)]
    few, size = len(f) <= FEW_LINES, np.abs(spectrum)
    sizes: list[Mark] = [Bars("line", f, np.zeros(len(f)), size, LIGHT.run)] if few else []
    sizes.append(Dots("line", f, size, LIGHT.run) if few else Trace("line", f, size, LIGHT.run, 1.0))
    sizes.append(Dots("odd", odd, np.zeros(odd.size), LIGHT.newest, 5.0, "ring"))
    turned = np.degrees(np.angle(spectrum * 1j))  # of sines, as in eq. (6)
    phases: list[Mark] = [Dots("phase", f, turned, LIGHT.run, 4.0 if few else 2.0)]
    scales = scale_around([size], "amplitude in N m", 5, 0.0), phase_scale(-190.0, 190.0, "phase in °", 4)
    left = room(*scales)
    parts = [(scales[0], sizes, 120.0), (scales[1], phases, 90.0)]
    return stacked(frequency_scale(np.union1d(f, odd)), parts, left=left, width=588.0 - left, top=top)
