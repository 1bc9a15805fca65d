"""The axis.toml with which `livebode run` tracks a recording of the experiment."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import tomli_w

from livebode.estimation import DETECTION_LINES_MIN
from livebode_design.design import Design


def axis_text(
    design: Design,
    *,
    signals: Mapping[str, str],
    log: str,
    loop: Mapping[str, Any] | None = None,
    motion: Mapping[str, Any] | None = None,
    tracking: Mapping[str, Any] | None = None,
) -> str:
    """The configuration as TOML.

    Parameters
    ----------
    design
        Gives lines, window, hop, and the options for responses and bounds.
    signals
        Names of the recording's channels by role: excitation, input, output, schedule.
    log
        The recording, relative to the file.
    loop
        The tables below [loop], as in docs/reference/configuration.md.
    motion
        The table [motion].
    tracking
        Further keys of [tracking].
    """
    lines, moves = design.waveform.lines, design.machine.stroke_s is not None
    averaged = design.windows > 1 and not moves
    tracked: dict[str, Any] = {"estimator": "joint", "hop": design.hop} | dict(tracking or {})
    if averaged:
        tracked |= {"average": True, "forgetting": 1.0}
    if moves and len(lines.quiet) >= DETECTION_LINES_MIN and not motion:
        tracked |= {"noise": "quiet"}
    tables: dict[str, Any] = {
        "source": {"log": log},
        "signals": signals,
        "lines": {"frequencies": lines.text, "window": lines.window},
        "tracking": tracked,
    }
    tables |= {name: table for name, table in (("motion", motion), ("loop", loop)) if table}
    head = f"# Written by `livebode design`; record {design.recording_s:.4g} s or more.\n\n"
    return head + tomli_w.dumps(tables)
