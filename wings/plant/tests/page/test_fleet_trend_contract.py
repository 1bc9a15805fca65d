"""The last year of an axis on the page of its fleet, from a lake with the tables of the sink and of an archive."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from http.client import HTTPConnection
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlsplit

import numpy as np
import pyarrow as pa
import pytest
from playwright.sync_api import Browser

from livebode.core import LEVELS, DamageWarning
from livebode.dashboard import Dashboard, ServerSettings
from livebode_plant.fleet.status_message import encode_names
from livebode_plant.lake import TABLES, Lake
from livebode_plant.page.fleet_feed import DemoFeed, DemoFleet
from livebode_plant.page.fleet_pages import FleetView
from livebode_plant.page.fleet_trend import POINTS_MAX
from tests.support.axe import violations, with_axe
from tests.support.browser import Tab
from tests.support.fleet_pages import fleet_page
from tests.support.guarded import TOKEN, VIEWER
from tests.support.peers.peer import PATIENCE_S
from tools.fleet_year import LOST_A_MONTH, write_year

STIFFNESS = 1.3e6
FLEET = DemoFleet(12)
OWN, NEW, EMPTY = FLEET.paths[:3]
STRANGE = "Secret/hall/press 1/x"


@pytest.fixture(scope="module")
def lake(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two months of one axis, a day of another in means over minutes, and an axis that is not of this fleet."""
    place = tmp_path_factory.mktemp("lake")
    write_year(place, OWN, STIFFNESS, days=60)
    write_year(place, STRANGE, 7.0, days=2)
    write_year(place, NEW, STIFFNESS, days=1, tier="minute")
    archive_runs(Lake(str(place)))
    return place


def archive_runs(lake: Lake) -> None:
    """Ten runs of the axis with other settings; the last of them was not finished, and does not count."""
    begin = datetime.now(UTC) - timedelta(days=70)
    keys = [{"content": f"{n:064x}", "recipe": "b" * 16} | dict(zip(LEVELS, OWN.split("/"))) for n in range(10)]
    fitted = {"model": "two-mass", "name": "stiffness", "unit": "N/m", "value": 1.2e6, "bound_95": 4e3}
    fitted |= {"low": 1.19e6, "high": 1.21e6, "fits": 100}
    quantities = [key | fitted | {"recorded_from": begin + timedelta(days=n)} for n, key in enumerate(keys)]
    lake.add_rows("quantities", pa.Table.from_pylist(quantities, TABLES["quantities"].schema))
    lake.add_rows("runs", pa.Table.from_pylist(keys[:-1], TABLES["runs"].schema))


class Page:
    """The page of the fleet with tokens, which knows its axes."""

    def __init__(self, lake: str) -> None:
        view = FleetView(DemoFeed(FLEET), lake=lake)
        view.board.process([encode_names(names, time.time())[0] for names in FLEET.names()], time.time())
        self.dashboard = Dashboard(ServerSettings("127.0.0.1", 0, token=TOKEN, viewer_token=VIEWER))
        self.dashboard.show(view)

    def trend(self, axis: str, quantity: str = "", token: str = VIEWER) -> tuple[int, Any]:
        """Status and answer."""
        connection = HTTPConnection("127.0.0.1", urlsplit(self.dashboard.url).port or 0, timeout=PATIENCE_S)
        headers = {"authorization": f"Bearer {token}"}
        connection.request("GET", f"/api/trend?axis={quote(axis)}&quantity={quote(quantity)}", headers=headers)
        answer = connection.getresponse()
        found = answer.status, json.loads(answer.read())
        connection.close()
        return found


@pytest.fixture(scope="module")
def page(lake: Path) -> Iterator[Page]:
    one = Page(str(lake))
    with one.dashboard:
        yield one


def test_the_year_of_an_axis_has_few_points_and_all_of_its_range(page: Page, lake: Path) -> None:
    rows = Lake(str(lake)).read("fleet_parameters_hour", [*LEVELS, "name", "value", "low", "high"]).to_pandas()
    rows = rows[(rows["site"] == "Augsburg") & (rows["name"] == "stiffness")]
    assert len(rows) > POINTS_MAX
    status, answer = page.trend(OWN)
    assert status == 200
    assert answer["state"] == "shown"
    assert answer["quantities"] == [["two-mass", "stiffness", "N/m"], ["two-mass", "resonance", "Hz"]]
    points = np.array(answer["points"], float)
    own, others = points[points[:, 5] == 0], points[points[:, 5] == 1]
    assert len(points) <= POINTS_MAX
    assert own[:, 3].min() == rows["low"].min()
    assert own[:, 4].max() == rows["high"].max()
    assert np.allclose(own[:, 2] / own[:, 1], 0.003, rtol=0.02)
    assert np.isclose(np.median(own[:, 1]), rows["value"].median(), rtol=1e-3)
    # The runs of the archive that count; their settings differ, so they are no part of the trend.
    assert others[:, 1].tolist() == [1.2e6] * 9
    trend = answer["trend"]
    lost = LOST_A_MONTH * STIFFNESS  # where the days begin in the data depends on the hour of the test
    assert abs(trend["per_month"] + lost) < 2 * trend["bound_95"] < lost
    assert answer["days"] == len(trend["line"]) > answer["days_min"]


