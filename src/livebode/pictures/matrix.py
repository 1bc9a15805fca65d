"""The pictures of a matrix run: a matrix of Bode plots, and the singular values over frequency."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import COVERAGE, REASONS, MatrixResponses, decibels, moment
from livebode.language import tr, worded
from livebode.pictures._style import LIGHT, shortened
from livebode.pictures.curves import Curve, bound_db, bound_deg
from livebode.pictures.figure import (
    ABOVE,
    BELOW,
    FEW_LINES,
    TITLE,
    WIDTH,
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
    Shade,
    Trace,
    empty_scale,
    frequency_scale,
    limits_around,
    phase_scale,
    room,
    stacked,
    unlabelled,
    value_scale,
)
from livebode.pictures.map import frequency_edges
from livebode.pictures.vector import save_svg
from livebode.pictures.words import lines_phrase

_DASHES = ("", "dashed", "dotted", "mixed")
_ENTRY_WIDTH, _MAGNITUDE, _PHASE = 190.0, 120.0, 80.0
_BETWEEN = 10.0
_Ends = tuple[Floats, Floats]


def save_matrix_pictures(responses: MatrixResponses, directory: str | PathLike[str], *, title: str = "") -> list[Path]:
    """Write bode.svg and singular-values.svg to an existing directory and return their paths.

    The same responses give the same bytes: the files contain no date and no version.

    Raises
    ------
    OSError
        If a file cannot be written.
    """
    pictures = {
        "bode.svg": matrix_figure(responses, title=title),
        "singular-values.svg": singular_values_figure(responses, title=title),
    }
    return [save_svg(figure, Path(directory) / name) for name, figure in pictures.items()]


def matrix_figure(responses: MatrixResponses, *, title: str = "") -> Figure:
    """A Bode plot of each entry: outputs down, inputs across, with the 95 % bounds of the newest matrix.

    Lines at which a column is invalid are shaded in its plots, with the reason where there is none that is valid. The
    width follows the number of inputs.
    """
    down, across = responses.value.shape[2:]
    curves = [[_Entry(responses, o, i) for i in range(across)] for o in range(down)]
    scales = [(_row_scale([entry.db for entry in row], ""), _row_phase([entry.deg for entry in row])) for row in curves]
    left = room(*(scale for pair in scales for scale in pair))
    width = max(WIDTH, left + across * (_ENTRY_WIDTH + _BETWEEN) + 12.0)
    one = (width - 12.0 - left) / across - _BETWEEN
    x = frequency_scale(responses.frequency_hz, max(int(one / 60), 2))
    panels: list[Panel] = []
    top = 0.0
    for o, row in enumerate(curves):
        top += TITLE
        for i, entry in enumerate(row):
            place = left + i * (one + _BETWEEN)
            panels += entry.panels(x, scales[o], place=place, top=top, width=one, last=o == down - 1, first=i == 0)
        top += ABOVE + _MAGNITUDE + ABOVE + _PHASE
    key = [Entry(tr("response; bounds of each entry alone: {percent:g} %", percent=100 * COVERAGE), LIGHT.newest)]
    if any(len(entry.parts) > 1 for row in curves for entry in row):
        key += [Entry(tr("noise"), LIGHT.newest, "band"), Entry(tr("time variation"), LIGHT.traces[2], "band")]
    if (responses.reason != 0).any():
        key.append(Entry(tr("not valid"), LIGHT.muted, "band"))
    return Figure(title or tr("Bode plots"), _facts(responses), key, panels, top + BELOW, width)


class _Entry:
    """One entry of the newest matrix: its values in dB and degrees, (value, low, high) each, and parts of its bound.

    A part is a colour with the ends in dB and in degrees, the whole first; without a time variation there is one.
    """

    def __init__(self, responses: MatrixResponses, output: int, input: int) -> None:
        newest = responses.entry(output, input).newest()
        nothing = np.full(len(responses.frequency_hz), np.nan)
        self.db = self.deg = (nothing, nothing, nothing)
        self.parts: list[tuple[str, tuple[_Ends, _Ends]]] = []
        if newest is not None:
            use = newest.valid & np.isfinite(newest.value) & (newest.value != 0)
            value, radius = np.where(use, newest.value, np.nan), np.where(use, newest.bound(), np.nan)
            deg = Curve(newest.frequency_hz, value, radius, "", "").phase_deg
            radii = [(LIGHT.newest, radius)]
            if np.any(newest.variation > 0):
                with np.errstate(invalid="ignore", divide="ignore"):
                    by_noise = np.where(newest.sigma > 0, radius * newest.noise / newest.sigma, radius)
                radii = [(LIGHT.traces[2], radius), (LIGHT.newest, by_noise)]
            for colour, part in radii:
                half = bound_deg(value, part)
                self.parts.append((colour, (bound_db(value, part), (deg - half, deg + half))))
            of_db, of_deg = self.parts[0][1]
            self.db, self.deg = (decibels(value), *of_db), (deg, *of_deg)
        self._of, self._output, self._input = responses, output, input
        units = responses.units[output] if responses.units else ()
        unit = units[input] if units else ""
        self._label = f"dB re 1 {unit}" if unit else tr("magnitude in dB")  # symbols in every language

    def panels(
        self, x: Scale, scales: tuple[Scale, Scale], *, place: float, top: float, width: float, last: bool, first: bool
    ) -> list[Panel]:
        """Magnitude above phase; numbers at the left only, and below the last one."""
        of, f = self._of, self._of.frequency_hz
        invalid = ~of.valid[-1, :, self._input]
        name = f"{of.inputs[self._input]} → {of.outputs[self._output]}"
        shown = []
        for number, (scale, (value, _, _)) in enumerate(zip(scales, (self.db, self.deg))):
            bounds = [(colour, ends[number]) for colour, ends in self.parts]
            marks: list[Mark] = [_shade(of, invalid), *_curve(f, value, bounds, LIGHT.newest)]
            if invalid.all() and not number:
                words = sorted({worded(REASONS[n]) for n in of.reason[-1, :, self._input]})
                marks.append(Note(tr("not valid: {why}", why=", ".join(words))))
            label = self._label if not number else tr("phase in degrees")
            y = Scale(scale.low, scale.high, scale.ticks, scale.texts if first else (), label=label)
            shown.append((y, marks, (_MAGNITUDE, _PHASE)[number]))
        return stacked(x if last else unlabelled(x), shown, left=place, width=width, top=top, title=name)[0]


def _curve(f: Floats, value: Floats, bounds: Sequence[tuple[str, _Ends]], colour: str, dashes: str = "") -> list[Mark]:
    """A curve with its bounds, the widest first, with a marker at few lines."""
    line = Trace("value", f, value, colour, 1.2, dashes)
    if len(f) > FEW_LINES:
        return [*(Band("bound", f, low, high, own, 0.28) for own, (low, high) in bounds), line]
    bars = [Bars("bound", f, low, high, own) for own, (low, high) in bounds]
    return [*bars, line, Dots("value", f, value, colour, 3.6)]


def _row_scale(curves: list[tuple[Floats, Floats, Floats]], label: str) -> Scale:
    limits = limits_around(
        np.concatenate([c[0] for c in curves]), np.concatenate([np.append(*c[1:]) for c in curves]), 3.0
    )
    return value_scale(*limits, label, 5) if limits else empty_scale(label)


def _row_phase(curves: list[tuple[Floats, Floats, Floats]]) -> Scale:
    around = np.concatenate([np.append(*c[1:]) for c in curves])
    limits = limits_around(np.concatenate([c[0] for c in curves]), around, 10.0)
    return phase_scale(*limits, most=4) if limits else empty_scale(tr("phase in degrees"))


def singular_values_figure(responses: MatrixResponses, *, title: str = "") -> Figure:
    """The singular values of the newest matrix over frequency, each with the bound that covers it with 95 %."""
    f = responses.frequency_hz
    values, radius = responses.singular_values[-1], responses.singular_value_bound()[-1]
    curves = [(decibels(v), *bound_db(v.astype(complex), r)) for v, r in zip(values.T, radius.T)]
    y = _row_scale(curves, _singular_label(responses))
    marks: list[Mark] = [_shade(responses, ~responses.valid[-1].all(axis=1))]
    ends = []
    for n, (value, low, high) in enumerate(curves):
        colour = LIGHT.traces[n % len(LIGHT.traces)]
        marks += _curve(f, value, [(colour, (low, high))], colour, _DASHES[n % len(_DASHES)])
        if (known := value[np.isfinite(value)]).size:
            ends.append(End(f"σ{n + 1}", float(known[-1]), colour))
    if not ends:
        marks.append(Note(tr("no line where all columns are valid")))
    left = room(y)
    (panel,), height = stacked(frequency_scale(f), [(y, marks, 260.0)], left=left, width=545.0 - left)
    panel = Panel(panel.left, panel.top, panel.width, panel.height, panel.x, y, marks, ends)
    bounds = tr("bounds: {percent:g} %", percent=100 * COVERAGE)
    return Figure(title or tr("Singular values"), (bounds, *_facts(responses)), (), [panel], height)


def _singular_label(responses: MatrixResponses) -> str:
    units = {unit for row in responses.units for unit in row} - {""}
    if len(units) > 1:
        return tr("singular value in dB (entries have different units)")
    if not units:
        return tr("singular value in dB")
    return tr("singular value in dB re 1 {unit}", unit=shortened(units.pop(), 40))


def _shade(responses: MatrixResponses, invalid: NDArray[np.bool_]) -> Shade:
    """Each invalid line, halfway to its neighbours on the logarithmic scale."""
    edges = frequency_edges(responses.frequency_hz)
    return Shade("invalid", edges[:-1][invalid], edges[1:][invalid], LIGHT.nothing)


def _facts(responses: MatrixResponses) -> Sequence[str]:
    size = tr("{outputs} outputs × {inputs} inputs", outputs=len(responses.outputs), inputs=len(responses.inputs))
    return tr("newest matrix, at {time}", time=moment(responses.time_s[-1], 2)), size, lines_phrase(responses)
