"""The proposed controller in a run's report: margins before, after and of the worst plant, gains, filters, picture."""

from __future__ import annotations

from math import isfinite
from pathlib import Path

from livebode.core import Listing, LivebodeError, Paragraph, Picture, PrintedTable, Section
from livebode.language import number, tr, worded
from livebode_control.proposal.stored_proposal import newest_proposal
from livebode_control.tuning import ControllerProposal
from livebode_control.tuning.gains_text import gains_toml
from livebode_control.tuning.reach import PromiseReach


def proposed_controller(directory: Path, entry: str | None = None) -> Section | str:
    """The newest proposal of `livebode tune`, which nobody may have entered yet."""
    try:
        proposal = newest_proposal(directory, entry)
    except LivebodeError as error:
        return tr("No controller is proposed: {why}.", why=worded(error.words))
    if proposal is None:
        return tr("No controller was proposed. Use `livebode tune RUN` to propose one.")
    caption = tr("Dashed: as described. Solid: proposed. Bands: every plant and place within the 95 % bounds.")
    return Section(
        tr("Proposed controller"),
        (
            _margins(proposal),
            Listing(gains_toml(proposal.feedback.controller)),
            *([_filters(proposal)] if proposal.feedback.notches or proposal.feedback.low_passes else []),
            Paragraph(_reach(proposal.reach)),
            Picture("livebode_control.proposal.tuning_picture:tuning_figure", {"proposal": proposal}, caption),
        ),
    )


def _reach(reach: PromiseReach) -> str:
    """Up to which frequency the promise holds, and above it for which resonances."""
    rows = ", ".join(
        tr("{db} dB from {hz} Hz", db=number(db, ".0f"), hz=number(hz, ".0f")) for hz, db in reach.resonance_db
    )
    words = tr(
        "The promise holds up to the highest line, {hz} Hz; above it if no resonance exceeds the fall that the lines "
        "predict by more than {rows}.",
        hz=number(reach.highest_line_hz, ".4g"),
        rows=rows,
    )
    if reach.shown_hz is None:
        return words
    return f"{words} " + tr("The lines show a mode near {hz} Hz.", hz=number(reach.shown_hz, ".4g"))


def _margins(proposal: ControllerProposal) -> PrintedTable:
    rows = []
    for name, field, unit in (
        (tr("bandwidth"), "bandwidth_hz", "Hz"),
        (tr("gain margin"), "gain_margin_db", "dB"),
        (tr("phase margin"), "phase_margin_deg", "°"),
        (worded("peak sensitivity Ms"), "max_sensitivity", ""),
        (tr("disk margin"), "disk_margin", ""),
    ):
        sides = (proposal.before, proposal.after, proposal.promised)
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


def _filters(proposal: ControllerProposal) -> PrintedTable:
    notches = [
        (tr("notch"), number(f, ".4g"), number(depth, ".3g"), number(damping, ".3g"))
        for f, depth, damping in proposal.feedback.notches
    ]
    corners = [(tr("low-pass of second order"), number(f, ".4g"), "", "") for f in proposal.feedback.low_passes]
    headings = (tr("filter"), "Hz", tr("depth in dB"), tr("width (damping)"))
    return PrintedTable(headings, (*notches, *corners), (1, 2, 3))
