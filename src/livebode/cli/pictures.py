"""What every run draws and prints at its end."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from shutil import get_terminal_size
from typing import Any

from livebode.nouns import Responses
from livebode.session import Draw, Outcome

_ALARMS_SHOWN = 8


def drawing(title: str, names: tuple[str, str]) -> Draw:
    """Draws bode.png and tracking.png."""

    def draw(responses: Responses, into: Path, schedule: str) -> None:
        from livebode.report import save_pictures  # with Matplotlib half a second to import

        save_pictures(responses, into, title=title, schedule_name=schedule, names=names)

    return draw


def show(outcome: Outcome) -> None:
    """The Bode plot in the terminal, and what the run came to."""
    from livebode.report import terminal_bode

    size = get_terminal_size((100, 30))
    print(
        terminal_bode(
            outcome.responses,
            width=min(size.columns, 140),
            height=max(16, min(size.lines - 4, 36)),
            colour=sys.stdout.isatty() and "NO_COLOR" not in os.environ,
            unicode="utf" in (sys.stdout.encoding or "").lower(),
        )
    )
    counts, speed, found = (outcome.summary[part] for part in ("counts", "speed", "found"))
    invalid = f", {counts['invalid_responses']} of them not valid" if counts["invalid_responses"] else ""
    gaps = f", {_many(counts['gaps'], 'gap')}" if counts["gaps"] else ""
    print(
        f"{_many(counts['responses'], 'response')} at {_many(len(found['frequency_hz']), 'line')}{invalid}, "
        f"from {counts['samples']} samples{gaps}: "
        f"{speed['recorded_s']:.1f} s of machine tracked in {speed['run_s']:.2f} s\n{outcome.directory}/"
    )
    if "monitoring" in outcome.summary:
        _show_monitoring(outcome.summary["monitoring"])


def _show_monitoring(found: dict[str, Any]) -> None:
    for sentence in found.get("alarms", [])[:_ALARMS_SHOWN]:
        print(sentence)
    if (more := len(found.get("alarms", [])) - _ALARMS_SHOWN) > 0:
        print(f"and {_many(more, 'alarm')} more in events.jsonl")
    print(found["message"])


def _many(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
