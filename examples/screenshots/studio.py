"""A browser, and the runs that several pictures share; each is made when the first picture needs it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import ExitStack
from functools import cached_property
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, Page, sync_playwright

from examples.screenshots.machines import (
    Afterwards,
    Tracked,
    at_standstill,
    drifting,
    healthy,
    write_gantry,
    write_loop,
)
from livebode.core import Lines
from livebode.dashboard import Dashboard, ServerSettings
from livebode.interface import write_examples
from livebode.monitoring import Baseline
from livebode.runtime import ClockSet, Destination, demo, demo_baseline
from livebode.runtime._demo import RATE_HZ, demo_settings
from tools.fleet_year import write_year
from tools.run_copies import copy_run

SECONDS, MOMENT_S = 40.0, 25.7
DESK, PHONE, LANDSCAPE, HALL = (1440, 900), (390, 844), (844, 390), (1920, 1080)
BEGUN, DAY_S = 1_760_000_000.0, 86400.0
DRAWN = "() => window.livebode?.bode.curves.measured && livebode.tracking.made.data[0].length"
_PLAN = Path(__file__).with_name("hall.svg")
AXIS = "Brno/body/gantry 1/x"
_DRAW_MS = 1500  # the page draws its map every 600 ms


class Studio(ExitStack):
    """Runs, dashboards and pages until it is left."""

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self.folder = folder

    @cached_property
    def browser(self) -> Browser:
        path = shutil.which("chromium")
        if path is None:
            raise SystemExit("chromium is not installed: `make system-packages` installs it")
        playwright = self.enter_context(sync_playwright())
        # Its sandbox does not start for root.
        found = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"] * (os.geteuid() == 0))
        self.callback(found.close)
        return found

    @cached_property
    def baseline(self) -> Baseline:
        return demo_baseline(2)

    @cached_property
    def faulty(self) -> Path:
        """The finished run of the demo: its belt loses stiffness halfway."""
        to = Destination(self.folder / "demo", lambda *_: None)
        return demo(to, seconds=SECONDS, seed=1, real_time=False, baseline=self.baseline).directory

    @cached_property
    def standstill(self) -> Path:
        """A finished run at 101 lines."""
        return self.at_standstill("101 lines", Lines.parse("10:1010:10", rate_hz=RATE_HZ, window=1600), 0.1)

    @cached_property
    def tuned(self) -> Path:
        """A finished run of two masses in their loop: its description was checked, and `livebode tune` has proposed."""
        axis = write_loop(self.folder / "two masses")
        run = axis.parent / "axis"
        livebode = Path(sys.executable).with_name("livebode")
        for command in (["run", axis, "--out", run], ["validate", run, "--loop"], ["tune", run]):
            subprocess.run([livebode, *command], check=True, stdout=subprocess.DEVNULL)
        return run

    @cached_property
    def gantry(self) -> Path:
        """A finished run with a matrix of responses."""
        axis = write_gantry(self.folder / "two motors")
        run = axis.parent / "gantry"
        livebode = Path(sys.executable).with_name("livebode")
        subprocess.run([livebode, "run", axis, "--out", run], check=True, stdout=subprocess.DEVNULL)
        return run

    def at_standstill(self, name: str, lines: Lines, amplitude_n_m: float) -> Path:
        """A finished run at standstill."""
        held, settings = at_standstill(lines, amplitude_n_m)
        with Tracked(held, settings, self.folder / name):
            return self.folder / name

    @cached_property
    def drifting(self) -> Path:
        """A finished run of a belt that becomes softer while it is averaged."""
        held, settings = drifting()
        with Tracked(held, settings, self.folder / "drifting belt"):
            return self.folder / "drifting belt"

    @cached_property
    def start_url(self) -> str:
        """A directory with a recording and without runs."""
        directory = self.folder / "runs"
        write_examples(["standstill"], directory)
        dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
        dashboard.view_all(directory)
        return self.enter_context(dashboard).url

    @cached_property
    def faulty_url(self) -> str:
        return self.views([self.faulty])

    @cached_property
    def weeks_url(self) -> str:
        """Runs of many days; the belt becomes softer."""
        weeks, message = (
            self.folder / "weeks",
            "Since 23.1 s the belt's stiffness is {:.1f} ± 0.3 % less than in the baseline.",
        )
        for day in range(24):
            factor = 1.0 - 0.004 * max(0, day - 9)
            alarm = message.format(100 * (1 - factor)) if day > 14 else ""
            monitoring = {"baseline": "healthy.json", "judged_s": 39.0, "changes": int(bool(alarm))}
            monitoring |= {"message": alarm, "standing": [{"what": "stiffness"}] if alarm else []}
            # Frequencies follow the root of the stiffness.
            factors = {"Keff": factor, "resonance_frequency": factor**0.5, "antiresonance_frequency": factor**0.5}
            copy_run(
                self.faulty, weeks / f"axis-x-day-{day + 1:02d}", begun=BEGUN + day * DAY_S, factors=factors,
                alarm=alarm, changes={"monitoring": monitoring},
            )  # fmt: skip
        dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
        dashboard.view_all(weeks)
        return self.enter_context(dashboard).url

    @cached_property
    def live_url(self) -> str:
        return self.enter_context(self.live({"axis-x": "live"})).url

    def views(self, runs: Sequence[Path]) -> str:
        """A dashboard of finished runs."""
        dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
        for run in runs:
            dashboard.view(run)
        return self.enter_context(dashboard).url

    def live(self, axes: dict[str, Afterwards]) -> Dashboard:
        """A dashboard of machines that were healthy for 20 s; it still has to be entered."""
        dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
        for name, afterwards in axes.items():
            hub, held = dashboard.hub(name), healthy(afterwards)
            directory = self.folder / f"{name}-{time.monotonic_ns()}"
            self.enter_context(Tracked(held, demo_settings(), directory, hub, self.baseline))
            hub(ClockSet([(0.0, time.time() - held.fast_s)]))
        return dashboard

    @cached_property
    def fleet_url(self) -> str:
        """A simulated fleet with a floor plan, and a year of AXIS; one of its partitions has no worker."""
        from livebode_plant.page.fleet_feed import DemoFeed, DemoFleet
        from livebode_plant.page.fleet_pages import FleetView
        from livebode_plant.page.floor_plan import floor_plan

        fleet, lake = DemoFleet(10_000), self.folder / "lake"
        feed = DemoFeed(fleet, silent=[3], began_s=time.time() - 150)
        status = fleet.status(150.0, time.time())
        write_year(lake, AXIS, float(status["value"][fleet.paths.index(AXIS)]))
        dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
        dashboard.show(FleetView(feed, floor_plan(_PLAN), lake=str(lake)))
        return self.enter_context(dashboard).url

    def page(
        self, url: str, address: str = "", size: tuple[int, int] = DESK, until: str = DRAWN, **options: Any
    ) -> Page:
        """A page at an address; `options` are those of a browser's context."""
        width, height = size
        context = self.browser.new_context(viewport={"width": width, "height": height}, **options)
        self.callback(context.close)
        page = context.new_page()
        page.goto(url + address)
        page.wait_for_function(until)
        page.wait_for_timeout(_DRAW_MS)
        return page

    def first_page(self, pdf: Path) -> bytes:
        """The first page of a PDF as a picture."""
        program = shutil.which("pdftoppm")
        if program is None:
            raise SystemExit("pdftoppm is not installed: `apt-get install poppler-utils` installs it")
        stem = pdf.with_suffix("")
        subprocess.run([program, "-png", "-r", "110", "-f", "1", "-l", "1", "-singlefile", pdf, stem], check=True)
        return stem.with_suffix(".png").read_bytes()


def picture(page: Page, **options: Any) -> bytes:
    """What is seen of a page, when it has drawn; its context ends."""
    page.wait_for_timeout(_DRAW_MS)
    found = page.screenshot(**options)
    page.context.close()
    return found
