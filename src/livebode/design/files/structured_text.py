"""A function block that plays the period on a PLC."""

from __future__ import annotations

import json
from pathlib import Path

from livebode.design.files.facts import facts
from livebode.design.waveform import Waveform
from livebode.structured_text import RAMP_PERIODS_MAX, check_name, multisine


def write_st(path: Path, waveform: Waveform, name: str) -> None:
    """``FB_name``, limited to the period's own peak where the program gives no other w_max; exactly the doubles."""
    check_name(name, "excitation")
    note = "\n".join(f"{key}: {json.dumps(value)}" for key, value in facts(waveform).items())
    text = multisine(
        waveform.samples, rate_hz=waveform.lines.rate_hz, limit=waveform.peak, name=f"FB_{name}", note=note,
        ramp_periods=min(waveform.ramp_periods, RAMP_PERIODS_MAX),
    )  # fmt: skip
    path.write_text(text, encoding="ascii")
