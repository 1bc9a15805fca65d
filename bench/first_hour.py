"""The way of a person who has never seen livebode: from a CSV to a Bode plot with bounds, in seconds and clicks.

    python -m bench.first_hour [LOG]

A page is driven in headless Chromium: the file is chosen, each step is read for as long as a person reads it (words at
238 a minute, Brysbaert 2019), and the one next button is clicked. Without LOG, a servo of two masses that no part of
livebode simulates is recorded. The times are those of this computer; what a person reads is apart.
"""

from __future__ import annotations

import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

from bench.browser import chromium
from livebode.dashboard import Dashboard, ServerSettings
from livebode.records import RunRecord
from tools.two_mass_servo import write_servo

WORDS_PER_MINUTE = 238.0
CLICK_S = 1.5
"""To find a button and to click it."""
DIALOG_S = 6.0
"""To choose a file in the dialog of the system."""
TARGET_S = 90.0


@dataclass
class Way:
    """What a person has done: steps with the seconds of the computer and of the person."""

    steps: list[tuple[str, float, float]] = field(default_factory=list)
    clicks: int = 0
    _since_s: float = field(default_factory=time.monotonic)

    def step(self, name: str, words: str, *, clicks: int = 1, extra_s: float = 0.0) -> None:
        """A page is ready: its words are read, and so much is clicked."""
        now_s = time.monotonic()
        person_s = 60 * len(words.split()) / WORDS_PER_MINUTE + clicks * CLICK_S + extra_s
        self.steps.append((name, now_s - self._since_s, person_s))
        self.clicks += clicks
        self._since_s = now_s

    @property
    def total_s(self) -> float:
        return sum(computer_s + person_s for _, computer_s, person_s in self.steps)


def walk(log: Path, directory: Path) -> Way:
    """From the start page of an empty directory to the page of the run."""
    way = Way()
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view_all(directory)
    with dashboard, chromium() as browser:
        page = browser.new_page(viewport={"width": 1440, "height": 900})
        page.goto(dashboard.url)
        page.wait_for_selector(".no-runs .drop")
        way.step("start page", page.inner_text("body"), clicks=2, extra_s=DIALOG_S)
        page.set_input_files("#file", log)
        page.wait_for_url("**/measure**")
        page.wait_for_selector("#measure:enabled")
        way.step("channels, roles, lines", " ".join(page.inner_text(f) for f in ("#slots", ".found", "#ready")))
        page.click("#measure")
        page.wait_for_url("**/run/**")
        page.wait_for_function("() => window.livebode?.bode.curves.measured")
        way.step("Bode plot", "", clicks=0)
    return way


def main() -> None:
    """Print the steps."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(sys.argv[1]) if len(sys.argv) > 1 else write_servo(Path(folder) / "servo.csv")
        directory = Path(folder) / "runs"
        way = walk(log, directory)
        run = next(path for path in directory.iterdir() if path.is_dir())
        response = RunRecord.open(run).responses()[-1:]
    print(f"{'step':<24}{'computer s':>12}{'person s':>12}")
    for name, computer_s, person_s in way.steps:
        print(f"{name:<24}{computer_s:>12.1f}{person_s:>12.1f}")
    print(f"{len(response.frequency_hz)} lines with bounds after {way.total_s:.0f} s and {way.clicks} clicks")
    print(f"target {TARGET_S:.0f} s: {'met' if way.total_s <= TARGET_S else 'missed'}")


if __name__ == "__main__":
    main()
