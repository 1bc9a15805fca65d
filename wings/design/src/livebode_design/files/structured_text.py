"""A function block that plays the period on a PLC."""

from __future__ import annotations

from pathlib import Path

from livebode.excitation import Waveform
from livebode.structured_text import check_name, multisine
from livebode_design.files.facts import as_lines, facts


def write_st(path: Path, waveform: Waveform, name: str) -> None:
    """``FB_name``, limited to the period's own peak by default (w_max); the values are exactly the doubles."""
    check_name(name, "excitation")
    note = "\n".join(as_lines(facts(waveform)))
    text = multisine(
        waveform.samples, rate_hz=waveform.lines.rate_hz, limit=waveform.peak, name=f"FB_{name}", note=note,
        ramp_periods=waveform.ramp_periods,
    )  # fmt: skip
    path.write_text(text, encoding="ascii")
