"""A servo in rpm and % of its rated torque: the page shows the response and the signals in SI units or in those."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import pytest
from playwright.sync_api import Browser

from livebode.arrays import Floats
from livebode.configuration import Axis
from livebode.core import Channel
from livebode.dashboard import Dashboard, ServerSettings
from livebode.records import RunRecord, channels_of
from livebode.runtime import Destination, run
from livebode.sources import open_log
from livebode.sources.live import Batch, encode_line
from tests.support.browser import Tab
from tests.support.drive_exports import EXPORTS, RPM

CLOSE = {"atol": 5e-5, "rtol": 3e-6}  # curves travel as float32
FACTORS = {"rpm": (RPM, "rpm/(N m)"), "% of the rated torque": (0.024 * RPM, "min-1/(%)")}


@dataclass(frozen=True)
class Recorded:
    directory: Path
    log: Path
    factor: float
    unit: str

    @property
    def newest(self) -> Any:
        return RunRecord.open(self.directory).responses().newest()


def recorded_from(name: str, folder: Path) -> Recorded:
    """A run of a drive's recording that records its samples."""
    export = EXPORTS[name]
    folder.mkdir(exist_ok=True)
    log = export.write(folder / "log.csv")
    excitation, torque, output = export.names
    given = {
        "source": {"log": log, "units": dict(export.units)},
        "signals": {"excitation": excitation, "input": torque, "output": output},
        "record": {"samples": True},
        "fit": {"model": "two-mass"},
    }
    found = run(Axis.of(given, "test"), Destination(folder / "run", lambda *_: None))
    return Recorded(found.directory, log, *FACTORS.get(name, (1, "")))


@contextmanager
def tab_of(browser: Browser, recorded: Recorded) -> Iterator[Tab]:
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(recorded.directory)
    with dashboard, Tab(browser, dashboard.url) as found:
        found.until("bode.curves.model && tracking.made?.data[1].length")
        yield found
        assert found.wrong == []


