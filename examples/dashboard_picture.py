"""Draws docs/images/dashboard-light.png and dashboard-dark.png: the demo's page in Chromium, which must be installed.

python -m examples.dashboard_picture
"""

from __future__ import annotations

import io
import os
import shutil
import tempfile
import threading
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

from livebode.dashboard import Dashboard, Serving
from livebode.runtime import Destination
from livebode.runtime.demo import demo, demo_baseline

IMAGES = Path(__file__).parents[1] / "docs" / "images"
SECONDS, MOMENT_S = 40.0, 25.7
COLOURS = 128


def main() -> None:
    dashboard = Dashboard(Serving("127.0.0.1", 0))
    hub = dashboard.hub("demo")
    with tempfile.TemporaryDirectory() as folder, dashboard, sync_playwright() as playwright:
        running = threading.Thread(
            target=demo,
            args=(Destination(Path(folder) / "demo", lambda *_: None, subscribers=(hub,)),),
            kwargs={"seconds": SECONDS, "seed": 1, "real_time": False, "baseline": demo_baseline(2)},
        )
        running.start()
        running.join()
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox"] * (os.geteuid() == 0)
        )
        for scheme in ("light", "dark"):
            page = browser.new_page(viewport={"width": 1440, "height": 900}, color_scheme=scheme)  # type: ignore[arg-type]
            page.goto(dashboard.url)
            page.wait_for_function("() => window.livebode?.bode.curves.measured")
            page.evaluate(f"() => livebode.timeline.go({MOMENT_S - 15.7})")
            page.wait_for_timeout(800)
            page.keyboard.press("f")
            page.wait_for_timeout(800)
            page.evaluate(f"() => livebode.timeline.go({MOMENT_S})")
            page.wait_for_timeout(500)
            for _ in range(2):
                page.keyboard.press("ArrowRight")
            if scheme == "dark":
                page.locator("#tab-parameters").click()
            page.mouse.move(5, 300)
            page.wait_for_timeout(1500)
            with Image.open(io.BytesIO(page.screenshot())) as picture:
                small = picture.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
                small.save(IMAGES / f"dashboard-{scheme}.png", optimize=True)
        browser.close()


if __name__ == "__main__":
    main()
