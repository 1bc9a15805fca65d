"""A matrix run on the page: its entries, singular values and reasons, and the board of a picked entry; also live."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser

from livebode.analysis import Overview
from livebode.configuration import Axis
from livebode.core import Block, Lines, MatrixResponses
from livebode.dashboard import Dashboard, ServerSettings
from livebode.excitation import MatrixExcitation
from livebode.records import RunRecord
from livebode.runtime import Destination, RunControl, RunEnded, RunStarted, run
from livebode.simulation import GantryLoop
from tests.support.axe import SIZES, violations, with_axe
from tests.support.browser import Tab
from tests.support.command import write_parquet

RATE_HZ = 4000.0
LINES = Lines.parse("10:60:5", rate_hz=RATE_HZ, window=800)
OUTPUTS, INPUTS = ["velocity1", "velocity2", "cart"], ["u1", "u2"]
AXIS: dict[str, dict[str, object]] = {
    "signals": {"output": OUTPUTS, "input": INPUTS, "excitation": ["w1", "w2"]},
    "lines": {"frequencies": "10:60:5", "window": 800},
    "tracking": {"estimator": "joint", "hop": 800},
    "experiments": {"dwell_periods": 3, "settle_periods": 2},
}


def recorded(folder: Path, condition_max: float = 1e3) -> Path:
    """A run of the gantry."""
    excitation = MatrixExcitation.orthogonal(LINES, 2, 0.5, dwell=3, settle=2)
    w = np.tile(excitation.samples, 5)
    block: Block = GantryLoop().simulate(w, noise=0.05 * np.random.default_rng(0).standard_normal((3, w.shape[1])))
    folder.mkdir(parents=True)
    log = write_parquet(folder / "log.parquet", dict(zip(block.names, block.data, strict=True)))
    experiments = AXIS["experiments"] | {"condition_max": condition_max}
    axis = Axis.of({"source": {"log": log, "rate_hz": RATE_HZ}} | AXIS | {"experiments": experiments}, "test")
    return run(axis, Destination(folder / "gantry", lambda *_: None)).directory


@pytest.fixture(scope="module")
def gantry(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp("matrix") / "separated")


@pytest.fixture(scope="module")
def tab(browser: Browser, gantry: Path) -> Iterator[Tab]:
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(gantry)
    with dashboard, Tab(browser, dashboard.url) as found:
        found.until("matrix.answer && document.querySelector('[data-axis]')")
        yield found
        assert found.wrong == []


def matrix(directory: Path) -> MatrixResponses:
    return RunRecord.open(directory, matrix=True).matrix()


def test_every_entry_has_the_values_and_bounds_of_the_record(tab: Tab, gantry: Path) -> None:
    newest = matrix(gantry)[-1:]
    for o, i in np.ndindex(len(OUTPUTS), len(INPUTS)):
        value, bound = newest.value[0, :, o, i], newest.bound()[0, :, o, i]
        assert np.allclose(tab.numbers(f"matrix.answer.entries[{o}][{i}].db"), 20 * np.log10(np.abs(value)))
        assert np.allclose(tab.numbers(f"matrix.answer.entries[{o}][{i}].reach"), bound / np.abs(value))
    for k in range(2):
        expected = 20 * np.log10(newest.singular_values[0, :, k])
        assert np.allclose(tab.numbers(f"matrix.answer.singular_db[{k}]"), expected)
    assert np.allclose(tab.numbers("matrix.answer.condition"), newest.condition[0])
    for o in range(len(OUTPUTS)):
        assert np.allclose(tab.numbers(f"matrix.answer.coherence[{o}]"), newest.coherence[0, :, o])
    assert tab.page.locator("#matrix figure").count() == 3
    assert tab.page.locator("#matrix [data-axis]").count() == 6
    name = tab.page.locator('[data-axis="3"]').text_content()
    assert name is not None
    assert name.startswith(f"velocity2 from u2; valid at {len(LINES)} of {len(LINES)} lines; ")


def test_arrows_move_and_enter_shows_the_board_of_the_entry(tab: Tab, gantry: Path) -> None:
    page = tab.page
    assert page.locator('#matrix [data-axis][tabindex="0"]').count() == 1, "one tab stop"
    page.locator('[data-axis="0"]').focus()
    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowRight")
    assert page.evaluate("() => document.activeElement.dataset.axis") == "3"
    page.keyboard.press("Enter")
    tab.until("page.axis === 3 && bode.curves.measured?.frame?.axis === 3 && document.getElementById('matrix').hidden")
    newest = matrix(gantry).entry("velocity2", "u2")[-1:]
    db = tab.numbers("bode.curves.measured.db")
    assert np.allclose(db, 20 * np.log10(np.abs(newest.value[0])), atol=1e-4)
    assert "matrix=0" in page.url
    assert "velocity2" in page.url
    tab.reload()
    tab.until("window.livebode?.bode.curves.measured && page.axis === 3")
    assert page.locator("#matrix").is_hidden()
    page.locator("#matrix-open").click()
    page.locator('[data-axis="3"][aria-current="true"]').wait_for()
    tab.until("!location.hash.includes('matrix=')")


def test_a_moment_in_the_past_has_its_own_matrix(tab: Tab, gantry: Path) -> None:
    every = matrix(gantry)
    use = np.flatnonzero(every.valid.any(axis=(1, 2)))
    row = int(use[0])
    tab.page.evaluate(f"() => livebode.timeline.go({every.time_s[row]})")
    tab.until(f"Math.abs(matrix.answer.time_s - {every.time_s[row]}) < 1e-6")
    assert np.allclose(tab.numbers("matrix.answer.entries[0][1].db"), 20 * np.log10(np.abs(every.value[row, :, 0, 1])))
    tab.js("timeline.newest()")
    tab.until("timeline.atS === null")


def test_lines_at_which_inputs_do_not_separate_have_no_value_and_the_reason(browser: Browser, tmp_path: Path) -> None:
    directory = recorded(tmp_path / "close", condition_max=1.5)
    newest = matrix(directory)[-1:]
    valid = newest.valid[0, :, 0]
    assert 0 < valid.sum() < len(LINES)
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(directory)
    with dashboard, Tab(browser, dashboard.url) as tab:
        tab.until("matrix.answer && document.querySelector('[data-axis]')")
        assert np.array_equal(np.isfinite(tab.numbers("matrix.answer.entries[0][0].db")), valid)
        assert np.array_equal(np.isfinite(tab.numbers("matrix.answer.singular_db[0]")), newest.valid[0].all(axis=1))
        shown = tab.page.locator('[data-axis="0"] .state').inner_text()
        assert shown.startswith(f"valid at {valid.sum()} of {len(LINES)} lines: ")
        assert "not separated from the other inputs" in shown
        assert tab.wrong == []


def test_axe_finds_nothing_and_nothing_is_wider_than_a_telephone(browser: Browser, gantry: Path) -> None:
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(gantry)
    with dashboard, with_axe(browser) as tab:
        tab.page.goto(dashboard.url)
        tab.until("matrix.answer && document.querySelector('[data-axis]')")
        found = violations(tab, "matrix")
        tab.page.locator("#theme").click()
        tab.page.set_viewport_size({"width": 390, "height": 844})
        found += violations(tab, "matrix", "html", SIZES)
        assert not found, "\n".join(found)
        assert tab.js("document.documentElement.scrollWidth <= innerWidth")


def test_the_header_of_an_entry_has_one_row_on_a_desk(browser: Browser, gantry: Path) -> None:
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(gantry)
    with dashboard, Tab(browser, dashboard.url, viewport={"width": 1400, "height": 900}) as tab:
        tab.until("matrix.answer && document.querySelector('[data-axis]')")
        tab.page.locator('[data-axis="3"]').click()
        tab.until("bode.curves.measured?.frame?.axis === 3")
        assert tab.page.locator("#axis option:checked").inner_text().endswith("velocity2/u2")
        assert "velocity2" not in tab.page.locator("#status-text").inner_text(), "it is there once"
        first, last = (tab.page.locator(one).bounding_box() for one in ("#axis", "#help"))
        assert first is not None
        assert last is not None
        assert last["y"] < first["y"] + first["height"]


def test_a_live_matrix_run_shows_each_entry(browser: Browser, gantry: Path) -> None:
    record = RunRecord.open(gantry, matrix=True)
    rows = record.matrix()
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    hub = dashboard.hub("gantry", [(o, i) for o in OUTPUTS for i in INPUTS])
    with dashboard, Tab(browser, dashboard.url, wait=False) as tab:
        hub(RunStarted(gantry, record.summary, RunControl(), Overview()))
        hub(rows[: len(rows) - 1])
        tab.until(f"window.livebode?.matrix.answer && Math.abs(matrix.answer.time_s - {rows.time_s[-2]}) < 1e-6")
        worker = threading.Thread(target=hub, args=(rows[-1:],))
        worker.start()
        worker.join()
        tab.until(f"Math.abs(matrix.answer.time_s - {rows.time_s[-1]}) < 1e-6")
        tab.page.locator('[data-axis="5"]').click()
        tab.until("page.axis === 5 && bode.curves.measured?.frame?.axis === 5")
        newest = rows.entry("cart", "u2")[-1:]
        found = tab.numbers("bode.curves.measured.db")
        assert np.allclose(found, 20 * np.log10(np.abs(newest.value[0])), atol=1e-4)
        hub(RunEnded(record.summary))
        assert tab.wrong == []
