"""The table that explains a design: what was chosen, and why."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from livebode.design.accuracy import HOLDING_95
from livebode.design.grid import Grid
from livebode.design.limits import Bearable
from livebode.design.machine import UNITS
from livebode.design.peaks import Peak, worst

if TYPE_CHECKING:
    from livebode.design.choose import Design


@dataclass(frozen=True)
class Choice:
    """One row of the table that explains a design."""

    what: str
    value: str
    why: str


def explained(design: Design, found: Grid, amplitude_why: str, recording_why: str) -> tuple[Choice, ...]:
    """The table: what was chosen, and why."""
    waveform, lines, machine = design.waveform, design.waveform.lines, design.machine
    f, window_s = lines.frequency_hz, lines.window / lines.rate_hz
    spacing = f"{np.diff(f).min():g} Hz apart" if len(f) > 1 else "alone"
    bound = HOLDING_95 * design.accuracy.relative / np.sqrt(design.windows)
    weakest = int(np.argmax(design.accuracy.relative))
    rows = [
        Choice("lines", f"{len(f)}, {f[0]:g} … {f[-1]:g} Hz, {spacing}", found.lines_why),
        Choice("window", f"{lines.window} samples, {1000 * window_s:.4g} ms", found.window_why),
        Choice("amplitude", f"{design.amplitude_n_m:.4g} N m", amplitude_why),
        Choice(
            "peak, rms", f"{waveform.peak:.4g}, {waveform.rms:.4g} N m", f"crest factor {waveform.crest_factor:.3f}"
        ),
    ]
    rows += [_limit_row(peak, design.limits) for peak in worst(design.peaks).values()]
    if machine.noise > 0:
        many = f"{design.windows} window{'s' * (design.windows > 1)}"
        told = f"at {f[weakest]:g} Hz after {many}; σ = {machine.noise:g}"
        rows.append(Choice("95 % bound", f"{100 * bound.max():.3g} % of |G|", told))
    rows.append(Choice("recording", f"{design.recording_s:.4g} s", recording_why))
    rows.append(Choice("bring in", f"over {design.ramp_s:.4g} s", "the peaks above are those of the periodic state"))
    even = lines.window % design.hop == 0
    hop_why = "a divisor of the window near a twentieth" if even else "a twentieth; no divisor of the window is near it"
    rows.append(Choice("hop", f"{design.hop} samples", hop_why))
    return tuple(rows)


def _limit_row(peak: Peak, limits: Bearable) -> Choice:
    low, high = limits.of(peak.quantity)
    unit = UNITS[peak.quantity]
    borne = f"limits {low:g} … {high:g}" if peak.quantity == "travel" else f"limit {high:g}"
    limited = np.isfinite(high) or np.isfinite(low)
    size = f"{peak.low:.4g} … {peak.high:.4g}" if peak.quantity == "travel" else f"{peak.size:.3g}"
    alone = (
        f"{peak.own[0]:.4g} … {peak.own[1]:.4g}"
        if peak.quantity == "travel"
        else f"{max(peak.own[1], -peak.own[0]):.3g}"
    )
    where = f", {peak.place}" if peak.place else ""
    return Choice(
        f"peak {peak.quantity}",
        f"{size} {unit}",
        f"{borne if limited else 'no limit'}; the motion alone {alone}{where}",
    )