@pytest.fixture(scope="module", params=FACTORS)
def recorded(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    return recorded_from(request.param, tmp_path_factory.mktemp("drive"))


@pytest.fixture
def tab(browser: Browser, recorded: Recorded) -> Iterator[Tab]:
    with tab_of(browser, recorded) as found:
        yield found


def drawn(tab: Tab, curve: str, part: int = 0) -> Floats:
    """Magnitude at the lines: 0 the value, 1 and 2 the edges of the band."""
    return tab.numbers(f"bode.at.map((i) => bode.charts[0].data[bode.seriesOf(0, '{curve}') + {part}][i])")


def choose(tab: Tab, units: str) -> None:
    tab.page.locator("#bode-view").click()
    tab.page.locator("#bode-view-panel [data-option=units]").select_option(units)
    tab.page.keyboard.press("Escape")
    tab.settle()


def test_the_run_remembers_the_units_of_the_drive(recorded: Recorded) -> None:
    record = RunRecord.open(recorded.directory)
    assert record.found["source_unit"] == {"unit": recorded.unit, "factor": pytest.approx(recorded.factor)}
    table = next(record.tables("samples"))
    log = open_log(recorded.log, units=record.summary["configuration"]["source"].get("units", {}))
    used = {channel.name: channel for channel in log.channels}
    for channel in channels_of(table.schema):
        true: Channel = used[channel.name]
        assert (channel.unit, channel.factor) == (true.unit, true.factor)
        if true.factor != 1:
            assert channel.source_unit == true.source_unit


def test_a_live_run_remembers_them_too(tmp_path: Path) -> None:
    export = EXPORTS["% of the rated torque"]
    log = open_log(export.write(tmp_path / "log.csv"))
    names = excitation, torque, output = export.names
    raw = np.concatenate([block.data for block in log.as_written().blocks(names)], axis=1)
    channels = tuple(Channel(c.name, c.source_unit) for c in log.channels if c.name in names)
    starts = range(0, raw.shape[1], 500)
    sent = [encode_line(Batch(at, raw[:, at : at + 500], channels, log.rate_hz)) for at in starts]
    (tmp_path / "lines").write_bytes(b"".join(sent))
    given = {
        "source": {"url": "stdin:", "units": dict(export.units)},
        "signals": {"excitation": excitation, "input": torque, "output": output},
        "lines": {"frequencies": "4:196:6", "window": 2000},
    }
    with (tmp_path / "lines").open("rb") as lines, mock.patch.object(sys, "stdin", lines):
        found = run(Axis.of(given, "test"), Destination(tmp_path / "run", lambda *_: None))
    factor, unit = FACTORS["% of the rated torque"]
    record = RunRecord.open(found.directory)
    assert record.found["source_unit"] == {"unit": unit, "factor": pytest.approx(factor)}
    true = RunRecord.open(recorded_from("SI", tmp_path / "SI").directory).responses().newest()
    np.testing.assert_allclose(record.responses().newest().value, true.value, rtol=1e-3)


def test_the_page_shows_the_response_in_the_units_of_the_drive(recorded: Recorded, tab: Tab) -> None:
    response = recorded.newest
    si = 20 * np.log10(np.abs(response.value))
    tab.until("map.cells")
    level = tab.numbers("map.values.flat()")
    model, tracked = drawn(tab, "model"), tab.numbers("tracking.made.data[1]")
    np.testing.assert_allclose(drawn(tab, "measured"), si, **CLOSE)
    choose(tab, "drive")
    for _ in range(2):
        value, reach = recorded.factor * np.abs(response.value), recorded.factor * response.bound()
        np.testing.assert_allclose(drawn(tab, "measured"), 20 * np.log10(value), **CLOSE)
        np.testing.assert_allclose(drawn(tab, "measured", 1), 20 * np.log10(value + reach), **CLOSE)
        above = 20 * np.log10(recorded.factor)
        np.testing.assert_allclose(drawn(tab, "model") - model, above, atol=1e-4)
        np.testing.assert_allclose(tab.numbers("tracking.made.data[1]") - tracked, above, atol=1e-4)
        tab.until("map.cells")
        np.testing.assert_allclose(tab.numbers("map.values.flat()") - level, above, atol=1e-4)
        label = tab.js("bode.charts[0].axes[1].label(bode.charts[0])")
        assert label.endswith(f"re 1 {recorded.unit}")
        # The phase and the parameters are what they were; a link shows the same view.
        assert "bode-units=drive" in tab.js("location.hash")
        tab.reload()
        tab.until("bode.drawn.model && tracking.made?.data[1].length")
        tab.settle()
    choose(tab, "si")
    np.testing.assert_allclose(drawn(tab, "measured"), si, **CLOSE)


def test_the_signals_are_what_the_drive_wrote(recorded: Recorded, tab: Tab) -> None:
    choose(tab, "drive")
    tab.page.locator("#tab-signals").click()
    tab.until("signals.charts.length && signals.charts.every(({ made }) => made?.data[0].length)")
    record = RunRecord.open(recorded.directory)
    name = record.summary["configuration"]["signals"]["output"]
    raw = np.concatenate([block.data[0] for block in open_log(recorded.log).as_written().blocks([name])])
    chart = f"signals.charts.find(({{ host }}) => host.dataset.name === '{name}')"
    time_s, shown = (tab.numbers(f"{chart}.made.data[{row}]") for row in (0, 1))
    true = raw[np.round(time_s * record.lines.rate_hz).astype(int)]
    np.testing.assert_allclose(shown, true, rtol=1e-6, atol=1e-6 * np.ptp(raw))
    assert tab.js(f"{chart}.unit") == recorded.unit.partition("/(")[0]


def test_a_recording_in_si_units_offers_no_other_units(browser: Browser, tmp_path: Path) -> None:
    recorded = recorded_from("SI", tmp_path)
    assert RunRecord.open(recorded.directory).found["source_unit"] is None
    with tab_of(browser, recorded) as tab:
        tab.page.locator("#bode-view").click()
        assert tab.page.locator("#bode-view-panel [data-option=units]").count() == 0
