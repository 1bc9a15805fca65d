"""Magnitude of each line over time, and over the schedule if there is one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import COVERAGE, Responses, decibels
from livebode.language import numerals, tr
from livebode.pictures import ticks, words
from livebode.pictures._style import LIGHT, shortened
from livebode.pictures.curves import bound_db, usable
from livebode.pictures.figure import (
    ABOVE,
    BELOW,
    Band,
    Bars,
    Dots,
    End,
    Entry,
    Figure,
    Mark,
    Note,
    Panel,
    Scale,
    Trace,
    empty_scale,
    end_room,
    limits_around,
    room,
    value_scale,
)
from livebode.pictures.map import maps

# More traces than this cannot be distinguished by colour and label; maps are drawn instead.
TRACES_MAX = 10
# A step in time this many times the usual one is a gap in the recording; no line is drawn across it.
_HOLE_STEPS = 2.5
_HEIGHT = 270.0


def tracking_figure(responses: Responses, *, title: str = "", schedule_name: str = "") -> Figure:
    """Magnitude of every line in dB over time and, if the run has a schedule that varies, over the schedule.

    Up to ten lines are traces with a light band, the bound that covers the true value with a probability of 95 %,
    each labelled at its end. Over the schedule they are points, filled while it rises and hollow while it falls,
    because the response of a moving machine depends on the direction. More lines become maps over frequency: the
    magnitude, and below it the change from the median of the run. Intervals without a valid response remain open.

    Parameters
    ----------
    responses
        (rows, lines); may be thinned, partly or wholly invalid, or empty.
    title
        Heading, from the recording; shortened if it does not fit.
    schedule_name
        Name of the scheduling signal with its unit, for the axis.
    """
    use = usable(responses)
    schedule = shortened(schedule_name, 60) or tr("scheduling signal")
    over = schedule if scheduled(responses, use) else None
    facts = words.facts(responses, int(use.any(axis=1).sum()))
    key: list[Entry] = []
    if not use.any():
        panels, height = _empty(responses)
    elif len(responses.lines) > TRACES_MAX:
        facts.append(tr("grey: no valid response"))
        panels, height = maps(responses, use, over)
    else:
        panels, height, key = _traces(responses, use, over)
    return Figure(title or tr("Tracking"), facts, key, panels, height)


def scheduled(responses: Responses, use: NDArray[np.bool_]) -> bool:
    """Whether the scheduling signal has at least two values at valid responses."""
    schedule = responses.schedule[use.any(axis=1)]
    schedule = schedule[np.isfinite(schedule)]
    return bool(schedule.size > 1 and schedule.max() > schedule.min())


def _empty(responses: Responses) -> tuple[list[Panel], float]:
    y, marks = empty_scale(words.magnitude_label(responses, 54)), [Note(tr("no valid response"))]
    return [Panel(24.0, ABOVE, 560.0, 200.0, empty_scale(tr("time in s")), y, marks)], ABOVE + 200.0 + BELOW


def _traces(
    responses: Responses, use: NDArray[np.bool_], schedule: str | None
) -> tuple[list[Panel], float, list[Entry]]:
    values = np.where(use, responses.value, np.nan)
    bounds = np.array(bound_db(values, np.where(use, responses.bound(), np.nan)))
    level = decibels(values)
    low, high = limits_around(level, bounds, 3.0) or (0.0, 1.0)
    y = value_scale(low, high, words.magnitude_label(responses, 54))
    ends = [
        End(f"{numerals(ticks.frequency_label(f))} Hz", at[np.isfinite(at)][-1], colour)
        for f, at, colour in zip(responses.lines.frequency_hz, level.T, LIGHT.traces)
        if np.isfinite(at).any()
    ]
    left, right = room(y), 588.0 - end_room(ends)
    top, panels, key = ABOVE, [], []
    if schedule:
        known = responses.schedule[np.isfinite(responses.schedule)]
        x = value_scale(*_wider(known, 0.02), schedule)
        marks = _over_schedule(responses, level, bounds)
        panels.append(Panel(left, top, right - left, _HEIGHT, x, y, marks, ends))
        top += _HEIGHT + BELOW + ABOVE
        key += [Entry(tr("rising"), LIGHT.muted, "dot"), Entry(tr("falling"), LIGHT.muted, "ring")]
    x, marks = _over_time(responses, level, bounds)
    panels.append(Panel(left, top, right - left, _HEIGHT, x, y, marks, ends))
    if np.isfinite(bounds).any():
        key.append(Entry(tr("bound: {percent:g} %", percent=100 * COVERAGE), LIGHT.muted, "band"))
    return panels, top + _HEIGHT + BELOW, key


def _wider(values: Floats, share: float) -> tuple[float, float]:
    low, high = float(values.min()), float(values.max())
    return low - share * (high - low), high + share * (high - low)


def _over_time(responses: Responses, level: Floats, bounds: Floats) -> tuple[Scale, list[Mark]]:
    origin_s, label = words.clock(responses.time_s)
    kept = np.isfinite(responses.time_s)
    time_s, (level, low, high) = with_holes(
        responses.time_s[kept] - origin_s, [level[kept], bounds[0][kept], bounds[1][kept]]
    )
    marks: list[Mark] = []
    for i, colour in zip(range(level.shape[1]), LIGHT.traces):
        marks.append(Band("bound", time_s, low[:, i], high[:, i], colour, 0.18))
        marks.append(Trace("magnitude", time_s, level[:, i], colour))
    return value_scale(*_wider(time_s, 0.01), label) if time_s.size else empty_scale(label), marks


def with_holes(time_s: Floats, columns: list[Floats]) -> tuple[Floats, list[Floats]]:
    """Insert a NaN row at each jump of the time, so that no line is drawn across a gap of the recording."""
    steps = np.diff(time_s)
    usual = float(np.median(steps)) if steps.size else 0.0
    jumps = np.flatnonzero((steps > _HOLE_STEPS * usual) | (steps < 0)) + 1 if usual > 0 else np.zeros(0, dtype=np.intp)
    return np.insert(time_s, jumps, time_s[jumps - 1]), [np.insert(c, jumps, np.nan, axis=0) for c in columns]


def _over_schedule(responses: Responses, level: Floats, bounds: Floats) -> list[Mark]:
    x = responses.schedule
    falling = is_falling(x)
    size = float(np.clip(80.0 / np.sqrt(max(len(x), 1)), 2.6, 5.5))
    faint = float(np.clip(64.0 / max(len(x), 1), 0.04, 0.16))  # many strokes overlap
    marks: list[Mark] = []
    for i, colour in zip(range(level.shape[1]), LIGHT.traces):
        marks.append(Bars("bound", x, bounds[0][:, i], bounds[1][:, i], colour, 1.5, faint))
        marks.append(Dots("rising", x[~falling], level[~falling, i], colour, size))
        marks.append(Dots("falling", x[falling], level[falling, i], colour, size, "ring"))
    return marks


def is_falling(schedule: Floats) -> NDArray[np.bool_]:
    """Mask of the rows in which the scheduling signal falls; a row at standstill has the previous direction."""
    known = np.flatnonzero(np.isfinite(schedule))
    falling = np.zeros(len(schedule), dtype=bool)
    if known.size < 2:
        return falling
    steps = np.diff(schedule[known])
    moving = np.where(steps != 0, np.arange(steps.size), -1)
    last = np.maximum.accumulate(moving)
    first = int(np.argmax(steps != 0))
    down = steps[np.where(last < 0, first, last)] < 0
    falling[known] = np.append(down[0], down)
    return falling
