"""The tasks in a browser, as a person clicks, and the same command in the terminal: the files are equal."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page

from livebode.dashboard import Dashboard, ServerSettings
from livebode.records import RunRecord
from tests.support.browser import Tab, chromium
from tests.support.command import livebode, signals, write_csv

DESK, PHONE = {"width": 1440, "height": 900}, {"width": 390, "height": 844}
_MOMENT = re.compile(rb"\d{4}-\d\d-\d\d[ T]\d\d:\d\d(:\d\d)?")


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as started:
        yield started


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two runs of a machine."""
    directory = tmp_path_factory.mktemp("machines")
    for seed, name in enumerate(("monday", "tuesday")):
        log = write_csv(tmp_path_factory.mktemp("logs") / f"{name}.csv", signals(4000, seed=seed))
        roles = "--excitation", "w", "--input", "u", "--output", "y", "--time", "t [s]"
        done = livebode("run", log, *roles, "--lines", "50,100,200", "--window", "100", "--out", directory / name)
        assert done.code == 0, done.err
    return directory


@pytest.fixture(scope="module")
def tab(browser: Browser, folder: Path) -> Iterator[Tab]:
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view_all(folder)
    with dashboard, Tab(browser, dashboard.url, wait=False) as opened:
        yield opened
        assert opened.wrong == []


def task(tab: Tab, name: str, *runs: str) -> Page:
    """The form of a task, from the list, with these runs chosen."""
    page = tab.page
    page.goto(tab.url)
    for run in runs:
        page.check(f'[data-key="choose-{run}"]')
    page.click(f'.tasks a[href*="task={name}&"], .tasks a[href$="task={name}"]')
    page.wait_for_selector("#ask:not([hidden])")
    return page


def run_task(page: Page) -> None:
    """Start it, and wait for its end."""
    page.click("#start")
    page.wait_for_selector('#answer[aria-busy="false"]')


def without_moments(path: Path) -> bytes:
    """A file without the moments at which it was written."""
    return _MOMENT.sub(b"", path.read_bytes())


