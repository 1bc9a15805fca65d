"""The pictures of `bench.growth`: SVG whose colours follow the light or dark page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from livebode import pictures
from livebode.pictures import (
    ABOVE,
    BELOW,
    LIGHT,
    TITLE,
    WIDTH,
    Dots,
    Entry,
    Figure,
    Scale,
    Trace,
    number_text,
    room,
    save_svg,
)

AGE_TICKS_S = {"minute": 60.0, "hour": 3600.0, "day": 86400.0, "month": 30 * 86400.0, "year": 365 * 86400.0}
_COLUMNS, _HEIGHT = 2, 150.0


@dataclass(frozen=True)
class Panel:
    """A quantity over what it may grow with, on logarithmic axes, and the power of it that is drawn beside."""

    title: str
    x: Sequence[float]
    y: Sequence[float]
    x_label: str
    y_label: str
    power: int
    ticks: dict[str, float]


def draw(path: Path, title: str, facts: str, panels: Sequence[Panel]) -> None:
    """Write the panels, two in a row, as one SVG."""
    rows, one = -(-len(panels) // _COLUMNS), TITLE + ABOVE + _HEIGHT + BELOW
    drawn = []
    for i, panel in enumerate(panels):
        across, down = WIDTH / _COLUMNS * (i % _COLUMNS), one * (i // _COLUMNS)
        drawn.append(_panel(panel, across, down + TITLE + ABOVE))
    key = (
        Entry("measured", LIGHT.run), Entry("in proportion, or constant", LIGHT.muted, "dashed"),
    )  # fmt: skip
    path.parent.mkdir(parents=True, exist_ok=True)
    save_svg(Figure(title, facts.split(" · "), key, drawn, rows * one), path)


def _panel(panel: Panel, left: float, top: float) -> pictures.Panel:
    x, y = np.array(panel.x), np.array(panel.y)
    middle = np.exp(np.mean(np.log(y)) - panel.power * np.mean(np.log(x))) * x**panel.power
    low, high = min(y.min(), middle.min()), max(y.max(), middle.max())
    spread = max(1.6, 3.0 / np.sqrt(high / low))  # a constant is not magnified to its noise
    ticks = [t for t in _round_numbers() if low / spread <= t <= high * spread]
    ticks = ticks if len(ticks) <= 7 else [t for t in ticks if f"{t:e}".startswith("1.")]
    texts = [number_text(t) for t in ticks]
    across = Scale(
        x.min() / 1.2, x.max() * 1.2, list(panel.ticks.values()), list(panel.ticks), (), True, panel.x_label
    )  # fmt: skip
    down = Scale(low / spread, high * spread, ticks, texts, (), True, panel.y_label)
    marks = (
        Trace("power", x, middle, LIGHT.muted, 1.0, "dashed"), Trace("measured", x, y, LIGHT.run, 1.4),
        Dots("measured", x, y, LIGHT.run),
    )  # fmt: skip
    margin = room(down)
    width = WIDTH / _COLUMNS - margin - 14.0
    return pictures.Panel(left + margin, top, width, _HEIGHT, across, down, marks, title=panel.title)


def _round_numbers() -> list[float]:
    """1, 2 and 5 times each power of ten that a panel may show."""
    return [first * 10.0**power for power in range(-3, 6) for first in (1, 2, 5)]
