"""Margins of the described loop in a run's report: their table, the proposed filter, and the picture of L."""

from __future__ import annotations

from collections.abc import Sequence
from math import isinf, isnan

from livebode.analysis import MARGIN_WORDS, LoopReport
from livebode.core import Part, Picture, PrintedTable, Section, with_bound
from livebode.language import number, tr, worded
from livebode_control.margins.loop_margins import filter_of


def loop_section(loop: LoopReport, over_time: Sequence[Part]) -> Section:
    """The margins of the loop, with bounds and frequencies, and what shows them over time."""
    margins = loop.margins
    bound = margins.bound()[0]
    rows = []
    for i, (name, unit) in enumerate(zip(margins.names, margins.units)):
        value, at_hz = margins.value[0, i], margins.frequency_hz[0, i]
        if isnan(at_hz):
            size = tr("any amount") if isinf(value) else tr("none")
            rows.append((worded(MARGIN_WORDS[name]), size, "", worded(unit), "", tr("no crossing")))
            continue
        between = margins.place[0, i] == "interpolated"
        mark = tr("between the lines") if between else tr("EXTRAPOLATED: no line checks it")
        sizes = with_bound(value, bound[i])
        rows.append((worded(MARGIN_WORDS[name]), *sizes, worded(unit), number(at_hz, ".4g"), mark))
    headings = (tr("margin"), tr("value"), "±", tr("unit"), tr("at Hz"), tr("range"))
    table = PrintedTable(headings, tuple(rows), (1, 2, 4), _about_margins(loop))
    caption = tr(
        "Open loop L of the fit with its 95 % band, and the measured lines. Below: near −1, with the circle of Ms."
    )
    picture = Picture(
        "livebode_control.margins.loop_picture:loop_figure", {"curves": loop, "title": tr("Open loop")}, caption
    )
    return Section(tr("Margins of the loop"), (table, picture, *over_time))


def _about_margins(loop: LoopReport) -> str:
    size, around, at_hz = loop.at_lines
    filters = filter_of(loop)
    about = tr("Of the fit: {bounds}. ", bounds=worded(loop.fit.about_bounds))
    return about + tr(
        "From the lines alone, without a model, Ms is at least {size:.3g} ± {around:.2g} (at {at:g} Hz). Tuning "
        "{verdict}: {sentence}",
        size=size, around=around, at=at_hz, verdict=worded(filters.verdict), sentence=worded(filters.sentence),
    ) + " " + _about_description(loop)  # fmt: skip


def _about_description(loop: LoopReport) -> str:
    """Whether the margins are of a loop whose description was checked."""
    if loop.checked.verdict == "not checked":
        return tr("The description of the controllers was not compared with the signals.")
    if loop.checked.verdict == "as described":
        return tr("The description of the controllers was compared with the signals: the loop is as described.")
    return tr(
        "The description of the controllers was compared with the signals and does not fit, so the margins are wrong: "
        "{what}.",
        what=loop.checked.sentence,
    )
