"""Runs of known responses, written as a run writes them, for the tests of reports."""

from __future__ import annotations

from collections.abc import Iterable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np

from livebode.core import Event, Lines, Responses
from livebode.records import RunDirectory

LINES = Lines.parse("20:140:20", rate_hz=4000, window=400)
HOP = 200


def strokes(rows: int, low: float = 0.25, high: float = 1.6, per_stroke: int = 60) -> np.ndarray:
    """A position that goes back and forth."""
    return low + (high - low) * np.abs((np.arange(rows) / per_stroke + 1) % 2 - 1)


def plant(frequency_hz: np.ndarray, resonance_hz: np.ndarray | float) -> np.ndarray:
    """A lightly damped resonance for each row, (rows, lines)."""
    x = frequency_hz / np.reshape(resonance_hz, (-1, 1))
    return 3 / (1 - x**2 + 0.1j * x)


def measured(rows: int, seed: int, *, resonance_hz: Any = 62.0, noise: float = 0.02, **more: Any) -> Responses:
    """Responses of windows that overlap by half, with the noise that such windows share."""
    generator = np.random.default_rng(seed)
    true = np.broadcast_to(plant(LINES.frequency_hz, resonance_hz), (rows, len(LINES)))
    drawn = generator.standard_normal((2, rows + 1, len(LINES)))
    single = (drawn[0] + 1j * drawn[1]) / 2
    number = HOP * np.arange(rows) + LINES.window - 1
    return Responses(
        lines=LINES,
        value=true + noise * np.abs(true) * (single[1:] + single[:-1]),
        sigma=noise * np.abs(true),
        dof=np.full(rows, 9.0),
        coherence=np.full(true.shape, 0.99),
        valid=np.ones(true.shape, dtype=bool),
        first=number - LINES.window + 1,
        sample=number,
        time_s=(number - LINES.window / 2) / LINES.rate_hz,
        schedule=more.pop("schedule", np.full(rows, np.nan)),
        **{"quantity": "plant", "unit": "rad/s/(N m)"} | more,
    )


def write_run(
    path: Path, responses: Responses, *, configuration: dict[str, Any] | None = None, events: Iterable[Event] = (),
    **more: Any,
) -> Path:  # fmt: skip
    """A run's directory that holds these."""
    lines = responses.lines
    found = {
        "rate_hz": lines.rate_hz, "window": lines.window, "bins": list(lines.bins), "quiet_bins": list(lines.quiet),
        "frequency_hz": lines.frequency_hz.tolist(), "hop": HOP, "quantity": responses.quantity,
        "unit": responses.unit,
    }  # fmt: skip
    signals = {"output": "y", "input": "u", "excitation": "w", "schedule": "x"}
    asked = {"source": {"log": "monday.parquet"}, "signals": signals} if configuration is None else configuration
    with RunDirectory(path) as out:
        out.write(responses)
        for event in events:
            out.write_event(event)
        out.finish({"configuration": asked, "found": found, "versions": {"livebode": "9.8.7"}} | more, lambda _: None)
    return path


class Page(HTMLParser):
    """A page taken apart: its tags with attributes, its text, and the text of each kind of tag."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[str] = []
        self._within: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        self._within.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        while self._within and self._within.pop() != tag:
            pass

    def handle_data(self, data: str) -> None:
        if "style" not in self._within:
            self.texts.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.texts).split())
