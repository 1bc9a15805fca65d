"""The axis.toml with which `livebode run` tracks a recording of the experiment."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import tomli_w

from livebode.core import Lines
from livebode.estimation import DETECTION_LINES_MIN
from livebode.experiment_design.design import Design


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
        "lines": {"frequencies": lines_text(lines), "window": lines.window},
        "tracking": tracked,
    }
    tables |= {name: table for name, table in (("motion", motion), ("loop", loop)) if table}
    head = f"# Written by `livebode design`; record {design.recording_s:.4g} s or more.\n\n"
    return head + tomli_w.dumps(tables)


def lines_text(lines: Lines) -> str:
    """The lines as `Lines.parse` reads them: in Hz where that is short, else in bins.

    >>> lines_text(Lines((2, 4, 6, 9), window=400, rate_hz=4000.0))
    '20:60:20, 90'
    >>> lines_text(Lines((1, 2, 3), window=2047, rate_hz=4000.0))
    'k=1:3:1'
    """
    runs = _runs(list(lines.bins))
    in_hz = [[f"{k * lines.rate_hz / lines.window:.6g}" for k in run] for run in runs]
    exact = all(float(f) == k * lines.rate_hz / lines.window for fs, run in zip(in_hz, runs) for f, k in zip(fs, run))
    if exact:
        return ", ".join(":".join(fs) for fs in in_hz)
    return ", ".join(f"k={':'.join(map(str, run))}" for run in runs)


def _runs(bins: list[int]) -> list[list[int]]:
    """Ranges of bins with a constant step, each as start, stop and step, or single bins."""
    runs: list[list[int]] = []
    at = 0
    while at < len(bins):
        step = bins[at + 1] - bins[at] if at + 1 < len(bins) else 0
        end = at + 1
        while end + 1 < len(bins) and bins[end + 1] - bins[end] == step:
            end += 1
        if end - at >= 2 and end < len(bins):
            runs.append([bins[at], bins[end], step])
            at = end + 1
        else:
            runs.append([bins[at]])
            at += 1
    return runs
