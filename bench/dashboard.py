"""The dashboard under load: 101 lines, 30 updates per second, one browser.

    python -m bench.dashboard [--seconds 20] [--lines 101] [--browsers 1]

Publishes synthetic responses from a thread as a tracker does, and measures the cost of publishing in that thread, the
processor time of the server's thread, and the frames per second of a headless Chromium without a graphics card, which
draws on the same cores. It also prints the load of the computer.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

from bench.browser import chromium
from livebode.analysis import Overview
from livebode.core import Block, Lines, Parameters, Responses
from livebode.dashboard import Dashboard, Hub, ServerSettings
from livebode.runtime import FitResults, RunControl, RunStarted, TrackerResults

RATE_HZ, WINDOW, UPDATES_PER_S = 4000.0, 2000, 30.0
FRAMES_MIN, CPU_MAX = 50.0, 0.10
NAMES, UNITS = ("Js", "mL", "Keff", "bs"), ("kg m²", "kg", "N/m", "N s/m")
_COUNT = "window.frames_ = 0; const tick = () => { window.frames_++; requestAnimationFrame(tick); }; tick();"


def responses(lines: Lines, rows: int, seed: int) -> Responses:
    """Responses of two masses with noise, row by row."""
    rng, f = np.random.default_rng(seed), lines.frequency_hz
    s = 2j * np.pi * f
    plant = (s**2 + 20 * s + 2e5) / (s * (s**2 + 25 * s + 4e5)) * 400
    shape = rows, len(f)
    noise = 0.03 * np.abs(plant) * (rng.standard_normal(shape) + 1j * rng.standard_normal(shape))
    sample = WINDOW + np.arange(rows)
    return Responses(
        lines=lines,
        value=plant + noise,
        sigma=np.broadcast_to(0.04 * np.abs(plant), shape).copy(),
        dof=np.full(rows, 8.0),
        coherence=rng.uniform(0.9, 1.0, shape),
        valid=np.ones(shape, dtype=bool),
        first=sample - WINDOW,
        sample=sample,
        time_s=np.zeros(rows),
        schedule=np.zeros(rows),
        unit="rad/s/(N m)",
    )


def publish(hub: Hub, made: Responses, stop: threading.Event, costs: list[float]) -> None:
    """Publish at `UPDATES_PER_S`; `costs` receives the seconds that each update cost this thread."""
    n, began = 0, time.perf_counter()
    while not stop.is_set():
        at, now_s = n % len(made), n / UPDATES_PER_S
        row = made[at : at + 1]
        one = Responses(**{**vars(row), "time_s": np.array([now_s]), "schedule": np.array([0.9 + 0.6 * np.sin(now_s)])})
        value = np.ones((1, 4)) + 0.01 * np.sin(now_s)
        fit = Parameters(
            "two-mass", NAMES, UNITS, value, 1e-4 * np.eye(4)[None], np.array(["ok"]), np.zeros(1), np.ones(1),
            np.ones(1), one.sample, one.time_s, one.schedule,
        )  # fmt: skip
        block = Block(np.zeros((1, 10)), ("y",), RATE_HZ, start=n * 10)
        before = time.perf_counter()
        assert hub.overview is not None
        hub.overview.add(one)
        hub(one)
        hub(FitResults((fit,)))
        hub(TrackerResults(block, 0, None))
        costs.append(time.perf_counter() - before)
        n += 1
        stop.wait(max(0.0, began + n / UPDATES_PER_S - time.perf_counter()))


def measured(seconds: float, lines: Lines, browsers: int) -> dict[str, float]:
    """Results of one run."""
    dashboard, stop, costs = Dashboard(ServerSettings("127.0.0.1", 0)), threading.Event(), list[float]()
    hub = dashboard.hub("bench")
    found = {
        "bins": list(lines.bins), "quiet_bins": [], "window": WINDOW, "rate_hz": RATE_HZ, "quantity": "plant",
        "unit": "rad/s/(N m)", "schedule": "x in m",
    }  # fmt: skip
    loop = {"velocity": {"gain": 0.2, "integral_time_s": 0.2, "rate_hz": RATE_HZ}}
    with tempfile.TemporaryDirectory() as folder, dashboard, chromium() as browser:
        hub(RunStarted(Path(folder), {"found": found, "configuration": {"loop": loop}}, RunControl(), Overview()))
        worker = threading.Thread(target=publish, args=(hub, responses(lines, 64, 0), stop, costs))
        worker.start()
        pages = [browser.new_page(viewport={"width": 1440, "height": 900}) for _ in range(browsers)]
        for page in pages:
            page.goto(dashboard.url)
            page.wait_for_function("() => window.livebode?.bode.curves.measured")
            page.evaluate(f"() => {{ {_COUNT} window.draws_ = 0; const b = livebode.bode, d = b.draw.bind(b);"
                          " b.draw = () => { window.draws_++; d(); }; }")  # fmt: skip
        time.sleep(2)
        before = [page.evaluate("() => [performance.now(), window.frames_, window.draws_]") for page in pages]
        cpu, began, first = dashboard.cpu_s, time.perf_counter(), len(costs)
        time.sleep(seconds)
        took, cpu, last = time.perf_counter() - began, dashboard.cpu_s - cpu, len(costs)
        after = [page.evaluate("() => [performance.now(), window.frames_, window.draws_]") for page in pages]
        stop.set()
        worker.join()
    rates = [[(b[i] - a[i]) / (b[0] - a[0]) * 1e3 for a, b in zip(before, after)] for i in (1, 2)]
    cost = np.array(costs[first:last]) * 1e6
    return {
        "frames": min(rates[0]), "draws": min(rates[1]), "cpu": cpu / took, "updates": (last - first) / took,
        "median_us": float(np.median(cost)), "p99_us": float(np.quantile(cost, 0.99)), "most_us": float(cost.max()),
    }  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--lines", type=int, default=101)
    parser.add_argument("--browsers", type=int, default=1)
    asked = parser.parse_args()
    lines = Lines(tuple(range(5, 5 + asked.lines)), WINDOW, RATE_HZ)
    load, met = os.getloadavg()[0], {True: "met", False: "missed"}
    print(f"{os.cpu_count()} cores, load {load:.1f} before; {asked.lines} lines, browsers: {asked.browsers}")
    got = measured(asked.seconds, lines, asked.browsers)
    frames, cpu = got["frames"], got["cpu"]
    print(f"published              {got['updates']:7.1f} updates/s")
    print(f"frames of the browser  {frames:7.1f} /s, target ≥ {FRAMES_MIN:.0f}: {met[frames >= FRAMES_MIN]}")
    print(f"Bode plots drawn       {got['draws']:7.1f} /s")
    print(f"server's thread        {100 * cpu:7.1f} % of a core, target ≤ {100 * CPU_MAX:.0f} %: {met[cpu <= CPU_MAX]}")
    cost, p99, most = (got[name] for name in ("median_us", "p99_us", "most_us"))
    print(f"cost to the tracker    {cost:7.1f} µs per update, p99 {p99:.0f} µs, at most {most:.0f} µs")
    print(f"load {os.getloadavg()[0]:.1f} afterwards")


if __name__ == "__main__":
    main()
