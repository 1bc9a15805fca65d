"""The sliders of "What if": frames per second while one is dragged, for short and long lists of lines.

    python -m bench.what_if [--seconds 5] [--lines 21 101 200] [--places 1 12]

A run of synthetic responses is shown with two notches and a low-pass. Each frame moves the slider of the gain as
a hand does: the curves, the marks and the table of margins, with the worst plant within the bounds, are computed and
drawn again. Chromium is headless, without a graphics card, and draws on the same cores.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from bench.browser import chromium
from bench.dashboard import RATE_HZ, WINDOW, responses
from livebode.analysis import Overview
from livebode.core import Lines
from livebode.dashboard import Dashboard, ServerSettings
from livebode.runtime import RunControl, RunStarted

FRAMES_MIN = 30.0
_ADDRESS = "#quantity=open+loop&sliders=1&what-if=notch~60~20~0.3~~notch~120~10~0.5~~low-pass~600"
_DRAG = """async (seconds) => {
  const bar = document.querySelector('#what-if-rows [type=range][data-part=gain]');
  const { whatIf, bode } = livebode, end = performance.now() + 1000 * seconds;
  let frames = 0, draws = 0, compute = 0;
  const draw = bode.draw.bind(bode), table = whatIf.draw.bind(whatIf);
  bode.draw = () => { draws++; draw(); };
  whatIf.draw = () => { const t = performance.now(); table(); compute += performance.now() - t; };
  while (performance.now() < end) {
    bar.value = 200 + 150 * Math.sin(frames / 20);
    bar.dispatchEvent(new Event('input', { bubbles: true }));
    await new Promise(requestAnimationFrame);
    frames++;
  }
  return [frames / seconds, draws / seconds, compute / frames];
}"""


def frames(count: int, places: int, seconds: float) -> list[float]:
    """Frames and drawings per second, and milliseconds of the margins in each frame."""
    lines = Lines(tuple(range(2, 2 + count)), WINDOW, RATE_HZ)
    made = responses(lines, 60 * places, 0)
    row = np.arange(len(made))
    made = replace(
        made, time_s=row / 10, schedule=np.linspace(0, 1, len(made)) if places > 1 else made.schedule + np.nan
    )
    found = {
        "bins": list(lines.bins), "quiet_bins": [], "window": WINDOW, "rate_hz": RATE_HZ, "quantity": "plant",
        "unit": "rad/s/(N m)", "schedule": "x in m",
    }  # fmt: skip
    loop = {
        "velocity": {"gain": 0.05, "integral_time_s": 0.2, "rate_hz": RATE_HZ},
        "position": {"gain": 1.0, "rate_hz": RATE_HZ / 2, "rate_divider": 2},
    }
    dashboard, overview = Dashboard(ServerSettings("127.0.0.1", 0)), Overview()
    hub = dashboard.hub("bench")
    with tempfile.TemporaryDirectory() as folder, dashboard, chromium() as browser:
        hub(RunStarted(Path(folder), {"found": found, "configuration": {"loop": loop}}, RunControl(), overview))
        overview.add(made)
        hub(made)
        page = browser.new_page(viewport={"width": 1440, "height": 900})
        page.goto(dashboard.url + _ADDRESS)
        page.wait_for_function("() => window.livebode?.whatIf.margins.after && livebode.bode.drawn['what if']")
        assert page.evaluate("() => livebode.whatIf.facts.band.places.length") == places
        page.evaluate(_DRAG, 1.0)
        return page.evaluate(_DRAG, seconds)  # type: ignore[no-any-return]


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.what_if", description=__doc__)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--lines", type=int, nargs="+", default=[21, 101, 200])
    parser.add_argument("--places", type=int, nargs="+", default=[1, 12])
    given = parser.parse_args()
    met = {True: "met", False: "missed"}
    print(
        f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f} before; one slider dragged, target ≥ {FRAMES_MIN:.0f}/s"
    )
    for places in given.places:
        for count in given.lines:
            rate, drawn, margins_ms = frames(count, places, given.seconds)
            print(
                f"{count:4d} lines, {places:2d} places: {rate:5.1f} frames/s, {drawn:5.1f} drawn/s, "
                f"margins {margins_ms:4.1f} ms: {met[min(rate, drawn) >= FRAMES_MIN]}"
            )


if __name__ == "__main__":
    main()
