"""Pictures and printed results of an output-only run."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from shutil import get_terminal_size
from typing import TYPE_CHECKING, Any

import numpy as np

from livebode.cli import is_terminal, print_drawn
from livebode.core import INTERVAL_FACTOR, counted
from livebode.locations import original
from livebode.pictures import Canvas, CellScale, clock, linear_ticks, written
from livebode.runtime import Outcome
from livebode_modes.curves import ModeCurve, mode_curves
from livebode_modes.tone_windows import tone_event

if TYPE_CHECKING:
    from livebode_modes.estimate import OutputOnly

_WIDTH_MIN, _HEIGHT_MIN = 40, 10


def terminal_modes(
    curves: Sequence[ModeCurve], width: int = 80, height: int = 20, colour: bool = True, unicode: bool = True
) -> str:
    """Frequency in Hz over time as text; empty below 40 × 10, and if no mode was found.

    Parameters
    ----------
    curves
        Modes and harmonics.
    width, height
        Columns and lines of the terminal; the text is never wider or higher.
    colour
        Whether to use ANSI colours.
    unicode
        False uses only ASCII.
    """
    time_s, f = (
        np.concatenate([getattr(curve, name) for curve in curves] or [np.zeros(0)])
        for name in ("time_s", "frequency_hz")
    )
    known = np.isfinite(f)
    if width < _WIDTH_MIN or height < _HEIGHT_MIN or not known.any():
        return ""
    origin_s, label = clock(time_s)
    time_s = time_s[known] - origin_s
    low, high = _limits(f[known], 0.01)
    begin, end = _limits(time_s, 0.0)
    marks = [(tick, f"{tick:g}") for tick in linear_ticks(low, high, most=max(3, height // 4))]
    margin = max(len(text) for _, text in marks)
    rows, columns = height - 5, width - margin - 2
    level, across = CellScale(high, low, rows), CellScale(begin, end, columns)
    canvas = Canvas.blank(rows, columns)
    canvas.dots[level.dot(f[known], 4), across.dot(time_s, 2)] = True
    marked = {level.cell(tick): text for tick, text in marks}
    lines = ["frequency in Hz".center(width).rstrip()]
    for row in range(rows):
        side = f"{marked.get(row, ''):>{margin}}{'┤' if row in marked else '│'}"
        lines.append(f"{side}{canvas.row(row, colour, unicode)}│")
    lines += _time_axis(across, begin, end, margin)
    lines.append(label.center(width).rstrip())
    text = "\n".join(lines)
    return text if unicode else written(text)


def _limits(values: np.ndarray, share: float) -> tuple[float, float]:
    low, high = float(values.min()), float(values.max())
    margin = max(0.05 * (high - low), share * abs(high), 1e-9)
    return low - margin * (share > 0), high + margin


def _time_axis(across: CellScale, begin: float, end: float, margin: int) -> list[str]:
    edge, numbers = ["─"] * across.cells, ""
    for tick in linear_ticks(begin, end, most=max(3, across.cells // 12)):
        cell, text = across.cell(tick), f"{tick:g}"
        edge[cell] = "┬"
        first = min(max(cell - (len(text) - 1) // 2, 0), across.cells - len(text))
        if first > len(numbers) or not numbers:
            numbers = numbers.ljust(first) + text
    return [" " * margin + f"└{''.join(edge)}┘", " " * (margin + 1) + numbers]


def draw_modes(estimate: OutputOnly, into: Path) -> None:
    """Draw modes.svg into the directory of a run."""
    from livebode.records import RunRecord
    from livebode_modes.picture import save_modes

    run, axis = RunRecord.open(into, output_only=True), estimate.axis
    assert axis is not None
    title = f"{axis.source.title}: {axis.signals.output}"
    save_modes(mode_curves(run), into, title=title, facts=_facts(run.summary))


def _facts(summary: dict[str, Any]) -> list[str]:
    facts = summary["found"]
    return [
        f"from the output alone: {', '.join(facts['outputs'])}",
        f"{counted(len(summary['modes']), 'mode')}, {counted(len(summary['harmonics']), 'harmonic')}",
        f"window {facts['window'] / facts['rate_hz']:.4g} s", "95 % bounds",
    ]  # fmt: skip


def show_modes(outcome: Outcome) -> None:
    """Print the frequencies over time and one line for each mode."""
    from livebode.records import RunRecord

    size = get_terminal_size((100, 30))
    text = terminal_modes(
        mode_curves(RunRecord.open(outcome.directory, output_only=True)),
        width=min(size.columns, 140),
        height=max(10, min(size.lines - 4, 24)),
        colour=is_terminal() and "NO_COLOR" not in os.environ,
        unicode="utf" in (sys.stdout.encoding or "").lower(),
    )
    if text:
        print_drawn(text)
    for line in mode_lines(outcome.summary):
        print(line)
    print(f"{original(str(outcome.directory))}/")


def mode_lines(summary: dict[str, Any]) -> list[str]:
    """The result of an output-only run in sentences."""
    counts, facts, speed = summary["counts"], summary["found"], summary["speed"]
    low_hz, high_hz = facts["band_hz"]
    lines = [_mode(track) for track in summary["modes"]]
    lines += [_moving_tone(tone) for tone in summary["moving_tones"]]
    lines = lines or [_no_mode(facts["window"] / facts["rate_hz"])]
    lines += [_harmonic(track) for track in summary["harmonics"]]
    gaps = f", {counted(counts['gaps'], 'gap')}" if counts["gaps"] else ""
    lines.append(
        f"{counted(counts['windows'], 'window')} of {facts['window'] / facts['rate_hz']:.4g} s, one every "
        f"{facts['hop'] / facts['rate_hz']:.4g} s, {low_hz:.4g} … {high_hz:.4g} Hz, from {counts['samples']} samples"
        f"{gaps}: {speed['recorded_s']:.1f} s of output in {speed['run_s']:.2f} s"
    )
    return lines


def _no_mode(window_s: float) -> str:
    """With the width 2ζf of a resonance whose decay fits ten times into the window."""
    width_hz = 10 / (math.pi * window_s)
    return (
        f"no mode was found; a window of {window_s:.3g} s shows resonances wider than {width_hz:.2g} Hz: record longer "
        "for narrower ones (or --window), or choose a band around the expected frequency (--band)"
    )


def _mode(track: dict[str, Any]) -> str:
    newest = track["newest"]
    half_hz, half = (INTERVAL_FACTOR * newest[name] for name in ("frequency_hz_sigma", "damping_sigma"))
    return (
        f"{track['name']}: {newest['frequency_hz']:.5g} ± {half_hz:.2g} Hz, damping "
        f"{100 * newest['damping']:.3g} ± {100 * half:.2g} %, "
        f"{100 * newest['share']:.0f} % of the power (newest); {_range(track)}"
    )


def _harmonic(track: dict[str, Any]) -> str:
    return (
        f"{track['name']}: {track['newest']['frequency_hz']:.5g} Hz, constant amplitude and almost no damping: not a "
        f"mode; {_range(track)}"
    )


def _moving_tone(tone: dict[str, Any]) -> str:
    return f"{tone_event(tone).message} (--input CHANNEL --estimator lpm; --from, --to)"


def _range(track: dict[str, Any]) -> str:
    low, high = track["frequency_hz"]
    return f"{low:.5g} … {high:.5g} Hz over {track['found']} of {counted(track['rows'], 'window')}"
