"""Pictures of a comparison: two responses, their ratio, and the differences along the schedule."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import Response, decibels
from livebode.language import tr, trn
from livebode.pictures import (
    ABOVE,
    BAR,
    BELOW,
    FEW_LINES,
    LIGHT,
    TITLE,
    Band,
    Bars,
    Cells,
    Dots,
    Entry,
    Figure,
    Mark,
    Panel,
    Trace,
    bound_db,
    bound_deg,
    colour_bar,
    decibel_label,
    frequency_edges,
    frequency_scale,
    map_scale,
    phase_scale,
    quantity,
    room,
    stacked,
    unlabelled,
    unwrapped,
    value_scale,
)

PlaceChange = tuple[float, float, bool, Complex, NDArray[np.bool_]]
"""From, to, whether return, ratio and mask of the lines that differ, (lines,) each."""

_MAP, _BETWEEN = 220.0, 12.0


def comparison_figure(
    before: Response, after: Response, ratio: Complex, bound: Floats, differs: NDArray[np.bool_]
) -> Figure:
    """Magnitude and phase of both with 95 % bounds; below, the ratio in dB and degrees with its bound.

    Parameters
    ----------
    before, after
        The responses, at the same lines.
    ratio, bound
        After over before and the radius around it, (lines,).
    differs
        Which lines are marked, (lines,).
    """
    f = before.lines.frequency_hz
    turn = unwrapped(np.degrees(np.angle(before.value)), np.zeros(len(f), dtype=bool))
    both = [
        _response(f * 1.004**side, response, turn, colour, name)
        for response, colour, side, name in ((before, LIGHT.run, -1, "before"), (after, LIGHT.newest, 1, "after"))
    ]
    (db, deg), (ratio_db, ratio_deg) = zip(*both), _ratio(f, ratio, bound, differs)
    scales = (
        value_scale(*_limits(np.concatenate([v for v, _ in db]), 3.0), decibel_label(before.unit)),
        phase_scale(*_limits(np.concatenate([v for v, _ in deg]), 10.0)),
        value_scale(*_limits(np.append(ratio_db[0], 0.0), 0.5), tr("ratio in dB"), 4),
        phase_scale(*_limits(np.append(ratio_deg[0], 0.0), 3.0), tr("ratio in degrees"), 4),
    )
    marks = ([m for _, ms in db for m in ms], [m for _, ms in deg for m in ms], ratio_db[1], ratio_deg[1])
    left = room(*scales)
    parts = list(zip(scales, marks, (170.0, 120.0, 90.0, 90.0)))
    panels, height = stacked(frequency_scale(f), parts, left=left, width=588.0 - left)
    facts = quantity(before), trn("{n} line", "{n} lines", len(f)), tr("{count} differ", count=int(differs.sum()))
    key = (
        Entry(tr("before, bound: 95 %"), LIGHT.run), Entry(tr("after, bound: 95 %"), LIGHT.newest),
        Entry(tr("differs"), LIGHT.ink, "dot"), Entry(tr("does not differ"), LIGHT.ink, "ring"),
    )  # fmt: skip
    return Figure(tr("Before and after"), facts, key, panels, height)


_Drawn = tuple[Floats, list[Mark]]


def _response(f: Floats, response: Response, turn: Floats, colour: str, name: str) -> tuple[_Drawn, _Drawn]:
    """Magnitude and phase, each with its marks."""
    value = np.where(response.valid, response.value, np.nan)
    radius = response.bound()
    (low, high), half = bound_db(value, radius), bound_deg(value, radius)
    db, deg = decibels(value), np.degrees(np.angle(value))
    deg = deg - 360 * np.rint((deg - turn) / 360)
    return (db, _curve(f, db, low, high, colour, name)), (deg, _curve(f, deg, deg - half, deg + half, colour, name))


def _curve(f: Floats, middle: Floats, low: Floats, high: Floats, colour: str, name: str) -> list[Mark]:
    if len(f) > FEW_LINES:
        return [Band(f"{name}-bound", f, low, high, colour, 0.25), Trace(name, f, middle, colour, 1.1)]
    bars = Bars(f"{name}-bound", f, low, high, colour)
    return [bars, Trace(name, f, middle, colour, 0.8), Dots(name, f, middle, colour, 4.0, "dash")]


def _ratio(f: Floats, ratio: Complex, bound: Floats, differs: NDArray[np.bool_]) -> tuple[_Drawn, _Drawn]:
    (low, high), half = bound_db(ratio, bound), bound_deg(ratio, bound)
    deg = np.degrees(np.angle(ratio))
    drawn = []
    for middle, under, over in ((decibels(ratio), low, high), (deg, deg - half, deg + half)):
        known = np.isfinite(middle)
        marks: list[Mark] = [
            Trace("zero", f[[0, -1]], np.zeros(2), LIGHT.muted, 0.9),
            Bars("ratio-bound", f[known], under[known], over[known], LIGHT.ink, 1.2, 0.7),
            Dots("differs", f[differs], middle[differs], LIGHT.ink, 5.0),
            Dots("same", f[~differs], middle[~differs], LIGHT.ink, 5.0, "ring"),
        ]
        drawn.append((middle, marks))
    return drawn[0], drawn[1]


def _limits(drawn: Floats, room: float) -> tuple[float, float]:
    """Limits that contain the values, and the bounds as far as these leave room for them."""
    known = drawn[np.isfinite(drawn)]
    if not known.size:
        return 0.0, 1.0
    reach = max(0.35 * float(np.ptp(known)), room)
    return float(known.min()) - reach, float(known.max()) + reach


def places_figure(frequency_hz: Floats, places: list[PlaceChange]) -> Figure:
    """The change of the magnitude over place and frequency, forward and return; dots mark significant differences."""
    ways = [[p for p in places if p[2] == back] for back in (False, True)]
    shown = [(way, name) for way, name in zip(ways, (tr("forward (rising)"), tr("return (falling)"))) if way]
    reach = max(float(np.nanmax(np.abs([decibels(p[3]) for p in places]), initial=0.0)), 0.1)
    edges_hz = frequency_edges(frequency_hz)
    y, bar = map_scale(frequency_hz, edges_hz), value_scale(-reach, reach, tr("change in dB"), 5)
    left, right, top = room(y), 588.0 - room(bar), TITLE + ABOVE
    width = (right - BAR - left) / len(shown) - _BETWEEN
    panels = []
    for i, (way, name) in enumerate(shown):
        x = value_scale(min(p[0] for p in way), max(p[1] for p in way), tr("schedule"), 5 // len(shown) + 1)
        marks: list[Mark] = []
        for low, high, _, ratio, differs in way:
            cells = decibels(ratio)[np.newaxis]
            marks.append(Cells("change", (low, high), edges_hz, cells, (-reach, reach), "change"))
            marks.append(
                Dots("differs", np.full(differs.sum(), (low + high) / 2), frequency_hz[differs], LIGHT.ink, 4.0)
            )
        place, beside = left + i * (width + _BETWEEN), y if not i else unlabelled(y)
        panels.append(Panel(place, top, width, _MAP, x, beside, marks, grid=False, title=name))
    panels.append(colour_bar(bar, "change", right=right, top=top, height=_MAP))
    return Figure("", (), (), panels, top + _MAP + BELOW)
