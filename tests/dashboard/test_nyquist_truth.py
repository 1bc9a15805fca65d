"""Nyquist plot and Nichols chart agree with NumPy: points, bounds, contours, margins, zoom, address."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from playwright.sync_api import Browser

from livebode.configuration import LoopSection
from livebode.dashboard import Dashboard, ServerSettings
from livebode.records import RunRecord
from tests.support.browser import Tab
from tests.support.dashboards import LINES, LOOP, RATE_HZ, Watched

# Curves travel as float32.
CLOSE = {"atol": 2e-5, "rtol": 2e-5}
F = LINES.frequency_hz


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("nyquist") / "run"
    with Watched(directory) as watched:
        watched.go(4000)
    return directory


@pytest.fixture(scope="module")
def tab(browser: Browser, run: Path) -> Iterator[Tab]:
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(run)
    with dashboard, Tab(browser, dashboard.url + "#quantity=open+loop") as found:
        found.until("bode.drawn.model && bode.known.margins().length")
        yield found
        assert found.wrong == []


@pytest.fixture(autouse=True)
def whole(tab: Tab) -> None:
    tab.js("bode.reset()")


def show(tab: Tab, kind: str) -> None:
    tab.page.locator(f'#bode-kind [data-value="{kind}"]').click()
    tab.until(f"bode.plane?.kind === '{kind}' && bode.plane.traced.length === 2")


def loop(run: Path) -> tuple[np.ndarray, np.ndarray]:
    """The newest open loop at the lines and its bound: the plant times the controller of the configuration."""
    responses = RunRecord.open(run).responses()
    newest = responses[int(np.flatnonzero(responses.valid.any(axis=1))[-1])]
    feedback = LoopSection.model_validate(LOOP).build(RATE_HZ).feedback_at(F)
    return newest.value * feedback, newest.bound() * np.abs(feedback)


def traced(tab: Tab, name: str, key: str) -> np.ndarray:
    return tab.numbers(f"bode.plane.traced.find((t) => t.name === '{name}').{key}")


def scales(tab: Tab) -> list[float]:
    return tab.js("((s) => [s.x.min, s.x.max, s.y.min, s.y.max])(bode.charts[0].scales)")  # type: ignore[no-any-return]


def test_points_radii_and_outlines_are_those_of_the_loop(tab: Tab, run: Path) -> None:
    value, bound = loop(run)
    show(tab, "nyquist")
    assert np.allclose(traced(tab, "measured", "x") + 1j * traced(tab, "measured", "y"), value, **CLOSE)
    radius = tab.numbers("bode.plane.traced.find((t) => t.name === 'measured').curve.reach") * np.abs(value)
    assert np.allclose(radius, bound, **CLOSE)
    show(tab, "nichols")
    assert np.allclose(traced(tab, "measured", "y"), 20 * np.log10(np.abs(value)), atol=2e-4)
    angle = traced(tab, "measured", "x") - np.degrees(np.angle(value))
    assert np.allclose(angle - 360 * np.round(angle / 360), 0, atol=2e-3)
    # The edge of a bound in the Nichols chart is the circle of the Nyquist plot, closed or around zero.
    for reach in (0.3, 2.0):
        edge = np.array(
            tab.page.evaluate(f"async () => (await import('/static/contours.js')).nicholsBound(-100, -6, {reach}, 48)")
        )
        around = 10 ** (edge[:, 1] / 20) * np.exp(1j * np.radians(edge[:, 0]))
        centre = 10 ** (-6 / 20) * np.exp(1j * np.radians(-100))
        assert np.allclose(np.abs(around - centre), reach * abs(centre), atol=1e-9)
        assert np.isclose(abs(edge[0, 0] - edge[-1, 0]), 0 if reach < 1 else 360)


def test_contours_have_one_magnitude_of_the_closed_loop(tab: Tab) -> None:
    found = tab.page.evaluate(
        """async () => {
          const { circleS, circleT, nicholsT } = await import("/static/contours.js");
          const { LEVELS_DB, PEAKS } = await import("/static/planemarks.js");
          return {
            s: PEAKS.map((m) => [m, circleS(m)]), t: [...PEAKS, 0.5].map((m) => [m, circleT(m)]),
            nichols: LEVELS_DB.map((db) => [db, nicholsT(10 ** (db / 20), 360)]),
          };
        }"""
    )
    turn = np.exp(2j * np.pi * np.arange(64) / 64)
    for key, closed in (("s", lambda one: 1 / (1 + one)), ("t", lambda one: one / (1 + one))):
        for m, circle in found[key]:
            points = circle["re"] + 1j * circle["im"] + circle["radius"] * turn
            assert np.allclose(np.abs(closed(points)), m, rtol=1e-6), (key, m)
    assert [m for m, _ in found["s"]] == [1.4, 2]
    for db, points in found["nichols"]:
        deg, level = np.array(points).T
        value = 10 ** (level / 20) * np.exp(1j * np.radians(deg))
        assert np.allclose(np.abs(value / (1 + value)), 10 ** (db / 20), rtol=1e-6), db
        assert np.all((deg <= 0) & (deg >= -360))


def test_margins_are_marked_where_the_fitted_loop_crosses(tab: Tab, run: Path) -> None:
    rows = [row for table in map(pa.table, RunRecord.open(run).tables("parameters")) for row in table.to_pylist()]
    last = {r["name"]: r["value"] for r in rows if r["model"] == "margins"}
    show(tab, "nyquist")
    places = tab.page.evaluate(
        """async () => {
          const { crossing } = await import("/static/planemarks.js");
          return livebode.bode.known.margins().map((mark) => [mark.name, ...crossing(mark)]);
        }"""
    )
    found = {name: complex(re, im) for name, re, im in places}
    assert found["gain_margin"] == pytest.approx(-(10 ** (-last["gain_margin"] / 20)), rel=1e-6)
    assert found["phase_margin"] == pytest.approx(-np.exp(1j * np.radians(last["phase_margin"])), rel=1e-6)
    late = 2 * np.pi * last["delay_margin_frequency"] * last["delay_margin"] / 1000
    assert found["delay_margin"] == pytest.approx(-np.exp(1j * late), rel=1e-6)


def test_one_unit_has_one_length_at_every_size_and_zoom(tab: Tab) -> None:
    show(tab, "nyquist")
    unit = "((u) => ['x', 'y'].map((k) => Math.abs(u.valToPos(1, k) - u.valToPos(0, k))))(bode.charts[0])"
    for size in ((1440, 900), (390, 844)):
        tab.page.set_viewport_size({"width": size[0], "height": size[1]})
        tab.until("Math.abs(bode.charts[0].width - bode.plane.host.clientWidth) < 1")
        x, y = tab.js(unit)
        assert x == pytest.approx(y, rel=0.01), size
    tab.page.set_viewport_size({"width": 1440, "height": 900})
    tab.until("Math.abs(bode.charts[0].width - bode.plane.host.clientWidth) < 1")
    box = tab.page.locator("#plane .u-over").bounding_box()
    assert box
    before = scales(tab)
    tab.page.mouse.move(box["x"] + box["width"] / 3, box["y"] + box["height"] / 2)
    tab.page.mouse.wheel(0, -400)
    tab.until("bode.plane.sight")
    x0, x1, y0, y1 = scales(tab)
    assert (x1 - x0) / (before[1] - before[0]) == pytest.approx((y1 - y0) / (before[3] - before[2]), rel=1e-6)
    assert x1 - x0 < before[1] - before[0]
    x, y = tab.js(unit)
    assert x == pytest.approx(y, rel=0.01)
    tab.page.keyboard.press("0")
    tab.until("!bode.plane.sight")


def test_pointer_and_keys_move_the_common_cursor(tab: Tab) -> None:
    show(tab, "nyquist")
    over = tab.page.locator("#plane .u-over").bounding_box()
    assert over
    at = tab.js("((u, t) => [u.valToPos(t.x[4], 'x'), u.valToPos(t.y[4], 'y')])(bode.charts[0], bode.plane.own())")
    tab.page.mouse.move(over["x"] + at[0], over["y"] + at[1])
    tab.until("bode.line === 4")
    tab.page.locator("#readout th", has_text=f"{F[4]:g} Hz").wait_for()
    tab.page.locator("#readout").focus()
    tab.page.keyboard.press("ArrowRight")
    tab.page.locator('#bode-kind [data-value="bode"]').click()
    assert tab.js("[bode.line, bode.charts.length]") == [5, 3]


def test_the_legend_hides_curves_and_other_quantities_have_no_contours(tab: Tab) -> None:
    show(tab, "nichols")
    tab.page.locator("#legend [data-name=model]").click()
    tab.until("bode.plane.traced.length === 1")
    tab.page.locator("#legend [data-name=model]").click()
    tab.until("bode.plane.traced.length === 2")
    assert tab.js("bode.plane.loop") is True
    tab.page.locator('#quantities [data-value="plant"]').click()
    tab.until("bode.curves.measured?.frame.quantity === 'plant' && bode.drawn.measured")
    assert tab.js("bode.plane.loop") is False
    tab.page.locator("#near").click()
    tab.page.locator("#notice", has_text="open loop").wait_for()
    tab.page.locator('#quantities [data-value="open loop"]').click()
    tab.until("bode.curves.measured?.frame.quantity === 'open loop' && bode.drawn.measured && bode.plane.loop")


def test_a_picture_and_the_print_show_the_chosen_plot(tab: Tab) -> None:
    show(tab, "nyquist")
    # The unit circle and the points leave ink in a picture of another size; the chart on the page is as before.
    before = scales(tab)
    with tab.page.expect_download() as download:
        tab.page.keyboard.press("d")
        tab.page.locator("#download-menu [role=menuitem]").first.click()
        tab.page.locator("#export-form [type=submit]").click()
    assert download.value.suggested_filename.endswith(".png")
    assert scales(tab) == pytest.approx(before)
    tab.page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert tab.page.locator("#sheet canvas").count() == 3
    tab.page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert scales(tab) == pytest.approx(before)


def test_a_reload_keeps_the_plot_and_its_neighbourhood_of_minus_one(tab: Tab) -> None:
    tab.page.locator('#bode-kind [data-value="bode"]').click()
    tab.page.keyboard.press("v")
    tab.until("bode.plane?.kind === 'nyquist'")
    tab.page.locator("#near").click()
    tab.until("location.hash.includes('nyquist-box')")
    assert tab.js("bode.plane.sight") == [[-2.5, 0.5], [-1.5, 1.5]]
    tab.reload()
    tab.until("window.livebode?.bode.plane?.traced.length === 2")
    assert tab.js("bode.plane.kind") == "nyquist"
    assert tab.js("bode.plane.sight") == [[-2.5, 0.5], [-1.5, 1.5]]
    x0, x1, y0, y1 = scales(tab)
    assert x0 <= -2.5 < 0.5 <= x1
    assert y0 <= -1.5 < 1.5 <= y1
    assert tab.page.locator("#bode-title").inner_text() == "Nyquist plot"


def test_the_model_between_its_points_is_the_model(tab: Tab) -> None:
    """A resonance with 1.8 % damping: the curve between the points of the page's grid differs by less than 0.01 %."""
    lines = np.arange(4.0, 200.0, 3.0)
    hz = np.union1d(np.geomspace(lines[0], lines[-1], 240), lines)

    def plant(f: np.ndarray) -> np.ndarray:
        s = 2j * np.pi * f
        two = 180.0 + 0.014 * s
        return np.asarray((0.0025 * s**2 + two) / (s * (0.0012 * 0.0025 * s**2 + (0.0012 + 0.0025) * two)))

    value = plant(hz)
    db, deg = 20 * np.log10(np.abs(value)), np.degrees(np.unwrap(np.angle(value)))
    arguments = [hz.tolist(), db.tolist(), deg.tolist()]
    for quick in (True, False):
        x, y = np.array(
            tab.page.evaluate(
                "async ([hz, db, deg, round]) => { const { smooth } = await import('/static/smooth.js');"
                " const { x, y } = smooth(hz, db, deg, round); return [x, y]; }",
                [*arguments, quick],
            )
        )
        found = x + 1j * y if quick else 10 ** (y / 20) * np.exp(1j * np.radians(x))
        dense = np.interp(np.arange(len(found)) / 8, np.arange(len(hz)), np.log(hz))
        truth = plant(np.exp(dense))
        assert np.max(np.abs(found - truth) / np.abs(truth)) < 1e-4
        assert np.allclose(found[::8], value)


def test_measured_points_are_joined_only_where_there_is_no_model(tab: Tab) -> None:
    show(tab, "nyquist")
    paths = "Object.fromEntries(bode.plane.traced.map((t) => [t.name, t.path && t.path.x.length]))"
    found = tab.js(paths)
    assert found["measured"] is None
    assert found["model"] == 8 * (len(tab.numbers("bode.grid")) - 1) + 1
    tab.page.locator("#legend [data-name=model]").click()
    tab.until("bode.plane.traced.every((t) => t.name !== 'model')")
    assert tab.js(paths)["measured"] == len(LINES)
    tab.page.locator("#legend [data-name=model]").click()
    tab.until("bode.plane.traced.some((t) => t.name === 'model')")
