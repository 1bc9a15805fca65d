"""The list of a thousand runs and the trends of two hundred, in a browser.

    python -m bench.runs [--runs 1000] [--trends 200]

Copies the run of a demo, each on another day, serves the directory, and measures the time from the navigation until a
headless Chromium has drawn the list, and the trends for the first time and again. It also prints the load of the
computer.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from pathlib import Path
from typing import Any

from bench.browser import chromium
from livebode.dashboard import Dashboard, ServerSettings
from livebode.dashboard.run_catalogue import RunCatalogue
from livebode.runtime import Destination, demo, demo_baseline
from tools.run_copies import copy_run

LIST_S_MAX, TRENDS_S_MAX = 1.0, 2.0
_BEGUN, _DAY_S = 1.7e9, 86400.0
_LISTED = "() => document.querySelectorAll('#rows [data-run]').length >= Math.min({}, 100)"
_DRAWN = "() => document.getElementById('cards').dataset.runs === '{}'"


def written(folder: Path, run: Path, runs: int) -> Path:
    """A directory with copies of a run."""
    for i in range(runs):
        factors = {"Keff": 1 - 0.0001 * i}
        copy_run(run, folder / f"run-{i:04d}", begun=_BEGUN + i * _DAY_S, factors=factors)
    return folder


def waited(page: Any, url: str, ready: str) -> float:
    """Seconds from the navigation until the page is ready."""
    began = time.perf_counter()
    page.goto(url)
    page.wait_for_function(ready)
    return time.perf_counter() - began


def measured(directory: Path, runs: int, path: str, ready: str) -> tuple[float, float]:
    """Seconds until the page is ready in a new server, and again in the same one."""
    with chromium() as browser:
        page = browser.new_page(viewport={"width": 1440, "height": 900})
        page.goto("about:blank")
        dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
        dashboard.view_all(directory)
        with dashboard:
            times = [waited(page, dashboard.url + path, ready.format(runs)) for _ in range(2)]
    return times[0], times[1]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--trends", type=int, default=200)
    asked = parser.parse_args()
    met = {True: "met", False: "missed"}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        destination = Destination(folder / "demo", lambda *_: None)
        run = demo(destination, seconds=16.0, seed=1, real_time=False, baseline=demo_baseline(1)).directory
        listed, trended = (written(folder / str(n), run, n) for n in (asked.runs, asked.trends))
        print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f} before")
        began = time.perf_counter()
        RunCatalogue(listed).rows(0)
        print(f"rows of {asked.runs} runs read               {time.perf_counter() - began:6.2f} s")
        first_s, again_s = measured(listed, asked.runs, "", _LISTED)
        print(
            f"list of {asked.runs} runs drawn, first       {first_s:6.2f} s, target ≤ 1 s: {met[first_s <= LIST_S_MAX]}"
        )
        print(f"list again                         {again_s:6.2f} s")
        first_s, again_s = measured(trended, asked.trends, "trends", _DRAWN)
        print(f"trends of {asked.trends} runs drawn, first      {first_s:6.2f} s")
        print(f"trends again                       {again_s:6.2f} s, target ≤ 2 s: {met[again_s <= TRENDS_S_MAX]}")
        print(f"load {os.getloadavg()[0]:.1f} afterwards")


if __name__ == "__main__":
    main()