def test_a_quantity_is_chosen_and_a_new_axis_is_shown_by_minutes(page: Page) -> None:
    _, answer = page.trend(OWN, "two-mass:resonance")
    assert answer["chosen"] == 1
    assert all(39 < point[1] < 43 for point in answer["points"])
    _, answer = page.trend(NEW)
    assert answer["trend"] is None
    assert answer["days"] < answer["days_min"]
    assert len(answer["points"]) >= 20
    assert page.trend(EMPTY) == (200, {"state": "no values", "stopped": False, "damaged": []})


def test_only_axes_of_the_fleet_are_shown_and_only_to_those_who_may(page: Page) -> None:
    assert page.trend(OWN, token="x" * 40)[0] == 401
    hostile = [STRANGE, "", "/", "../lake", "'; DROP TABLE runs", OWN + "/", OWN.upper(), "\0", "%", OWN + "\n"]
    for name in hostile:
        status, answer = page.trend(name)
        assert (status, "no such axis" in answer["error"]) == (400, True), name
    for name in ("stiffness", "two-mass:", ":", "two-mass:stiffness\0", "'"):
        status, answer = page.trend(OWN, name)
        assert (status, "no such quantity" in answer["error"]) == (400, True), name


def test_without_a_usable_lake_one_sentence_says_why(tmp_path: Path) -> None:
    for place, expected in (("", "no lake"), (str(tmp_path / "nothing"), "no values")):
        with (one := Page(place)).dashboard:
            assert one.trend(OWN)[1]["state"] == expected
    write_year(tmp_path / "data", OWN, STIFFNESS, days=1)
    (tmp_path / "log" / "tables" / "fleet_parameters_hour" / "_delta_log").mkdir(parents=True)
    (tmp_path / "log" / "tables" / "fleet_parameters_hour" / "_delta_log" / f"{0:020}.json").write_text("damaged")
    for file in (tmp_path / "data" / "tables" / "fleet_parameters_hour").glob("*.parquet"):
        file.write_bytes(b"damaged" * 100)
    with (one := Page(str(tmp_path / "log"))).dashboard:
        status, answer = one.trend(OWN)
        assert status == 400
        assert "the table fleet_parameters_hour of the lake" in answer["error"]
    with pytest.warns(DamageWarning, match="fleet_parameters_hour"), (one := Page(str(tmp_path / "data"))).dashboard:
        assert one.trend(OWN)[1]["state"] == "no values"  # a damaged file is left out, and named by the server


def test_a_person_reads_the_year_with_mouse_and_keys(browser: Browser, lake: Path) -> None:
    with fleet_page(12, lake=str(lake)) as (url, _), with_axe(browser) as tab:
        page = tab.page
        page.set_viewport_size({"width": 390, "height": 844})
        page.goto(f"{url}#axis={quote(OWN)}")
        said = page.locator("#axis-trend .said")
        said.filter(has_text="N/m a month (−0.").wait_for()
        assert "other settings" in said.inner_text()
        plot = page.locator("#axis-trend .plot")
        assert (plot.get_attribute("aria-label") or "").startswith("stiffness, ")
        found = violations(tab, "year of an axis")
        page.locator("#axis-trend select").select_option("two-mass:resonance")
        page.locator("#axis-trend .trend-card[data-name='two-mass/resonance'] .uplot").wait_for()
        page.locator("#axis-trend select").focus()
        page.keyboard.press("Tab")
        assert plot.evaluate("(one) => one === document.activeElement")
        page.keyboard.press("End")
        page.locator("#axis-trend .read").filter(has_text="Hz (90 %:").wait_for()
        assert tab.js("document.documentElement.scrollWidth") <= 390
        page.keyboard.press("Escape")
        page.locator("dialog#axis").wait_for(state="hidden")
        _sentence(tab, EMPTY, "run livebode fleet sink")
        _sentence(tab, NEW, "A trend needs values on 20 days")
        assert tab.wrong == []
    assert not found, "\n".join(found)


def test_a_damaged_file_of_the_lake_is_named_on_the_page_until_it_is_restored(browser: Browser, tmp_path: Path) -> None:
    write_year(tmp_path, OWN, STIFFNESS, days=30)
    table = tmp_path / "tables" / "fleet_parameters_hour"
    file = max(table.glob("**/*.parquet"), key=lambda path: path.stat().st_size)
    whole = file.read_bytes()
    file.write_bytes(whole[:100] + bytes([whole[100] ^ 1]) + whole[101:])
    name = f"tables/fleet_parameters_hour/{file.relative_to(table)}"
    with pytest.warns(DamageWarning, match=name):
        _said(browser, tmp_path, f"1 file of the lake is damaged, and its values are missing here: restore {name} from")
    lake = Lake(str(tmp_path))
    with pytest.warns(DamageWarning, match="SHA-256"):
        lake.read("fleet_parameters_hour")
    assert lake.damaged == [name]
    file.write_bytes(whole)
    lake.read("fleet_parameters_hour")
    assert lake.damaged == []


def _said(browser: Browser, lake: Path, expected: str) -> None:
    """Wait until the page of an axis says this."""
    with fleet_page(12, lake=str(lake)) as (url, _), with_axe(browser) as tab:
        tab.page.goto(f"{url}#axis={quote(OWN)}")
        tab.page.locator("#axis-trend .said").filter(has_text=expected).wait_for()
        assert tab.wrong == []


def _sentence(tab: Tab, axis: str, expected: str) -> None:
    tab.js(f"axis.open(feed.paths.indexOf({json.dumps(axis)}))")
    tab.page.locator("#axis-trend .said").filter(has_text=expected).wait_for()
    tab.page.keyboard.press("Escape")
