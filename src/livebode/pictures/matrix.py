"""The pictures of a matrix run: a matrix of Bode plots, and the singular values over frequency."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import COVERAGE, REASONS, MatrixResponses, decibels, moment
from livebode.language import tr, worded
from livebode.pictures._style import Style, drawing, heading, new_figure, plain, shortened, style
from livebode.pictures.curves import bound_db
from livebode.pictures.plots import FEW_LINES, alone, bound
from livebode.pictures.png import save
from livebode.pictures.words import lines_phrase

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_LEFT_IN, _RIGHT_IN, _TOP_IN, _BOTTOM_IN = 0.85, 0.2, 1.25, 0.55
_DASHES = ((), (5, 2), (1.5, 1.5), (5, 2, 1.5, 2))


def save_matrix_pictures(
    responses: MatrixResponses, directory: str | PathLike[str], *, title: str = "", dark: bool = False
) -> list[Path]:
    """Write bode.png and singular-values.png to an existing directory and return their paths.

    The same responses give the same bytes: the files contain no date and no version.

    Raises
    ------
    OSError
        If a file cannot be written.
    """
    look = style(dark)
    with drawing(look):
        pictures = {
            "bode.png": matrix_figure(responses, title=title, dark=dark),
            "singular-values.png": singular_values_figure(responses, title=title, dark=dark),
        }
        return [save(figure, Path(directory) / name, look) for name, figure in pictures.items()]


def matrix_figure(
    responses: MatrixResponses, *, title: str = "", dark: bool = False, width_in: float | None = None
) -> Figure:
    """A Bode plot of each entry: outputs down, inputs across, with the 95 % bounds of the newest matrix.

    Lines at which a column is invalid are shaded in its plots, with the reason where there is none that is valid.
    Without `width_in`, the width follows the number of inputs.
    """
    look, (down, across) = style(dark), responses.value.shape[2:]
    with drawing(look):
        from livebode.pictures.scales import frequency_axis

        width, height = width_in or max(9.0, 1.05 + 3.4 * across), 1.8 + 3.2 * down
        figure = new_figure(width, height)
        left = _LEFT_IN / width
        heading(figure, look, title or tr("Bode plots"), _facts(responses), left)
        _key(figure, look, left, bool((responses.reason != 0).any()))
        panels = _panels(figure, down, across)
        responses.plot(axes=panels, color=look.newest)
        for o in range(down):
            for i in range(across):
                _entry(list(panels[2 * o : 2 * o + 2, i]), look, responses, (o, i))
            _label(panels[2 * o, 0], responses.units[o] if responses.units else ("",))
            panels[2 * o + 1, 0].set_ylabel(tr("phase in degrees"))
        for axes in panels.ravel():
            plain(axes)
            frequency_axis(axes, responses.frequency_hz, labels=axes in panels[-1])
        for axes in panels[-1]:
            axes.set_xlabel(tr("frequency in Hz"))
    return figure


def singular_values_figure(responses: MatrixResponses, *, title: str = "", dark: bool = False) -> Figure:
    """The singular values of the newest matrix over frequency, each with the bound that covers it with 95 %."""
    look, f = style(dark), responses.frequency_hz
    with drawing(look):
        from livebode.pictures.scales import frequency_axis

        figure, bounds = new_figure(9.0, 4.8), tr("bounds: {percent:g} %", percent=100 * COVERAGE)
        heading(
            figure,
            look,
            title or tr("Singular values"),
            f"{bounds} · {_facts(responses)}",
            0.085,
        )
        axes = figure.add_axes((0.085, 0.115, 0.79, 0.72))
        values, radius = responses.singular_values[-1], responses.singular_value_bound()[-1]
        ends = [bound_db(value, around) for value, around in zip(values.T.astype(complex), radius.T)]
        for n, (value, (low, high)) in enumerate(zip(values.T, ends)):
            _singular_value(axes, look, f, n, value, low, high)
        _limits(axes, decibels(values), np.array(ends))
        plain(axes)
        frequency_axis(axes, f, labels=True)
        _shade(axes, look, responses, ~responses.valid[-1].all(axis=1))
        axes.set_xlabel(tr("frequency in Hz"))
        axes.set_ylabel(_singular_label(responses))
        if np.isfinite(values).any():
            axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)
        else:
            axes.set_yticks([])
            _note(axes, look, tr("no line where all columns are valid"))
    return figure


def _panels(figure: Figure, down: int, across: int) -> NDArray[np.object_]:
    """Axes of shape (2 · down, across), each magnitude close to its phase."""
    width, height = figure.get_size_inches()
    outer = figure.add_gridspec(
        down, across, left=_LEFT_IN / width, right=1 - _RIGHT_IN / width, top=1 - _TOP_IN / height,
        bottom=_BOTTOM_IN / height, hspace=0.2, wspace=0.08,
    )  # fmt: skip
    panels = np.empty((2 * down, across), dtype=object)
    for o in range(down):
        for i in range(across):
            inner = outer[o, i].subgridspec(2, 1, height_ratios=[3, 2], hspace=0.08)
            for part in range(2):
                first = panels[2 * o + part, 0]
                panels[2 * o + part, i] = figure.add_subplot(inner[part], sharex=panels[0, 0], sharey=first)
                panels[2 * o + part, i].tick_params(labelleft=i == 0)
    return panels


def _entry(pair: Sequence[Axes], look: Style, responses: MatrixResponses, place: tuple[int, int]) -> None:
    """Title of one Bode plot, its invalid lines, and the reason if all are."""
    o, i = place
    magnitude, phase = pair
    units = responses.units[o] if responses.units else ()
    unit = f", re 1 {units[i]}" if len(set(units)) > 1 and units[i] else ""  # a symbol in every language
    magnitude.set_title(shortened(f"{responses.inputs[i]} → {responses.outputs[o]}{unit}", 44), fontsize="medium")
    invalid = ~responses.valid[-1, :, i]
    for axes in pair:
        _shade(axes, look, responses, invalid)
    if invalid.all():
        words = sorted({worded(REASONS[number]) for number in responses.reason[-1, :, i]})
        _note(magnitude, look, tr("not valid: {why}", why=", ".join(words)))
    if i:
        phase.set_ylabel("")


def _label(axes: Axes, units: tuple[str, ...]) -> None:
    """The label of the magnitudes of one output, with their unit if they have one in common."""
    common = units[0] if len(set(units)) == 1 else ""
    label = tr("magnitude in dB") + (f"\nre 1 {shortened(common, 26)}" if common else "")
    axes.set_ylabel(label)


def _singular_value(axes: Axes, look: Style, f: Floats, n: int, value: Floats, low: Floats, high: Floats) -> None:
    """One singular value and the ends of its bound in dB."""
    colour, db = look.traces[n % len(look.traces)], decibels(value)
    mark: dict[str, Any] = {"marker": "o", "markersize": 3.5} if len(f) <= FEW_LINES else {}
    (line,) = axes.plot(f, db, color=colour, linewidth=1.2, label=f"σ{n + 1}", **mark)
    line.set_dashes(_DASHES[n % len(_DASHES)])
    single = alone(value)
    axes.plot(f[single], db[single], "o", color=colour, markersize=3)
    bound(axes, f, low, high, colour)


def _limits(axes: Axes, db: Floats, ends: Floats) -> None:
    """Limits that contain the values, and bounds as far as these leave room for the values."""
    drawn, ends = db[np.isfinite(db)], ends[np.isfinite(ends)]
    if not drawn.size:
        return
    low, high = drawn.min(), drawn.max()
    reach = max(0.35 * (high - low), 3.0)
    low = max(ends.min(initial=low), low - reach)
    high = min(ends.max(initial=high), high + reach)
    margin = max(0.04 * (high - low), 1.0)
    axes.set_ylim(low - margin, high + margin)


def _singular_label(responses: MatrixResponses) -> str:
    units = {unit for row in responses.units for unit in row} - {""}
    if len(units) > 1:
        return tr("singular value in dB (entries have different units)")
    if not units:
        return tr("singular value in dB")
    return tr("singular value in dB re 1 {unit}", unit=shortened(units.pop(), 40))


def _shade(axes: Axes, look: Style, responses: MatrixResponses, invalid: NDArray[np.bool_]) -> None:
    """Shade each invalid line, halfway to its neighbours on the logarithmic scale."""
    f = responses.frequency_hz
    between = np.sqrt(f[1:] * f[:-1]) if f.size > 1 else f * 1.1
    low = np.concatenate([f[:1] ** 2 / between[:1], between])
    high = np.concatenate([between, f[-1:] ** 2 / between[-1:]])
    for k in np.flatnonzero(invalid):
        axes.axvspan(low[k], high[k], color=look.nothing, alpha=0.6, linewidth=0, zorder=0.5, gid="invalid")


def _note(axes: Axes, look: Style, text: str) -> None:
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", size=10, color=look.muted)


def _facts(responses: MatrixResponses) -> str:
    size = tr("{outputs} outputs × {inputs} inputs", outputs=len(responses.outputs), inputs=len(responses.inputs))
    newest = tr("newest matrix, at {time}", time=moment(responses.time_s[-1], 2))
    return f"{newest} · {size} · {lines_phrase(responses)}"


def _key(figure: Figure, look: Style, left: float, invalid: bool) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Line2D | Patch] = [Line2D([], [], color=look.newest, linewidth=1.6)]
    texts = [
        tr(
            "response; {percent:g} % bounds of each entry alone, as bars where larger than the marker",
            percent=100 * COVERAGE,
        )
    ]
    if invalid:
        handles.append(Patch(facecolor=look.nothing, alpha=0.6))
        texts.append(tr("not valid"))
    place = (left, 1 - 0.74 / figure.get_size_inches()[1])
    figure.legend(
        handles, texts, loc="upper left", bbox_to_anchor=place, ncols=2, borderpad=0.0, borderaxespad=0.0,
        handlelength=1.6,
    )  # fmt: skip
