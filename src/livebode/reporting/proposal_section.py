"""The proposed controller in a run's report: margins before, after and of the worst plant, gains, filters, picture."""

from __future__ import annotations

from math import isfinite

from livebode.core.document import Listing, Picture, PrintedTable, Section
from livebode.language import number, recognised, tr
from livebode.reporting.report_data import ReportData
from livebode.tuning import ControllerProposal
from livebode.tuning.gains_text import gains_toml


def proposed_controller(of: ReportData) -> Section | str:
    """The newest proposal of `livebode tune`, which nobody may have entered yet."""
    found = of.proposal
    if found is None:
        return of.proposal_words
    caption = tr("Dashed: as described. Solid: proposed. Bands: every plant and place within the 95 % bounds.")
    return Section(
        tr("Proposed controller"),
        (
            _margins(found),
            Listing(gains_toml(found.feedback.controller)),
            *([_filters(found)] if found.feedback.notches or found.feedback.low_passes else []),
            Picture("proposal", {"found": found}, caption),
        ),
    )


def _margins(found: ControllerProposal) -> PrintedTable:
    rows = []
    for name, field, unit in (
        (tr("bandwidth"), "bandwidth_hz", "Hz"),
        (tr("gain margin"), "gain_margin_db", "dB"),
        (tr("phase margin"), "phase_margin_deg", "°"),
        (recognised("peak sensitivity Ms"), "max_sensitivity", ""),
        (tr("disk margin"), "disk_margin", ""),
    ):
        sides = (found.before, found.after, found.promised)
        rows.append((name, *(_number(getattr(side, field, None)) for side in sides), unit))
    headings = (tr("margin"), tr("as described"), tr("proposed"), tr("promised"), tr("unit"))
    note = tr(
        "Promised: of the worst plant within the bounds, at the worst place. `livebode tune` writes nothing to a "
        "machine: whether the controller is in use is not known."
    )
    return PrintedTable(headings, tuple(rows), (1, 2, 3), note)


def _number(value: float | None) -> str:
    if value is None:
        return tr("unstable")
    return number(value, ".4g") if isfinite(value) else tr("any amount")


def _filters(found: ControllerProposal) -> PrintedTable:
    notches = [
        (tr("notch"), number(f, ".4g"), number(depth, ".3g"), number(damping, ".3g"))
        for f, depth, damping in found.feedback.notches
    ]
    corners = [(tr("low-pass of second order"), number(f, ".4g"), "", "") for f in found.feedback.low_passes]
    headings = (tr("filter"), "Hz", tr("depth in dB"), tr("width (damping)"))
    return PrintedTable(headings, (*notches, *corners), (1, 2, 3))
