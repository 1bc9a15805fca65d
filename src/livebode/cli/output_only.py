"""Pictures and printed results of an output-only run."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from shutil import get_terminal_size
from typing import TYPE_CHECKING, Any

from livebode.cli.picture_support import can_draw, tell_how_to_draw
from livebode.cli.pictures import one_drawing_at_a_time
from livebode.cli.terminal import is_terminal, print_drawn
from livebode.core import counted
from livebode.locations import original

if TYPE_CHECKING:
    from livebode.runtime import OutputOnlyOutcome


def draw_modes(into: Path, title: str) -> None:
    """Draw modes.png into the directory of a run, if Matplotlib is installed."""
    if not can_draw():
        return
    from livebode.analysis.mode_curves import mode_curves
    from livebode.records import RunRecord
    from livebode.report.modes import save_modes  # with Matplotlib half a second to import

    run = RunRecord.open(into, output_only=True)
    with one_drawing_at_a_time():
        save_modes(mode_curves(run), into, title=title, facts=_facts(run.summary))


def _facts(summary: dict[str, Any]) -> str:
    found = summary["found"]
    return (
        f"from the output alone: {', '.join(found['outputs'])} · {counted(len(summary['modes']), 'mode')}, "
        f"{counted(len(summary['harmonics']), 'harmonic')} · window {found['window'] / found['rate_hz']:.4g} s · "
        "95 % bounds"
    )


def show_modes(outcome: OutputOnlyOutcome) -> None:
    """Print the frequencies over time and one line for each mode."""
    from livebode.analysis.mode_curves import mode_curves
    from livebode.records import RunRecord
    from livebode.report.terminal_modes import terminal_modes

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
    tell_how_to_draw()


def mode_lines(summary: dict[str, Any]) -> list[str]:
    """The result of an output-only run in sentences."""
    counts, found, speed = summary["counts"], summary["found"], summary["speed"]
    low_hz, high_hz = found["band_hz"]
    lines = [_mode(track) for track in summary["modes"]] or ["no mode was found"]
    lines += [_harmonic(track) for track in summary["harmonics"]]
    gaps = f", {counted(counts['gaps'], 'gap')}" if counts["gaps"] else ""
    lines.append(
        f"{counted(counts['windows'], 'window')} of {found['window'] / found['rate_hz']:.4g} s, one every "
        f"{found['hop'] / found['rate_hz']:.4g} s, {low_hz:.4g} … {high_hz:.4g} Hz, from {counts['samples']} samples"
        f"{gaps}: {speed['recorded_s']:.1f} s of output in {speed['run_s']:.2f} s"
    )
    return lines


def _mode(track: dict[str, Any]) -> str:
    newest = track["newest"]
    return (
        f"{track['name']}: {newest['frequency_hz']:.5g} ± {1.96 * newest['frequency_hz_sigma']:.2g} Hz, damping "
        f"{100 * newest['damping']:.3g} ± {100 * 1.96 * newest['damping_sigma']:.2g} %, "
        f"{100 * newest['share']:.0f} % of the power (newest); {_range(track)}"
    )


def _harmonic(track: dict[str, Any]) -> str:
    return (
        f"{track['name']}: {track['newest']['frequency_hz']:.5g} Hz, constant amplitude and almost no damping: not a "
        f"mode; {_range(track)}"
    )


def _range(track: dict[str, Any]) -> str:
    low, high = track["frequency_hz"]
    return f"{low:.5g} … {high:.5g} Hz over {track['found']} of {counted(track['rows'], 'window')}"
