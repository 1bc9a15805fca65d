"""Frequency and damping of the modes of an output-only run over time."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path

import numpy as np

from livebode.arrays import Floats
from livebode.core import INTERVAL_FACTOR
from livebode.language import numerals, tr, trn
from livebode.pictures import (
    LIGHT,
    Band,
    End,
    Figure,
    Mark,
    Note,
    Panel,
    Scale,
    Trace,
    clock,
    empty_scale,
    end_room,
    room,
    save_svg,
    scale_around,
    stacked,
    value_scale,
    with_holes,
)
from livebode_modes.curves import ModeCurve

CURVES_MAX = 10
"""Most modes in a picture: those that were found in most windows."""
_REACH = 4.0  # times the range of 90 % of the values: one wide bound must not flatten the rest


def save_modes(
    curves: Sequence[ModeCurve], directory: str | PathLike[str], *, title: str, facts: Sequence[str]
) -> Path:
    """Write modes.svg to an existing directory; OSError if it cannot be written."""
    return save_svg(modes_figure(curves, title=title, facts=facts), Path(directory) / "modes.svg")


def modes_figure(curves: Sequence[ModeCurve], *, title: str, facts: Sequence[str]) -> Figure:
    """Frequencies above dampings over time, each with its 95 % bound; harmonics are dashed and have no damping.

    Parameters
    ----------
    curves
        Modes and harmonics; the ten that were found most often are drawn.
    title, facts
        Heading, and what is below it.
    """
    kept = sorted(curves, key=lambda curve: -curve.found)[:CURVES_MAX]
    kept = [curve for curve in curves if curve in kept and curve.found]
    if left_out := len(curves) - len(kept):
        facts = [*facts, trn("{n} weaker curve not shown", "{n} weaker curves not shown", left_out)]
    times = np.concatenate([curve.time_s for curve in kept]) if kept else np.zeros(1)
    origin_s, label = clock(times)
    upper: list[Mark] = []
    lower: list[Mark] = []
    for curve, colour in zip(kept, LIGHT.traces):
        time_s = curve.time_s - origin_s
        upper += _curve(time_s, curve.frequency_hz, curve.frequency_sigma, colour, "dashed" if curve.harmonic else "")
        lower += _curve(time_s, 100 * curve.damping, 100 * curve.damping_sigma, colour)
    hz = _scale([(curve.frequency_hz, curve.frequency_sigma) for curve in kept], tr("frequency in Hz"))
    percent = [(100 * curve.damping, 100 * curve.damping_sigma) for curve in kept]
    damping = _scale(percent, tr("damping ratio in %"))
    if not kept:
        upper.append(Note(tr("no mode was found")))
    ends = [_end(curve, colour) for curve, colour in zip(kept, LIGHT.traces)]
    left, right = room(hz, damping), 588.0 - end_room(ends)
    parts = ((hz, upper, 210.0), (damping, lower, 130.0))
    (first, second), height = stacked(scale_around([times - origin_s], label), parts, left=left, width=right - left)
    first = Panel(first.left, first.top, first.width, first.height, first.x, hz, upper, ends)
    return Figure(title, facts, (), [first, second], height)


def _curve(time_s: Floats, value: Floats, sigma: Floats, colour: str, dashes: str = "") -> list[Mark]:
    bound = INTERVAL_FACTOR * sigma
    times, (middle, low, high) = with_holes(time_s, [x[:, np.newaxis] for x in (value, value - bound, value + bound)])
    return [
        Band("bound", times, low[:, 0], high[:, 0], colour),
        Trace("value", times, middle[:, 0], colour, 1.3, dashes),
    ]


def _scale(drawn: Sequence[tuple[Floats, Floats]], label: str) -> Scale:
    value, sigma = (np.concatenate(part) for part in zip(*drawn)) if drawn else (np.zeros(0), np.zeros(0))
    known = np.isfinite(value) & np.isfinite(sigma)
    if not known.any():
        return scale_around([value], label) if np.isfinite(value).any() else empty_scale(label)
    value, half = value[known], INTERVAL_FACTOR * sigma[known]
    low, high = np.quantile(value, [0.02, 0.98])
    reach = _REACH * max(float(np.median(half)), 0.02 * float(high - low), 1e-3 * float(abs(high)))
    least, most = max(float((value - half).min()), low - reach), min(float((value + half).max()), high + reach)
    return value_scale(float(least), float(most), label)


def _end(curve: ModeCurve, colour: str) -> End:
    """The newest frequency of a curve at the right edge."""
    newest = float(curve.frequency_hz[np.isfinite(curve.frequency_hz)][-1])
    return End(f"{numerals(f'{newest:.4g}')} Hz", newest, colour)
