"""The plot library of the dashboard against its successors: 16 axes of 101 lines, 30 times a second.

    python -m bench.plotters [--axes 16] [--per-second 30] [--seconds 5] [--rounds 3] [--pictures DIRECTORY]

Each library draws the same magnitude plots with their bands in a headless Chromium, one library after the other, in
several rounds. Printed are medians: updates of all axes per second, time of the page's script for one update, and the
processor time of the whole browser for one update, absolute and as a ratio to uPlot in the same round. There is no
graphics card, as in many panels: WebGL is drawn by the processor too. The libraries are installed by `npm ci` in
`bench/plotters` when they are missing. Linux only: the processor time is from `/proc`.
"""

from __future__ import annotations

import argparse
import functools
import os
import shutil
import statistics
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from playwright.sync_api import Error

from bench.browser import chromium

HERE = Path(__file__).parent
NAMES = "uplot", "canvas", "webglplot", "chartgpu", "chartjs", "echarts"
SIZE = {"width": 1920, "height": 1080}
_TICK_S = 1 / os.sysconf("SC_CLK_TCK")


class Files(SimpleHTTPRequestHandler):
    """The page and the libraries, without a log."""

    def translate_path(self, path: str) -> str:
        inside = path if path.startswith("/node_modules/") else f"/page{path}"
        return super().translate_path(inside)

    def log_message(self, *_: object) -> None:
        pass


@contextmanager
def served() -> Iterator[str]:
    """The address of a server on loopback."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Files, directory=str(HERE)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/index.html"
    server.shutdown()
    server.server_close()


def browser_s() -> float:
    """Processor time of all descendants of this process, the browser's, in seconds."""
    parents, spent = {}, {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue  # it has ended
        pid = int(stat.parent.name)
        parents[pid], spent[pid] = int(fields[1]), (int(fields[11]) + int(fields[12])) * _TICK_S
    inside, more = {os.getpid()}, {os.getpid()}
    while more:
        more = {pid for pid, parent in parents.items() if parent in more}
        inside |= more
    return sum(spent.get(pid, 0.0) for pid in inside - {os.getpid()})


def measured(name: str, address: str, asked: argparse.Namespace) -> dict[str, Any]:
    """One library in a browser of its own."""
    with chromium("--enable-unsafe-webgpu") as browser:
        page = browser.new_page(viewport=SIZE)
        page.goto(address)
        work = (
            "async ([name, axes, perSecond, seconds]) => { const { run } = await import('/work.js'),"
            " { make } = await import(`/${name}.js`); return run(make, axes, perSecond, seconds); }"
        )
        try:
            page.evaluate(work, [name, asked.axes, asked.per_second, 1])
        except Error as error:  # a library that this browser cannot serve
            return {"refused": error.message.splitlines()[0]}
        before = browser_s()
        found: dict[str, Any] = page.evaluate(work, [name, asked.axes, asked.per_second, asked.seconds])
        cpu = browser_s() - before
        if asked.pictures:
            asked.pictures.mkdir(parents=True, exist_ok=True)
            page.screenshot(path=asked.pictures / f"{name}.png")
    return found | {"cpu": 1e3 * cpu / (found["updates"] * asked.seconds)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--axes", type=int, default=16)
    parser.add_argument("--per-second", type=float, default=30.0)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--pictures", type=Path)
    asked = parser.parse_args()
    if not (HERE / "node_modules").is_dir():
        npm = shutil.which("npm", path=os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]))
        subprocess.run([npm or "npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund"], cwd=HERE, check=True)
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f} before; {asked.axes} axes, {asked.per_second:g}/s")
    with served() as address:
        rounds = [{name: measured(name, address, asked) for name in NAMES} for _ in range(asked.rounds)]

    def median(name: str, what: str, ratio: bool = False) -> float:
        return statistics.median(each[name][what] / (each["uplot"][what] if ratio else 1) for each in rounds)

    print(f"{'':10} updates/s   script, ms   processor, ms   processor, uPlot = 1")
    for name in NAMES:
        if refused := rounds[0][name].get("refused"):
            print(f"{name:10} draws nothing in this browser: {refused}")
            continue
        row = [median(name, what) for what in ("updates", "script", "cpu")]
        print(f"{name:10} {row[0]:9.1f} {row[1]:12.1f} {row[2]:15.1f} {median(name, 'cpu', True):22.2f}")
    print(f"load {os.getloadavg()[0]:.1f} afterwards")


if __name__ == "__main__":
    main()
