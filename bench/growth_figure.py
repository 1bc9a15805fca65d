"""The pictures of `bench.growth`: SVG whose colours follow the light or dark page."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np

from livebode.pictures import drawing, heading, new_figure, plain
from livebode.pictures._style import DARK, LIGHT
from livebode_reports.svg import draw_svg, themed_svg, variables

HEAD_IN = 0.95
AGE_TICKS_S = {"minute": 60.0, "hour": 3600.0, "day": 86400.0, "month": 30 * 86400.0, "year": 365 * 86400.0}


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
    rows = -(-len(panels) // 2)
    width_in, height_in = 8.6, HEAD_IN + 2.9 * rows
    with drawing(LIGHT), matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": path.stem}):
        figure = new_figure(width_in, height_in)
        for i, panel in enumerate(panels, 1):
            _draw_panel(figure.add_subplot(rows, 2, i), panel)
        figure.tight_layout(rect=(0, 0, 1, 1 - HEAD_IN / height_in), w_pad=2.0, h_pad=1.5)
        heading(figure, LIGHT, title, facts, 0.2 / width_in)
        text = io.StringIO()
        draw_svg(figure, text)
    svg = re.sub(r"<metadata>.*?</metadata>", "", text.getvalue(), flags=re.S)
    svg = themed_svg(svg[svg.index("<svg") :], f"{title}: {facts}")
    colours = f":root {{ {variables(LIGHT)} }} @media (prefers-color-scheme: dark) {{ :root {{ {variables(DARK)} }} }}"
    names = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
    svg = re.sub(r"<svg ([^>]*)>", rf"<svg {names} \1>\n<style>{colours}</style>", svg, count=1)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(svg, encoding="utf-8")


def _draw_panel(axes: matplotlib.axes.Axes, panel: Panel) -> None:
    x, y = np.array(panel.x), np.array(panel.y)
    middle = np.exp(np.mean(np.log(y)) - panel.power * np.mean(np.log(x)))
    kind = "in proportion" if panel.power else "constant"
    axes.plot(x, middle * x**panel.power, color=LIGHT.muted, linewidth=1.0, linestyle="--", label=kind)
    axes.plot(x, y, color=LIGHT.run, linewidth=1.4, marker="o", markersize=4.0, label="measured")
    axes.set_xscale("log")
    axes.set_yscale("log")
    low, high = min(y.min(), (middle * x**panel.power).min()), max(y.max(), (middle * x**panel.power).max())
    spread = max(1.6, 3.0 / np.sqrt(high / low))  # a constant is not magnified to its noise
    axes.set_ylim(low / spread, high * spread)
    axes.set_xticks(list(panel.ticks.values()), list(panel.ticks))
    axes.minorticks_off()
    ticks = [t for t in _round_numbers() if low / spread <= t <= high * spread]
    ticks = ticks if len(ticks) <= 7 else [t for t in ticks if f"{t:e}".startswith("1.")]
    axes.set_yticks(ticks, [f"{t:,g}" for t in ticks])
    axes.set_xlabel(panel.x_label)
    axes.set_ylabel(panel.y_label)
    axes.set_title(panel.title, loc="left", fontsize=10.5, color=LIGHT.ink)
    axes.legend(loc="best")
    plain(axes)


def _round_numbers() -> list[float]:
    """1, 2 and 5 times each power of ten that a panel may show."""
    return [first * 10.0**power for power in range(-3, 6) for first in (1, 2, 5)]
