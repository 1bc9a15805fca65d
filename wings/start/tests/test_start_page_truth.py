"""The way of a person from a recording to the Bode plot of a known machine, in Chromium."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path

import numpy as np
import pytest

from livebode.core import Responses
from livebode.records import RunRecord
from livebode_start.workspace import Workspace
from tests.support.browser import Tab, chromium
from tests.support.command import livebode
from tests.support.servo_csv import SERVO, write_servo
from tests.support.start_pages import CHANNELS, drop, start_page

PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}


def newest(run: Path) -> Responses:
    return RunRecord.open(run).responses()[-1:]


def check_truth(run: Path) -> None:
    """Value and bounds at each line are those of the machine."""
    response = newest(run)
    truth = SERVO.response(response.frequency_hz)
    error = np.abs(response.value[0] - truth)
    assert np.all(error < 0.05 * np.abs(truth))
    assert np.mean(error < 3 * response.sigma[0]) > 0.9


def test_from_a_csv_to_a_bode_plot_with_bounds_without_toml(tmp_path: Path) -> None:
    log, folder = write_servo(tmp_path / "servo.csv"), tmp_path / "runs"
    with start_page(folder) as url, chromium() as browser, Tab(browser, url, wait=False) as tab:
        tab.page.wait_for_selector(".no-runs .drop")
        assert not tab.page.is_visible(".list")
        drop(tab, log)
        chosen = {role: tab.page.input_value(f"#role-{role}") for role in (*CHANNELS, "schedule")}
        assert chosen == CHANNELS | {"schedule": ""}
        assert all(tab.page.inner_text(f"#role-{role}-reason") for role in CHANNELS)
        tab.page.click("#measure")
        tab.page.wait_for_url("**/run/servo/")
        tab.until("window.livebode?.bode.curves.measured")
        shown_db = tab.numbers("bode.curves.measured.frame.magnitude")
        assert tab.wrong == []
    np.testing.assert_allclose(shown_db, 20 * np.log10(np.abs(newest(folder / "servo").value[0])), atol=0.01)
    check_truth(folder / "servo")


def test_the_largest_text_of_a_measured_servo_is_its_resonance_in_the_language_of_the_reader(tmp_path: Path) -> None:
    log = write_servo(tmp_path / "servo.csv")
    with start_page(tmp_path / "runs") as url, chromium() as browser, Tab(browser, url, wait=False, locale="de") as tab:
        drop(tab, log)
        assert tab.page.inner_text("#role-schedule-reason") == "kein Kanal bietet sich an"
        assert tab.page.inner_text("#role-input-reason") == "ein Drehmoment in N m"
        assert tab.page.inner_text("#lines-found").endswith(" Linien, 4 … 600 Hz")
        assert tab.page.inner_text("#window-found") == "Abtastwerte: 0,5 s, eine Periode"
        tab.page.click("#measure")
        tab.page.wait_for_url("**/run/servo/")
        tab.page.wait_for_function("() => /^Resonanz/.test(document.getElementById('headline').innerText)")
        headline = tab.page.inner_text("#headline")
        assert tab.wrong == []
    value, bound = (float(n.replace(",", ".")) for n in re.findall(r"[\d,]+", headline)[:2])
    truth_hz = SERVO.resonance_hz
    assert abs(value - truth_hz) < 2 * bound < 0.5


def test_the_configuration_is_what_inspect_writes_and_the_terminal_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "runs"
    with start_page(folder) as url, chromium() as browser, Tab(browser, url, wait=False) as tab:
        drop(tab, write_servo(tmp_path / "servo.csv"))
        tab.page.click("#toml summary")
        text, command = tab.page.inner_text("#text"), tab.page.inner_text("#command")
        tab.page.click("#measure")
        tab.page.wait_for_url("**/run/servo/")
    monkeypatch.chdir(folder)
    assert livebode("inspect", "servo.csv", "--out", "inspected.toml", "--yes").code == 0
    assert (folder / "inspected.toml").read_text().strip() == text.strip()
    assert (folder / "servo.toml").read_text().strip() == text.strip()
    words = command.split()
    assert words[:2] == ["livebode", "run"]
    in_terminal = livebode(*words[1:-1], "--out", "terminal")
    assert in_terminal.code == 0
    np.testing.assert_array_equal(newest(folder / "terminal").value, newest(folder / "servo").value)


def test_roles_change_by_drag_and_by_select_and_lines_follow(tmp_path: Path) -> None:
    with start_page(tmp_path / "runs") as url, chromium() as browser, Tab(browser, url, wait=False) as tab:
        drop(tab, write_servo(tmp_path / "servo.csv"))
        tab.page.drag_and_drop(".signal[data-name='motor_speed'] b", ".slot[data-role='input']")
        assert tab.page.input_value("#role-input") == "motor_speed"
        assert tab.page.input_value("#role-output") == "torque"  # they change places
        tab.page.select_option("#role-input", "torque")
        assert tab.page.input_value("#role-output") == "motor_speed"
        tab.page.wait_for_selector("#measure:enabled")
        tab.page.select_option("#role-output", "")
        tab.page.wait_for_selector("#ready.wrong")
        assert tab.page.is_disabled("#measure")
        assert "output" in tab.page.inner_text("#ready")
        assert [word for word in tab.wrong if "400" not in word] == []


def test_span_lines_and_window_are_used_as_edited(tmp_path: Path) -> None:
    folder = tmp_path / "runs"
    with start_page(folder) as url, chromium() as browser, Tab(browser, url, wait=False) as tab:
        drop(tab, write_servo(tmp_path / "servo.csv"))
        tab.page.fill("#from", "1")
        tab.page.fill("#to", "7")
        tab.page.fill("#frequencies", "4:16:4")
        tab.page.wait_for_selector("#measure:enabled")
        tab.page.wait_for_function("() => document.getElementById('text').textContent.includes('from = 1')")
        tab.page.click("#measure")
        tab.page.wait_for_url("**/run/servo/")
    summary = json.loads((folder / "servo" / "run.json").read_text())
    configuration = summary["configuration"]
    assert (configuration["source"]["from"], configuration["source"]["to"]) == (1.0, 7.0)
    np.testing.assert_allclose(newest(folder / "servo").frequency_hz, np.arange(4, 17, 4))
    assert newest(folder / "servo").time_s[0] < 7


def test_a_span_that_is_dragged_is_legible_in_its_fields_and_used(tmp_path: Path) -> None:
    folder = tmp_path / "runs"
    with start_page(folder) as url, chromium() as browser, Tab(browser, url, wait=False) as tab:
        drop(tab, write_servo(tmp_path / "servo.csv"))
        tab.page.wait_for_selector(".u-over")
        box = tab.page.locator(".u-over").first.bounding_box()
        assert box
        for share, act in ((0.2137, tab.page.mouse.down), (0.8719, tab.page.mouse.up)):
            tab.page.mouse.move(box["x"] + share * box["width"], box["y"] + 9, steps=4)
            act()
        tab.page.click("#use")
        span = [float(tab.page.input_value(f"#{field}")) for field in ("from", "to")]
        cut = "(e) => e.scrollWidth > e.clientWidth || e.value.length > 6"
        assert not any(tab.page.eval_on_selector(f"#{field}", cut) for field in ("from", "to"))
        np.testing.assert_allclose(span, [0.2137 * 8, 0.8719 * 8], atol=0.03)
        tab.page.wait_for_selector("#measure:enabled")
        assert f"from = {span[0]}" in (tab.page.text_content("#text") or "")


def test_a_german_csv_is_measured_on_a_phone(tmp_path: Path) -> None:
    folder = tmp_path / "runs"
    with start_page(folder) as url, chromium() as browser, Tab(browser, url, wait=False, **PHONE) as tab:
        drop(tab, write_servo(tmp_path / "Prüfstand 3.csv", german=True))
        assert tab.page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")
        assert tab.page.inner_text(".signal:last-child b") == "Geschwindigkeit für Regler"
        tab.page.tap("#measure")
        tab.page.wait_for_url("**/run/**")
        assert tab.wrong == []
    check_truth(folder / "Prüfstand 3")


def test_a_recording_beside_the_directory_is_chosen_and_the_terminal_repeats_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    write_servo(tmp_path / "servo.csv")
    for number in range(8):
        write_servo(tmp_path / f"short {number}.csv", periods=1)
        os.utime(tmp_path / f"short {number}.csv", (2e9, 2e9))
    (tmp_path / "notes.toml").write_text("")
    (tmp_path / "link.csv").symlink_to("servo.csv")
    with start_page(Path("runs")) as url, chromium() as browser, Tab(browser, url, wait=False) as tab:
        tab.page.wait_for_selector(".recordings a")
        assert not tab.page.is_visible("text=../servo.csv")
        tab.page.click(".here button")
        names = tab.page.locator(".recordings a").all_inner_texts()
        assert sorted(names) == [f"../{name}" for name in ("servo.csv", *(f"short {k}.csv" for k in range(8)))]
        tab.page.click("text=../servo.csv")
        tab.page.wait_for_selector("#measure:enabled")
        tab.page.click("#measure")
        tab.page.wait_for_url("**/run/servo/")
        assert tab.wrong == []
    check_truth(Path("runs/servo"))
    monkeypatch.chdir(tmp_path / "runs")
    assert livebode("run", "servo.toml", "--out", "terminal").code == 0
    np.testing.assert_array_equal(newest(Path("terminal")).value, newest(Path("servo")).value)


@pytest.mark.parametrize("elsewhere", ["home/runs", "link"])
def test_only_beside_a_directory_in_the_working_one_recordings_are_offered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, elsewhere: str
) -> None:
    write_servo(tmp_path / "servo.csv")
    (tmp_path / "home" / "runs").mkdir(parents=True)
    (tmp_path / "link").symlink_to("home/runs")
    monkeypatch.chdir(tmp_path)
    assert Workspace(Path(elsewhere)).recordings() == []
    assert [row["name"] for row in Workspace(Path("runs")).recordings()] == ["../servo.csv"]


def test_a_measurement_is_followed_and_can_be_cancelled_after_a_reload_in_the_middle(tmp_path: Path) -> None:
    folder = tmp_path / "runs"
    with start_page(folder) as url, chromium() as browser, Tab(browser, url, wait=False) as tab:
        drop(tab, write_servo(tmp_path / "servo.csv", periods=400))
        tab.page.click("#measure")
        tab.page.wait_for_selector(".job button")
        tab.page.reload()
        tab.page.click(".job button")
        tab.page.wait_for_selector("#ready.wrong")
        assert "cancelled" in tab.page.inner_text("#ready")
        tab.page.reload()  # a job that has ended is not followed again
        tab.page.wait_for_selector("#measure:enabled")
        tab.page.click("#measure")
        tab.page.wait_for_selector(".job button")
        tab.page.reload()
        tab.page.wait_for_url("**/run/servo-2/")
        assert tab.wrong == []
    assert newest(folder / "servo-2").time_s[0] > 50


def test_a_measurement_is_cancelled_and_nothing_is_half_written(tmp_path: Path) -> None:
    folder = tmp_path / "runs"
    with start_page(folder) as url, chromium() as browser, Tab(browser, url, wait=False) as tab:
        drop(tab, write_servo(tmp_path / "servo.csv"))
        tab.page.click("#measure")
        tab.page.click(".job button")
        tab.page.wait_for_selector("#measure:enabled")
        assert "cancelled" in tab.page.inner_text("#ready")
        tab.page.click("#measure")
        tab.page.wait_for_url("**/run/**")
    runs = [path for path in folder.iterdir() if path.is_dir()]
    assert [path.name for path in runs] == ["servo-2"]
    check_truth(runs[0])
