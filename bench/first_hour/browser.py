"""The tasks of the first hour in a browser: a person who reads each page and clicks the one next button.

A page is driven in headless Chromium. Its words are read at 238 a minute (Brysbaert 2019). The seconds are those of
this computer and of the person together; what is read is also listed apart.
"""

from __future__ import annotations

import re
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

from bench.first_hour.senders import foreign_json, free_port, garbage
from bench.first_hour.servo import SERVO
from bench.first_hour.terminal import LIVEBODE
from livebode.dashboard import Dashboard, ServerSettings

WORDS_PER_MINUTE = 238.0
CLICK_S = 1.5
"""To find a button and to click it."""
DIALOG_S = 6.0
"""To choose a file in the dialog of the system, or to write an address."""


class Person:
    """Reads, clicks and waits; `directory` holds the runs, `recordings` the files that are there."""

    def __init__(self, browser: Any, recordings: Path, directory: Path) -> None:
        self.recordings, self.directory, self.clicks, self.reading_s = recordings, directory, 0, 0.0
        self._other_s, self._begun_s = 0.0, time.monotonic()
        self._dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
        self._dashboard.view_all(directory / "runs")
        self._context = browser.new_context(viewport={"width": 1440, "height": 900})
        self.page = self._context.new_page()

    def __enter__(self) -> Self:
        self._dashboard.__enter__()
        return self

    def __exit__(self, *problem: Any) -> None:
        self._computer_s = time.monotonic() - self._begun_s
        self._context.close()
        self._dashboard.__exit__(*problem)

    @property
    def total_s(self) -> float:
        return self._computer_s + self.reading_s + self._other_s

    def open(self) -> None:
        """The start page, which is read once, or the list of runs."""
        self.page.goto(self._dashboard.url)
        if not self.clicks:
            self.page.wait_for_selector("input[type=file]", state="attached")
            self.words("body")

    def click(self, selector: str, read: str = "", extra_s: float = 0.0) -> None:
        """Read a part of the page, if it is new, and click."""
        self.page.wait_for_selector(selector)
        if read:
            self.reading_s += 60 * len(self.page.inner_text(read).split()) / WORDS_PER_MINUTE
        self.page.click(selector)
        self._counted(extra_s)

    def choose_file(self, path: Path) -> None:
        self.page.set_input_files("input[type=file]", path)
        self._counted(DIALOG_S, clicks=2)

    def enter(self, selector: str, text: str) -> None:
        """Write into a field, and press Enter."""
        self.page.wait_for_selector(selector)
        self.page.fill(selector, text)
        self.page.press(selector, "Enter")
        self._counted(DIALOG_S)

    def words(self, selector: str) -> str:
        """What a part of the page says, which is read."""
        text = " ".join(self.page.inner_text(selector).split())
        self.reading_s += 60 * len(text.split()) / WORDS_PER_MINUTE
        return text

    def _counted(self, extra_s: float, clicks: int = 1) -> None:
        self.clicks += clicks
        self._other_s += clicks * CLICK_S + extra_s


def measured(person: Person, recording: str, setup: Callable[[Person], object] | None = None) -> str:
    """From a file to the page of its run; the headline there."""
    person.open()
    person.choose_file(person.recordings / recording)
    person.page.wait_for_url("**/measure**")
    person.page.wait_for_selector("#measure:enabled")
    if setup is not None:
        setup(person)
    for part in (".found", "#ready"):
        person.words(part)
    person.click("#measure", read="#slots")
    person.page.wait_for_url("**/run/**")
    person.page.wait_for_function("() => window.livebode?.bode.curves.measured")
    person.page.wait_for_function(
        "() => document.getElementById('result').textContent || document.getElementById('verdict').textContent"
    )
    return person.words("#headline")


def resonance(person: Person, recording: str) -> str:
    """The headline of the run, whose number is the true one."""
    text = measured(person, recording)
    value, bound = map(float, re.findall(r"Resonance ([\d.]+) ± ([\d.]+) Hz", text)[0])
    assert abs(value - SERVO.resonance_hz) < 2 * bound, text
    return text


def task(person: Person, name: str, *runs: str) -> str:
    """A task with these runs, from their list; its sentence."""
    person.open()
    for run in runs:
        person.click(f'[data-key="choose-{run}"]')
    person.click(f'.tasks a[href*="task={name}&"], .tasks a[href$="task={name}"]')
    person.page.wait_for_selector("#ask:not([hidden])")
    person.click("#start", read="#ask")
    person.page.wait_for_selector('#answer[aria-busy="false"]')
    return person.words("#sentence")


def worse_at_standstill(person: Person) -> str:
    measured(person, "si.csv")
    measured(person, "softer.csv")
    text = task(person, "compare", "si", "softer")
    assert "stiffness −8.0" in text, text
    return text


def worse_in_motion(person: Person) -> str:
    """Learn two healthy days, and measure today with the baseline."""
    subprocess.run([LIVEBODE, "example", "fault", "--out", person.directory / "fault"], check=True, capture_output=True)
    person.recordings = person.directory / "fault"
    measured(person, "monday.parquet")
    measured(person, "tuesday.parquet")
    task(person, "learn", "monday", "tuesday")

    def compare(person: Person) -> None:
        person.click(".found summary")
        person.page.select_option("#baseline", index=1)

    text = measured(person, "today.parquet", compare)
    assert "belt 2.0 % softer" in text, text
    return text


def report(person: Person) -> str:
    measured(person, "si.csv")
    task(person, "report", "si")
    link = person.page.locator('a[href*=".pdf"]').first
    assert link.count(), person.page.inner_text("#answer")
    return link.inner_text()


def listened(person: Person, address: str) -> str:
    """What the page says of an address."""
    person.open()
    person.enter("#address", address)
    person.page.wait_for_selector(".heard-status:not(:empty)")
    person.page.wait_for_selector(".live button:enabled")
    return person.words(".live .heard-status")


def silent_axis(person: Person) -> str:
    text = listened(person, f"udp://127.0.0.1:{free_port()}")
    assert "no samples" in text or "nothing" in text, text
    return text


def garbage_on_the_port(person: Person) -> str:
    port = free_port()
    with garbage(port):
        text = listened(person, f"udp://127.0.0.1:{port}")
    assert "temp=21" in text, text
    return text


def foreign_messages(person: Person) -> str:
    """JSON with other names at a broker: listened to, mapped, measured, and finished."""
    with foreign_json(person.directory) as url:
        person.open()
        person.enter("#address", url)
        person.page.wait_for_url("**/measure**")
        person.page.wait_for_selector("#measure:enabled")
        person.click("#measure", read="#slots")
        person.page.wait_for_url("**/run/**")
        person.page.wait_for_function("() => window.livebode?.bode.curves.measured")
        time.sleep(8)
        person.click("#finish")
        person.page.wait_for_selector("#finish", state="hidden")
    return person.words("#headline")


TASKS: dict[str, Callable[[Person], str]] = {
    "own CSV": lambda person: measured(person, "si.csv"),
    "German CSV in cp1252": lambda person: measured(person, "german.csv"),
    "log in rpm": lambda person: measured(person, "rpm.csv"),
    "resonance": lambda person: resonance(person, "si.csv"),
    "belt worse, at standstill": worse_at_standstill,
    "belt worse, in motion": worse_in_motion,
    "silent axis": silent_axis,
    "garbage on the port": garbage_on_the_port,
    "PDF for a customer": report,
    "MQTT with foreign JSON": foreign_messages,
}
"""Tuning and a gantry have no way in the browser but the pages of their runs."""
