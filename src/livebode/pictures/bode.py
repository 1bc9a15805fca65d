"""The Bode plot of a run: magnitude, phase and coherence over frequency, with the range over the run and the bounds."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats
from livebode.core import COVERAGE, Model, Response, Responses, decibels, moment
from livebode.language import tr, trn
from livebode.pictures import words
from livebode.pictures._style import LIGHT
from livebode.pictures.curves import Summary, bound_db, bound_deg, summarised
from livebode.pictures.figure import (
    FEW_LINES,
    Band,
    Bars,
    Dots,
    Entry,
    Figure,
    Mark,
    Note,
    Scale,
    Trace,
    empty_scale,
    frequency_scale,
    limits_around,
    number_text,
    phase_scale,
    room,
    stacked,
    value_scale,
)

_FIT_POINTS = 600


def bode_figure(
    responses: Responses,
    *,
    title: str = "",
    names: tuple[str, str] | None = None,
    fitted: Model | None = None,
    mean: Response | None = None,
) -> Figure:
    """Magnitude (dB), unwrapped phase (degrees) and, if known, coherence over logarithmic frequency.

    A curve shows the median over the valid responses (separately for magnitude and phase, the phase around its mean
    direction; summary.py explains why not the complex mean), a light band their range of 5–95 %, and another colour
    the newest valid response with its bound, which covers the true value with a probability of 95 %. Lines that were
    never valid remain open.

    Parameters
    ----------
    responses
        (rows, lines); may be thinned, partly or wholly invalid, or empty.
    title
        Heading, from the recording; shortened if it does not fit.
    names
        Names of the input and the output channel.
    fitted
        The newest fit, or the fit of the mean; drawn from the first to the last line.
    mean
        The mean of the run; drawn alone with its 95 % bound, instead of median, range and newest response.
    """
    summary = summarised(responses, mean)
    curve = _curve(summary, fitted) if fitted is not None and summary.count else None
    fit_db, fit_deg = (curve[1], curve[2]) if curve is not None else (np.zeros(0), np.zeros(0))
    x = frequency_scale(responses.lines.frequency_hz)
    run = (None, None, None) if mean else (summary.magnitude_db, summary.phase_deg, summary.coherence)
    newest = _newest_db(summary), _newest_deg(summary), _newest_coherence(summary)
    parts_of_bound = _parts(summary)
    inner: list[list[tuple[str, tuple[Floats, Floats]]]] = [
        [(colour, bound_db(summary.newest_value, radius)) for _, colour, radius in parts_of_bound[1:]],
        [(colour, _around(summary, radius)) for _, colour, radius in parts_of_bound[1:]],
        [],
    ]
    outer = parts_of_bound[0][1]
    marks = [_marks(summary, of, *values, outer, within) for of, values, within in zip(run, newest, inner)]
    if curve is not None:
        for panel, values in zip(marks, curve[1:]):
            panel.append(Trace("fit", curve[0], values, LIGHT.ink, 1.0, "dashed"))
    magnitude_label = words.magnitude_label(responses, 54)
    db = limits_around(_values(run[0], newest[0][0]), np.concatenate([*newest[0][1:], fit_db]), 3.0)
    around_deg = np.concatenate([*newest[1][1:], fit_deg])
    deg = limits_around(np.append(_values(run[1], newest[1][0]), fit_deg), around_deg, 10.0)
    parts: list[tuple[Scale, list[Mark], float]] = [
        (value_scale(*db, magnitude_label) if db else empty_scale(magnitude_label), marks[0], 210.0),
        (phase_scale(*deg) if deg else empty_scale(tr("phase in degrees")), marks[1], 140.0),
    ]
    if np.isfinite(summary.coherence).any():
        share = Scale(-0.04, 1.06, (0.0, 0.5, 1.0), ("0", number_text(0.5), "1"), label=tr("coherence γ²"))
        parts.append((share, marks[2], 76.0))
    if not summary.count:
        parts[0][1].append(Note(tr("no valid response")))
    left = room(*(part[0] for part in parts))
    panels, height = stacked(x, parts, left=left, width=588.0 - left)
    key = _key(summary, fitted is not None, mean is not None) if summary.count else ()
    return Figure(title or tr("Bode plot"), words.facts(responses, summary.count, names), key, panels, height)


def _values(run: Floats | None, newest: Floats) -> Floats:
    return newest if run is None else np.append(run, newest)


def _curve(summary: Summary, fitted: Model) -> tuple[Floats, Floats, Floats]:
    """The model's Hz, dB and degrees; its phase on the same turn as that of the newest response."""
    lines_hz = summary.responses.lines.frequency_hz
    f = np.union1d(np.geomspace(lines_hz[0], lines_hz[-1], _FIT_POINTS), lines_hz)
    value = fitted.response(f)
    deg = np.degrees(np.unwrap(np.angle(value)))
    away = (summary.newest_phase_deg - deg[np.searchsorted(f, lines_hz)]) / 360
    turns = np.round(np.median(away[np.isfinite(away)])) if np.isfinite(away).any() else 0.0
    return f, decibels(np.abs(value)), deg + 360 * turns