def test_a_baseline_is_that_of_the_terminal(tab: Tab, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = task(tab, "learn", "monday", "tuesday")
    page.fill("#field---out", "press 3")
    run_task(page)
    assert page.inner_text("#sentence").startswith("Learned from")
    monkeypatch.chdir(folder)
    here = livebode("learn", "monday", "tuesday", "--out", folder.parent / "terminal.json")
    assert here.code == 0, here.err
    assert page.inner_text("#output").splitlines()[0] == here.out.splitlines()[0]
    files = folder / "baselines/press 3.json", folder.parent / "terminal.json"
    own, expected = (json.loads(path.read_text()) for path in files)
    assert own.keys() == expected.keys()
    assert {key for key in own if own[key] != expected[key]} <= {"learned", "crc32"}

    with page.expect_download() as downloading:
        page.click('a[download="press 3.json"]')
    assert Path(downloading.value.path()).read_bytes() == (folder / "baselines/press 3.json").read_bytes()


def test_a_run_of_which_no_baseline_is_learned_is_not_offered_for_one(tab: Tab, folder: Path, tmp_path: Path) -> None:
    log = write_csv(tmp_path / "averaged.csv", signals(4000))
    roles = "--excitation", "w", "--input", "u", "--output", "y", "--time", "t [s]", "--average"
    done = livebode("run", log, *roles, "--lines", "50,100,200", "--window", "100", "--out", folder / "averaged")
    assert done.code == 0, done.err
    refused = livebode("learn", folder / "averaged", "--out", tmp_path / "no.json")
    assert refused.code != 0
    page = task(tab, "learn", "averaged", "monday")
    assert page.is_disabled('input[value="averaged"]')
    assert not page.is_checked('input[value="averaged"]')
    assert page.is_checked('input[value="monday"]')
    assert "without the average" in page.inner_text("#runs")
    label = page.locator("label", has_text="averaged")
    assert label.inner_text().strip() == "averaged (averaged)"
    assert label.bounding_box()["height"] < 40, "the name is on one line"


def test_the_sentence_of_the_command_is_at_the_field_that_mends_it(tab: Tab, folder: Path) -> None:
    for reason in ("", "new bearings"):
        page = task(tab, "learn", "monday")
        page.fill("#field---out", "again")
        page.fill("#field---reason", reason)
        run_task(page)
        page.goto("about:blank")
    page = task(tab, "learn", "tuesday")
    page.fill("#field---out", "again")
    run_task(page)
    said = livebode("learn", folder / "tuesday", "--out", folder / "baselines" / "again.json").err
    assert page.inner_text("#wrong---reason") == said.removeprefix("livebode: ").strip().replace(f"{folder}/", "")


def test_a_report_with_fields_and_limits_is_that_of_the_terminal(tab: Tab, folder: Path) -> None:
    page = task(tab, "report", "monday")
    page.fill("#field---customer", 'Müller & Söhne "GmbH" --json')
    page.fill("#field---conditions", "22 °C; rm -rf $HOME `id`")
    page.click("#add-limit")
    page.fill('[aria-label="Quantity 1"]', "|G|")
    page.fill('[aria-label="Largest 1"]', "20")
    page.fill('[aria-label="Band 1"]', "50:200")
    run_task(page)
    assert page.inner_text("#sentence") == "limits: 1 met"
    template = folder.parent / "limits.toml"
    template.write_text('[[report.limits]]\nquantity = "|G|"\nmax = 20\nband_hz = [50, 200]\n')
    words = 'Müller & Söhne "GmbH" --json', "22 °C; rm -rf $HOME `id`"
    done = livebode(
        "report", folder / "monday", f"--customer={words[0]}", f"--conditions={words[1]}", "--template", template,
        "--language", "en", "--out", folder.parent / "terminal",
    )  # fmt: skip
    assert done.code == 0, done.err
    own = without_moments(folder / "monday" / "report.html")
    assert b"M\xc3\xbcller &amp; S\xc3\xb6hne" in own
    assert own.replace(b"reports/monday.toml", b"") == without_moments(folder.parent / "terminal.html").replace(
        str(template).encode(), b""
    )
    with page.context.expect_page() as opening:
        page.click('a[href$="/report.html"]')
    report = opening.value
    report.wait_for_load_state()
    assert "Müller & Söhne" in report.inner_text("body")
    assert report.evaluate("self.origin") == "null", "the report is not in a sandbox"
    report.close()


def test_a_comparison_is_that_of_the_terminal(tab: Tab, folder: Path) -> None:
    page = task(tab, "compare", "tuesday", "monday")
    run_task(page)
    done = livebode(
        "compare", folder / "monday", folder / "tuesday", "--language", "en", "--out", folder.parent / "both"
    )
    assert done.code == 0, done.err
    assert without_moments(folder / "comparisons/comparison.html") == without_moments(folder.parent / "both.html")


def test_a_design_is_that_of_the_terminal_with_its_reasons_and_downloads(tab: Tab, folder: Path) -> None:
    page = task(tab, "design")
    page.fill("#field---band", "20:140")
    page.fill("#field---resolution", "10")
    page.fill('[name="limits.torque_n_m_max"]', "14.5")
    page.click('details[data-group="belt."] summary')
    page.fill('[name="belt.sensor.noise_rad_per_s"]', "0.1")
    run_task(page)
    assert page.is_visible(".result img")
    experiment = folder.parent / "experiment.toml"
    experiment.write_text(
        "[belt.sensor]\nnoise_rad_per_s = 0.1\n[limits]\ntorque_n_m_max = 14.5\n"
        "[excitation]\nband_hz = [20, 140]\nresolution_hz = 10\n"
    )
    done = livebode("design", experiment, "--out", folder.parent / "design")
    assert done.code == 0, done.err
    names = {path.name for path in (folder / "designs/excitation").iterdir()}
    assert {"excitation.csv", "excitation.wav", "excitation.h", "excitation.st"} < names
    for name in names:
        assert (folder / "designs/excitation" / name).read_bytes() == (folder.parent / "design" / name).read_bytes(), (
            name
        )
        if name.endswith((".csv", ".wav", ".h", ".st")):
            with page.expect_download() as downloading:
                page.click(f'a[download="{name}"]')
            assert Path(downloading.value.path()).read_bytes() == (folder.parent / "design" / name).read_bytes()
    assert page.locator(".result tbody tr").count() > 8


def test_a_value_that_the_command_refuses_is_named_at_its_field(tab: Tab) -> None:
    page = task(tab, "design")
    page.fill("#field---out", "wrong")
    page.fill("#field---band", "20:140")
    page.fill("#field---resolution", "10")
    page.fill('[name="limits.torque_n_m_max"]', "14,5")
    run_task(page)
    place = page.locator('[id="wrong-limits.torque_n_m_max"]')
    assert place.inner_text().startswith("limits.torque_n_m_max = '14,5' is not usable")
    page.fill('[name="limits.torque_n_m_max"]', "14.5")
    page.fill("#field---band", "20-140")
    run_task(page)
    assert page.inner_text("#wrong---band").startswith("the band '20-140' is not LOW:HIGH in Hz")
    assert place.inner_text() == ""


def test_a_design_from_a_run_names_what_the_run_lacks(tab: Tab) -> None:
    page = task(tab, "design", "monday")
    page.fill("#field---out", "from a run")
    page.fill("#field---band", "50:200")
    page.fill("#field---resolution", "50")
    assert not page.is_visible('details[data-group="belt."]')
    page.click('details[data-group="measured."] summary')
    page.select_option('[name="measured.output"]', "velocity")
    page.fill('[name="measured.noise"]', "0.01")
    run_task(page)
    assert page.inner_text("#wrong") == "the loop's feedback is missing; describe its controllers"
    page.click('details[data-group="loop."] summary')
    page.fill('[name="loop.velocity.gain"]', "0.02")
    page.fill('[name="loop.velocity.integral_time_s"]', "0.2")
    page.fill('[name="loop.velocity.rate_hz"]', "1000")
    run_task(page)
    assert page.is_visible(".result img"), page.inner_text("#ask")


def test_a_job_is_seen_in_another_browser_and_after_a_reload(tab: Tab, browser: Browser) -> None:
    page = task(tab, "report", "tuesday")
    run_task(page)
    with Tab(browser, page.url, wait=False) as other:
        other.page.wait_for_selector("#printed:not([hidden])")
        assert other.page.inner_text("#command").startswith("livebode report")
        other.page.goto(tab.url)
        other.page.wait_for_selector('.tasks .jobs a:has-text("Write a report")')
        assert other.wrong == []
    page.reload()
    page.wait_for_selector("#printed:not([hidden])")


@pytest.mark.parametrize("name", ["compare", "learn", "report", "design"])
def test_a_form_fits_a_phone(browser: Browser, tab: Tab, name: str) -> None:
    with Tab(browser, f"{tab.url}task?task={name}", wait=False, viewport=PHONE) as phone:
        phone.page.wait_for_selector("#ask:not([hidden])")
        assert phone.page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
        assert phone.wrong == []


def test_a_later_run_is_compared_with_the_baseline_that_was_learned(tab: Tab, folder: Path) -> None:
    page = task(tab, "learn", "monday", "tuesday")
    page.fill("#field---out", "healthy press")
    run_task(page)
    write_csv(folder / "wednesday.csv", signals(4000, seed=7))
    page.goto(f"{tab.url}measure?recording=wednesday.csv")
    page.wait_for_selector("#measure:enabled")
    page.fill("#frequencies", "50, 100, 200")
    page.fill("#window", "100")
    page.click(".found summary")
    page.select_option("#baseline", "healthy press")
    page.wait_for_selector('#text:has-text("baselines/healthy press.json")', state="attached")
    page.click("#measure:enabled")
    page.wait_for_url("**/run/wednesday/")
    summary = RunRecord.open(folder / "wednesday").summary
    assert Path(summary["monitoring"]["baseline"]).name == "healthy press.json"
    assert summary["configuration"]["tracking"].get("average", False) is False


def test_a_job_is_cancelled_by_its_button_and_another_can_start(tab: Tab, folder: Path) -> None:
    page = task(tab, "design")
    page.fill("#field---out", "long")
    page.fill("#field---band", "1:1900")
    page.fill("#field---resolution", "0.5")
    page.fill('[name="limits.torque_n_m_max"]', "14.5")
    page.click("#start")
    page.click("#job button")
    page.wait_for_selector('#answer[aria-busy="false"]')
    assert page.inner_text("#sentence").startswith("Cancelled. stopped; no")
    assert not (folder / "designs" / "long").exists()
    assert page.is_enabled("#start")
