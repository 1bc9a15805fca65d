"""How cost and memory grow with axes, lines, samples, and the age of a run.

    python -m bench.growth [lines] [samples] [axes] [age]

Prints a table for each and draws the pictures of docs/explanation/performance.md; what is not measured is drawn as it
was (docs/images/performance/growth.json). Cost is processor time. An exponent is the slope of the logarithm of the cost
over the logarithm of what it grows with, with the half-width of its 95 % bound: 1 is proportional, 0 does not grow.
Every process that is measured is a new one.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.stats import t as student

from bench import growth_age, growth_axes, growth_lines, growth_live, growth_samples
from bench.growth_figure import AGE_TICKS_S, Panel, draw
from bench.processes import apart

IMAGES = Path(__file__).parents[1] / "docs" / "images" / "performance"
PROPORTIONAL_MAX, CONSTANT_MAX = 1.1, 0.02
AXIS_MB_MAX = 4.0
FULL_S = 3600.0
"""Age from which all stores of a run that have a bound are full."""
Panels = dict[str, Panel]
"""Of the cost, and of the memory where that is measured."""


def exponent(x: Sequence[float], y: Sequence[float]) -> tuple[float, float]:
    """Slope of log y over log x by least squares, and the half-width of its 95 % bound."""
    a, b = np.log(x), np.log(y)
    a -= a.mean()
    slope = float(a @ b / (a @ a))
    rest = b - b.mean() - slope * a
    sigma = np.sqrt(rest @ rest / (len(a) - 2) / (a @ a))
    return slope, float(student.ppf(0.975, len(a) - 2) * sigma)


def judge(what: str, x: Sequence[float], y: Sequence[float], most: float) -> None:
    """Print an exponent and whether it is within its target."""
    slope, bound = exponent(x, y)
    print(f"{what}: exponent {slope:.3f} ± {bound:.3f}, target ≤ {most:g}: {verdict(slope <= most)}", flush=True)


def verdict(reached: bool) -> str:
    return "met" if reached else "missed"


def table(titles: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Print a table in Markdown."""
    print("\n| " + " | ".join(titles) + " |\n" + "|---" * len(titles) + "|")
    for row in rows:
        print("| " + " | ".join(f"{one:.4g}" if isinstance(one, float) else f"{one}" for one in row) + " |")


def of_axes(folder: Path) -> Panels:
    apart(growth_live.prepare, folder)
    found = [apart(growth_axes.measure, folder, axes) for axes in growth_axes.AXES]
    axes, cost, memory = ([getattr(one, name) for one in found] for name in ("axes", "ms_per_s", "resident_mb"))
    table(("axes", "ms per s", "ms per s, an axis", "resident, MB"),
          [(n, ms, ms / n, mb) for n, ms, mb in zip(axes, cost, memory)])  # fmt: skip
    judge("cost over axes", axes, cost, PROPORTIONAL_MAX)
    each_mb = (memory[-1] - memory[0]) / (axes[-1] - axes[0])
    print(f"memory of an axis: {each_mb:.2f} MB, target ≤ {AXIS_MB_MAX:g}: {verdict(each_mb <= AXIS_MB_MAX)}")
    ticks = {f"{n}": float(n) for n in axes}
    added = [each_mb + mb - memory[0] for mb in memory]
    return {
        "cost": Panel("Axes of a process", axes, cost, "axes", "processor time, ms per s", 1, ticks),
        "memory": Panel("Axes of a process", axes, added, "axes", "memory of the axes, MB", 1, ticks),
    }


def of_lines(_: Path) -> Panels:
    found = apart(growth_lines.measure)
    lines, cost = [one.lines for one in found], [one.ms_per_s for one in found]
    table(("lines", "tracker, ms per s", "µs per s, a line"), [(n, ms, 1e3 * ms / n) for n, ms in zip(lines, cost)])
    judge("cost over lines", lines, cost, PROPORTIONAL_MAX)
    ticks = {f"{n}": float(n) for n in lines}
    return {"cost": Panel("Lines of a tracker", lines, cost, "lines", "processor time, ms per s", 1, ticks)}


def of_samples(folder: Path) -> Panels:
    for minutes in growth_samples.MINUTES:
        apart(growth_samples.write, folder / f"{minutes}.parquet", minutes)
    found = [apart(growth_samples.measure, folder, minutes) for minutes in growth_samples.MINUTES]
    length, cost, memory = ([getattr(one, name) for one in found] for name in ("minutes", "cpu_s", "peak_mb"))
    table(("recording, min", "million samples", "processor time, s", "ms per s", "peak memory, MB"),
          [(n, 240e3 * n / 1e6, s, 1e3 * s / (60 * n), mb) for n, s, mb in zip(length, cost, memory)])  # fmt: skip
    judge("cost over samples", length, cost, PROPORTIONAL_MAX)
    judge("memory over samples", length, memory, CONSTANT_MAX)
    ticks = {f"{n}": float(n) for n in length}
    return {
        "cost": Panel("Length of a recording", length, cost, "minutes at 4 kHz", "processor time, s", 1, ticks),
        "memory": Panel("Length of a recording", length, memory, "minutes at 4 kHz", "peak memory, MB", 0, ticks),
    }


def of_age(folder: Path) -> Panels:
    apart(growth_live.prepare, folder)
    found = apart(growth_age.measure, folder)
    age, cost, memory = ([getattr(one, name) for one in found] for name in ("age_s", "ms_per_s", "resident_mb"))
    nearest = {name: int(np.argmin(np.abs(np.log(np.array(age) / s)))) for name, s in growth_age.AGES_S.items()}
    table(("age", "ms per s", "resident, MB"), [(name, cost[i], memory[i]) for name, i in nearest.items()])
    full = age.index(next(one for one in age if one > FULL_S))
    judge("cost over age", age[full:], cost[full:], CONSTANT_MAX)
    judge("memory over age", age[full:], memory[full:], CONSTANT_MAX)
    return {
        "cost": Panel("Age of a live run", age, cost, "age", "processor time, ms per s", 0, AGE_TICKS_S),
        "memory": Panel("Age of a live run", age, memory, "age", "resident memory, MB", 0, AGE_TICKS_S),
    }


PARTS: dict[str, Callable[[Path], Panels]] = {"axes": of_axes, "lines": of_lines, "samples": of_samples, "age": of_age}
"""In the order of the picture."""


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.growth", description=__doc__)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []])
    parts = parser.parse_args().parts or PARTS
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors")
    stored = IMAGES / "growth.json"
    found = json.loads(stored.read_text(encoding="utf-8"))
    for part in parts:
        with TemporaryDirectory() as folder:
            found[part] = {kind: vars(panel) for kind, panel in PARTS[part](Path(folder)).items()}
        stored.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    cost, memory = (
        [Panel(**found[part][kind]) for part in PARTS if kind in found[part]] for kind in ("cost", "memory")
    )
    draw(IMAGES / "growth-cost.svg", "Growth of the cost", "processor time, logarithmic axes", cost)
    draw(IMAGES / "growth-memory.svg", "Growth of memory", "of a process, logarithmic axes", memory)
    print(f"\npictures in {IMAGES}")


if __name__ == "__main__":
    main()