def _newest_db(summary: Summary) -> tuple[Floats, Floats, Floats]:
    return decibels(summary.newest_value), *bound_db(summary.newest_value, summary.newest_bound)


def _newest_deg(summary: Summary) -> tuple[Floats, Floats, Floats]:
    return summary.newest_phase_deg, *_around(summary, summary.newest_bound)


def _around(summary: Summary, radius: Floats) -> tuple[Floats, Floats]:
    """Ends of the phase, degrees."""
    half = bound_deg(summary.newest_value, radius)
    return summary.newest_phase_deg - half, summary.newest_phase_deg + half


def _parts(summary: Summary) -> list[tuple[str, str, Floats]]:
    """What the bound covers, the whole first: words, colour, and radius of this part and those after it, (lines,).

    Only noise where no other part is known.
    """
    bound, newest = summary.newest_bound, summary.newest
    found = [(tr("noise"), LIGHT.newest, bound)]
    if newest is None:
        return found
    distortion, variation = (np.where(np.isfinite(part), part, 0.0) for part in (newest.distortion, newest.variation))
    with np.errstate(invalid="ignore", divide="ignore"):
        unit = np.where(newest.sigma > 0, bound / newest.sigma, 0.0)
    sigma = newest.noise
    found = [(tr("noise"), LIGHT.newest, unit * sigma)]
    others = (tr("distortion"), LIGHT.traces[3], distortion), (tr("time variation"), LIGHT.traces[2], variation)
    for text, colour, part in others:
        if (part > 0).any():
            sigma = np.hypot(sigma, part)
            found.insert(0, (text, colour, unit * sigma))
    return found


def _newest_coherence(summary: Summary) -> tuple[Floats, Floats, Floats]:
    nothing = np.full(len(summary.responses.lines), np.nan)
    if summary.newest is None:
        return nothing, nothing, nothing
    return np.where(np.isfinite(summary.newest_value), summary.newest.coherence, np.nan), nothing, nothing


def _marks(
    summary: Summary,
    run: Floats | None,
    value: Floats,
    low: Floats,
    high: Floats,
    colour: str,
    inner: list[tuple[str, tuple[Floats, Floats]]],
) -> list[Mark]:
    """One panel: range, median, newest; `run` is (3, lines) or None, the others (lines,).

    The bound has this colour; `inner` are the parts within it, from the outside.
    """
    f = summary.responses.lines.frequency_hz
    few = len(f) <= FEW_LINES
    marks: list[Mark] = []
    if summary.count > 1 and run is not None:
        marks.append(Band("span", f, run[0], run[2], LIGHT.run, 0.2))
        marks.append(Trace("median", f, run[1], LIGHT.run, 1.5))
        if few:
            marks.append(Dots("median", f, run[1], LIGHT.run))
    if few:
        if run is None:
            marks.append(Trace("mean", f, value, LIGHT.newest, 0.8))
        marks.append(Bars("bound", f, low, high, colour))
        marks += [Bars("part", f, *ends, each, 1.6 + 1.6 * n) for n, (each, ends) in enumerate(inner, 1)]
        return [*marks, Dots("newest", f, value, LIGHT.newest, 4.5, "dash")]
    marks.append(Band("bound", f, low, high, colour, 0.28))
    marks += [Band("part", f, *ends, each, 0.45) for each, ends in inner]
    return [*marks, Trace("newest", f, value, LIGHT.newest, 0.9)]


def _key(summary: Summary, fit: bool, mean: bool) -> list[Entry]:
    assert summary.newest is not None
    entries: list[Entry] = []
    if summary.count > 1 and not mean:
        median = trn(
            "median of {n} response with a valid line", "median of {n} responses with a valid line", summary.count
        )
        entries += [Entry(median, LIGHT.run), Entry(tr("5–95 % of them"), LIGHT.run, "band")]
    newest = tr("newest, at {time}", time=moment(summary.newest.time_s, 2))
    if np.isfinite(summary.newest_bound).any():
        newest += tr(", bound: {percent:g} %", percent=100 * COVERAGE)
    average = tr("average, bound: {percent:g} %", percent=100 * COVERAGE)
    few = len(summary.responses.lines) <= FEW_LINES
    entries.append(Entry(average if mean else newest, LIGHT.newest, "bar" if few else "line"))
    if len(parts := _parts(summary)) > 1:
        entries += [Entry(text, colour, "bar" if few else "band") for text, colour, _ in reversed(parts)]
    if fit:
        entries.append(Entry(tr("its fit") if mean else tr("newest fit"), LIGHT.ink, "dashed"))
    return entries
