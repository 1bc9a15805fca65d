"""The Bode plot in a terminal, compared with plotext 6.1: `python -m bench.decisions.terminal` (docs/decisions).

Needs `pip install plotext==6.1.0`. `python -m bench.decisions.wheels` asks for which platforms it has a wheel.
"""

from __future__ import annotations

import re
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from bench.decisions.former import code_lines, module, source
from livebode.core import Lines, Responses
from livebode.pictures import terminal_bode

PATH = "src/livebode/pictures/terminal.py"
PLOTS, WIDTH, HEIGHT = 200, 100, 30


def resonant(peak: int, lines: int = 30) -> Responses:
    """One response whose magnitude has its maximum at the line with this number."""
    size = 1.0 / (0.02 + np.abs(np.arange(lines) - peak))[np.newaxis, :]
    return Responses(
        lines=Lines(tuple(range(2, 2 + lines)), window=4 * lines, rate_hz=4000.0),
        value=size.astype(complex), sigma=0.01 * size, dof=np.full(1, 5.0), coherence=np.ones((1, lines)),
        valid=np.ones((1, lines), bool), first=np.zeros(1, int), sample=np.full(1, 400), time_s=np.full(1, 0.1),
        schedule=np.full(1, np.nan), unit="",
    )  # fmt: skip


def off_columns(draw: Callable[..., str], peak: int) -> float:
    """Distance of the drawn peak from its place between the ends of the curve, in columns."""
    responses = resonant(peak)
    rows = draw(responses, WIDTH, HEIGHT, False, True).split("\n")
    bottom = next(i for i, row in enumerate(rows) if "└" in row)
    dots = [(i, at) for i, row in enumerate(rows[2:bottom]) for at, c in enumerate(row) if c == "●" or c > "⠀"]
    columns = [at for i, at in dots if i == min(i for i, _ in dots)]
    first, last = min(at for _, at in dots), max(at for _, at in dots)
    x = np.log(responses.lines.frequency_hz)
    place = first + (last - first) * (x[peak] - x[0]) / (x[-1] - x[0])
    return min(abs(column - place) for column in columns)


def import_s(name: str) -> float:
    code = f"import time; b = time.perf_counter(); import {name}; print(time.perf_counter() - b)"
    runs = [subprocess.run([sys.executable, "-c", code], capture_output=True, text=True) for _ in range(5)]
    return statistics.median(float(run.stdout) for run in runs)


def main() -> None:
    drawers = {"plotext 6.1": module(PATH).terminal_bode, "livebode": terminal_bode}
    peaks = np.random.default_rng(3).integers(4, 28, PLOTS).tolist()
    print(f"{PLOTS} plots of {WIDTH} × {HEIGHT} characters")
    for name, draw in drawers.items():
        draw(resonant(3), WIDTH, HEIGHT)
        began = time.perf_counter()
        off = [off_columns(draw, peak) for peak in peaks]
        each_ms = 1e3 * (time.perf_counter() - began) / PLOTS
        coloured = len(draw(resonant(3), WIDTH, HEIGHT, True))
        text = re.sub(r"\x1b\[[0-9;]*m", "", draw(resonant(3), WIDTH, HEIGHT, True))
        print(f"  {name:12} {each_ms:6.2f} ms each, peak off by {max(off):.2f} columns at most, {coloured} characters "
              f"with colour for {len(text)} shown")  # fmt: skip
    former, now = source(PATH), Path(PATH).read_text(encoding="utf-8")
    print(f"lines of code: {code_lines(former)} that drive plotext, {code_lines(now)} that draw")
    print(f"import: plotext {1e3 * import_s('plotext'):.0f} ms, rich.style {1e3 * import_s('rich.style'):.0f} ms")


if __name__ == "__main__":
    main()
