"""The Bode plot's options, cursors, margins and computed curves agree with NumPy and with the fitted model."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from playwright.sync_api import Browser

from livebode.configuration import LoopSection
from livebode.core import CIRCLE_FACTOR
from livebode.dashboard import Dashboard, ServerSettings, grid_hz
from livebode.fitting import EvaluationGrid, model_named
from livebode.records import RunRecord, read_saved
from tests.support.browser import Tab
from tests.support.dashboards import FIT, LINES, LOOP, RATE_HZ, Watched

# Curves travel as float32.
CLOSE = {"atol": 5e-5, "rtol": 3e-6}
F = LINES.frequency_hz


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("bode") / "run"
    with Watched(directory) as watched:
        watched.go(4000)
    return directory


@pytest.fixture(scope="module")
def served(run: Path) -> Iterator[Dashboard]:
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(run)
    with dashboard:
        yield dashboard


@pytest.fixture(scope="module")
def tab(browser: Browser, served: Dashboard) -> Iterator[Tab]:
    with Tab(browser, served.url) as found:
        found.until("bode.curves.model")
        yield found
        assert found.wrong == []


@pytest.fixture(autouse=True)
def plain_view(tab: Tab) -> None:
    """The plant without options, zoom and cursors."""
    options = {"frequency": "log", "unit": "hz", "magnitude": "db", "phase": "unwrapped", "power": "0"}
    for option, value in options.items():
        tab.js(f"bode.view.choose('{option}', '{value}')")
    tab.js("(bode.view.removeDelay(0), bode.compute(null), bode.unplace(), bode.reset())")
    show(tab, "plant")
    tab.settle()


def show(tab: Tab, quantity: str) -> None:
    tab.page.locator(f'#quantities [data-value="{quantity}"]').click()
    tab.until(
        f"bode.curves.measured?.frame.quantity === '{quantity}' && bode.curves.model?.frame.quantity === '{quantity}'"
    )
    tab.until("bode.drawn.measured && bode.drawn.model")


def newest(run: Path) -> Any:
    responses = RunRecord.open(run).responses()
    return responses[int(np.flatnonzero(responses.valid.any(axis=1))[-1])]


def drawn(tab: Tab, index: int, curve: str, part: int = 0) -> np.ndarray:
    """What a chart has at the lines: 0 the value, 1 and 2 the edges of the band."""
    series = f"bode.charts[{index}].data[bode.seriesOf({index}, '{curve}') + {part}]"
    return tab.numbers(f"bode.at.map((i) => {series}[i])")


def choose(tab: Tab, option: str, value: str) -> None:
    tab.page.locator("#bode-view").click()
    field = tab.page.locator(f"#bode-view-panel [data-option={option}]")
    if option == "delay":
        field.fill(value)
        field.press("Tab")
    else:
        field.select_option(value)
    tab.page.keyboard.press("Escape")


def same_turn(found: np.ndarray, truth: np.ndarray) -> np.ndarray:
    return found - 360 * np.round((found - truth) / 360)


@pytest.mark.parametrize("power", [-2, 1])
def test_derivatives_and_integrals_have_value_bounds_and_unit(tab: Tab, run: Path, power: int) -> None:
    choose(tab, "power", str(power))
    one = newest(run)
    factor = (2j * np.pi * F) ** power
    value, radius = one.value * factor, one.bound() * np.abs(factor)
    assert np.allclose(drawn(tab, 0, "measured"), 20 * np.log10(np.abs(value)), **CLOSE)
    assert np.allclose(drawn(tab, 0, "measured", 1), 20 * np.log10(np.abs(value) + radius), **CLOSE)
    truth = np.degrees(np.angle(value))
    assert np.allclose(same_turn(drawn(tab, 1, "measured"), truth), truth, **CLOSE)
    label = tab.js("bode.charts[0].axes[1].label(bode.charts[0])")
    unit = {-2: "rad s/(N m)", 1: "rad/s²/(N m)"}[power]
    assert label.endswith(f"dB re 1 {unit}"), label


def test_units_and_scales_of_the_axes(tab: Tab) -> None:
    before = drawn(tab, 0, "measured")
    choose(tab, "unit", "rad")
    choose(tab, "magnitude", "absolute")
    choose(tab, "frequency", "linear")
    assert np.array_equal(drawn(tab, 0, "measured"), before), "the data remain Hz and dB"
    for chart, axis, factor in ((2, 0, "f * 2 * Math.PI"), (0, 1, "10 ** (f / 20)")):
        texts = tab.js(f"bode.charts[{chart}].axes[{axis}]._values")
        places = tab.numbers(f"bode.charts[{chart}].axes[{axis}]._splits.map((f) => {factor})")
        shown = np.array([float(text.replace("−", "-")) for text in texts])
        assert len(shown) >= 3
        assert np.allclose(shown, places, rtol=2e-3)
    x = tab.numbers("[20, 80, 140].map((f) => bode.charts[0].valToPos(f, 'x'))")
    assert x[1] - x[0] == pytest.approx(x[2] - x[1])
    assert "rad/s" in tab.page.locator("#readout th").first.inner_text()


def test_wrapped_and_unwrapped_phase_and_a_removed_delay_are_those_of_numpy(tab: Tab, run: Path) -> None:
    one = newest(run)
    late = one.value * np.exp(2j * np.pi * F * -0.02)  # −72° from line to line, −1008° over the band
    for delay_ms, value in (("-20", late), ("0", one.value)):
        choose(tab, "delay", delay_ms)
        angle = np.unwrap(np.angle(value))
        found = drawn(tab, 1, "measured")
        assert np.allclose(np.diff(found), np.diff(np.degrees(angle)), atol=1e-3)
        choose(tab, "phase", "wrapped")
        assert np.allclose(drawn(tab, 1, "measured"), np.degrees(np.angle(value)), atol=1e-3)
        choose(tab, "phase", "unwrapped")


def test_margins_are_marked_where_the_model_crosses(tab: Tab, run: Path) -> None:
    """Delay margin: where |L| = 1, the least of phase above −180° over frequency; within the band only this one is."""
    show(tab, "open loop")
    rows = [row for table in map(pa.table, RunRecord.open(run).tables("parameters")) for row in table.to_pylist()]
    at_s = max(r["time_s"] for r in rows if r["model"] == "margins")
    fitted = {r["name"]: r["value"] for r in rows if r["model"] == "two-mass" and r["time_s"] == at_s}
    model = model_named("two-mass", output="velocity", radius_m=FIT["radius_m"])
    f = np.geomspace(40, 140, 200_001)
    loop = LoopSection.model_validate(LOOP).build(RATE_HZ).feedback_at(f)
    value = loop * model.at([fitted[name] for name in model.names], EvaluationGrid(f, RATE_HZ))
    crossings = np.flatnonzero(np.diff(np.sign(np.abs(value) - 1)))
    assert crossings.size == 2
    late_ms = 1000 * ((np.angle(value[crossings]) + np.pi) % (2 * np.pi)) / (2 * np.pi * f[crossings])
    marks = {mark["name"]: mark for mark in tab.js("bode.known.margins()")}
    least = int(np.argmin(late_ms))
    assert marks["delay_margin"]["hz"] == pytest.approx(f[crossings[least]], rel=1e-4)
    assert marks["delay_margin"]["value"] == pytest.approx(late_ms[least], rel=1e-3)
    assert marks["delay_margin"]["level"] == pytest.approx(np.degrees(np.angle(value[crossings[least]])) + 180, abs=0.1)
    low, high = tab.js("[bode.charts[1].scales.y.min, bode.charts[1].scales.y.max]")
    assert low < -180 < high, "the line that the margin is measured from is visible"
    assert marks.keys() >= {"gain_margin", "phase_margin"}  # beyond the band, at its edge


def test_margins_within_the_band_are_marked_on_magnitude_and_phase(tab: Tab) -> None:
    marks = tab.page.evaluate(
        """async () => {
          const { marginMarks } = await import("/static/fitted.js");
          const one = (name, unit, v, s) => [name, { name, unit, shown: { t: 1, v, s, status: "ok" } }];
          return marginMarks(new Map([one("gain_margin", "dB", 8, 0.5), one("gain_margin_frequency", "Hz", 90, 1),
            one("phase_margin", "deg", 45, 2), one("phase_margin_frequency", "Hz", 30, 1),
            one("delay_margin", "ms", 45 / 360 / 30 * 1000, 0.1), one("delay_margin_frequency", "Hz", 30, 1)]));
        }"""
    )
    gain, phase = marks
    assert (gain["chart"], gain["hz"], gain["level"]) == (0, 90, -8)
    assert gain["words"] == "gain margin 8.00 ± 0.98 dB"
    assert (phase["chart"], phase["hz"], phase["level"]) == (1, 30, 45)
    assert phase["words"] == "phase margin 45.0 ± 3.9°, delay margin 4.17 ± 0.20 ms"


@pytest.mark.parametrize("half", [5e-5, 0.0021, 0.04, 0.7, 9.0])
def test_a_bound_of_any_size_is_shown_with_two_digits_and_never_as_zero(tab: Tab, half: float) -> None:
    decibels, absolute, degrees, none = tab.page.evaluate(
        """async (half) => {
          const { angle, bounds, halfAngle } = await import("/static/values.js");
          const both = [false, true].map((absolute) => bounds(20 - half, 20, 20 + half, { absolute }));
          return [...both, halfAngle(half), angle(-1e-6)];
        }""",
        half,
    )
    low, high = (float(text.split()[0].lstrip("+−")) for text in decibels.split(" … "))
    assert [low, high] == pytest.approx([half, half], rel=0.05)
    low, high = (float(text) for text in absolute.split(" … "))
    assert high - low == pytest.approx(10 ** (1 + half / 20) - 10 ** (1 - half / 20), rel=0.2)
    assert float(degrees.strip("± °")) == pytest.approx(half, rel=0.05)
    assert none == "+0.0°"


def test_cursors_show_differences(tab: Tab, run: Path) -> None:
    one = newest(run)
    over = tab.page.locator("#magnitude .u-over")
    box = over.bounding_box()
    assert box
    for hz, keys in ((50, []), (90, ["Shift"])):
        x = tab.js(f"bode.charts[0].valToPos({hz}, 'x')")
        over.click(position={"x": x, "y": box["height"] / 2}, modifiers=keys)  # type: ignore[arg-type]
    tab.page.locator("#readout table.cursors").wait_for()
    row = tab.page.locator("#readout [data-difference=measured] td").all_inner_texts()
    db, ratio, deg = (float(text.strip("×°").replace("dB", "").replace("−", "-")) for text in row)
    a, b = one.value[np.searchsorted(F, 50)], one.value[np.searchsorted(F, 90)]
    assert db == pytest.approx(20 * np.log10(abs(b / a)), abs=0.01)
    assert ratio == pytest.approx(abs(b / a), rel=1e-3)
    assert (deg - np.degrees(np.angle(b / a))) % 360 == pytest.approx(0, abs=0.1) or deg == pytest.approx(
        np.degrees(np.angle(b / a)), abs=0.1
    )
    assert "50 Hz to 90 Hz, +40 Hz, ratio 1.8" in tab.page.locator("#readout table.cursors caption").inner_text()
    tab.page.keyboard.press("c")
    tab.page.locator("#readout table.cursors").wait_for(state="detached")


def test_peaks_of_a_known_two_mass_response(tab: Tab) -> None:
    """s-domain, light damping: frequencies and half-power damping of both pairs are those of the polynomials."""
    f = np.geomspace(10, 200, 1200)
    pairs = {True: (66.0, 0.02), False: (45.0, 0.015)}
    s, (wr, zr), (wa, za) = 2j * np.pi * f, *[(2 * np.pi * hz, zeta) for hz, zeta in pairs.values()]
    db = 20 * np.log10(np.abs((s**2 + 2 * za * wa * s + wa**2) / (s**2 + 2 * zr * wr * s + wr**2) / s))
    found = tab.page.evaluate(
        """async ([hz, db]) => {
          const { extrema } = await import("/static/extrema.js");
          return [true, false].map((peak) => extrema(hz, db, hz.map(() => NaN), peak));
        }""",
        [f.tolist(), db.tolist()],
    )
    for peak, (one,) in zip((True, False), found):
        hz, zeta = pairs[peak]
        assert one["hz"] == pytest.approx(hz, rel=2e-3)
        assert one["damping"] == pytest.approx(zeta, rel=0.05)
    noise = 0.3 * np.random.default_rng(1).standard_normal(f.size)
    reach = np.full(f.size, 0.2)
    counts = tab.page.evaluate(
        """async ([hz, db, reach]) => {
          const { extrema } = await import("/static/extrema.js");
          return extrema(hz, db, reach, true).length;
        }""",
        [f.tolist(), noise.tolist(), reach.tolist()],
    )
    assert counts == 0, "noise within its bound has no peaks"


def test_the_search_finds_the_resonance_of_the_fit(tab: Tab, run: Path) -> None:
    rows = [row for table in map(pa.table, RunRecord.open(run).tables("parameters")) for row in table.to_pylist()]
    last = {r["name"]: r["value"] for r in rows if r["model"] == "two-mass"}
    tab.js("bode.go(20)")
    tab.page.keyboard.press("n")
    first = tab.js("bode.extremum")
    tab.page.keyboard.press("n")
    second = tab.js("bode.extremum")
    assert (first["peak"], second["peak"], first["of"]) == (False, True, "model")
    assert first["hz"] == pytest.approx(last["antiresonance"], rel=0.02)
    assert second["hz"] == pytest.approx(last["resonance"], rel=0.02)
    text = tab.page.locator("#readout .extremum", has_text=f"fit: {last['resonance']:.4g}")
    text.wait_for()
    assert "half power" in text.inner_text()
    tab.page.keyboard.press("b")
    assert tab.js("bode.extremum.peak") is False


def test_wheel_drag_and_keys_zoom_both_axes(tab: Tab) -> None:
    box = tab.page.locator("#magnitude .u-over").bounding_box()
    assert box
    ranges = "((s) => [s.x.min, s.x.max, s.y.min, s.y.max])(bode.charts[0].scales)"
    before = tab.js(ranges)
    # A wheel's place is in whole pixels of the page.
    x, y = math.ceil(box["x"] + 200), math.ceil(box["y"] + 50)
    there = f"[bode.charts[0].posToVal({x - box['x']}, 'x'), bode.charts[0].posToVal({y - box['y']}, 'y')]"
    at = tab.js(there)
    tab.page.mouse.move(x, y)
    tab.page.mouse.wheel(0, -300)
    tab.until("bode.sight !== bode.whole")
    assert tab.js(there) == pytest.approx(at, rel=2e-3)
    near = tab.js(ranges)
    assert near[1] / near[0] < before[1] / before[0]
    assert near[3] - near[2] < before[3] - before[2]
    tab.page.mouse.move(box["x"] - 20, box["y"] + 50)  # the axis of the magnitude
    tab.page.mouse.wheel(0, -200)
    tab.until(f"bode.charts[0].scales.y.max - bode.charts[0].scales.y.min < {near[3] - near[2] - 0.1}")
    assert tab.js(ranges)[:2] == near[:2]
    near = tab.js(ranges)
    tab.page.keyboard.down("Shift")
    tab.page.mouse.move(box["x"] + 200, box["y"] + 50)
    tab.page.mouse.down()
    tab.page.mouse.move(box["x"] + 220, box["y"] + 70, steps=4)
    tab.page.mouse.up()
    tab.page.keyboard.up("Shift")
    now = tab.js(ranges)
    assert now[3] - now[2] == pytest.approx(near[3] - near[2])
    assert now[2] > near[2], "the curve moved down with the mouse"
    assert tab.js("bode.cursors.hz") == [None, None], "a drag places no cursor"
    tab.page.mouse.dblclick(box["x"] + 300, box["y"] + 60)
    assert tab.js(ranges) == pytest.approx(before)
    assert tab.js("bode.cursors.hz") == [None, None], "a double click places no cursor"
    corners = [(0.3, 0.2), (0.6, 0.7)]
    expected = [
        [
            tab.js(f"bode.charts[0].posToVal({x * box['width']}, 'x')"),
            tab.js(f"bode.charts[0].posToVal({y * box['height']}, 'y')"),
        ]
        for x, y in corners
    ]
    (x0, y0), (x1, y1) = corners
    tab.page.mouse.move(box["x"] + x0 * box["width"], box["y"] + y0 * box["height"])
    tab.page.mouse.down()
    tab.page.mouse.move(box["x"] + x1 * box["width"], box["y"] + y1 * box["height"], steps=4)
    tab.page.mouse.up()
    assert tab.js(ranges) == pytest.approx([expected[0][0], expected[1][0], expected[1][1], expected[0][1]], rel=0.02)
    tab.page.keyboard.press("0")
    assert tab.js(ranges) == pytest.approx(before)
    tab.page.keyboard.press("+")
    assert tab.js("bode.sight !== bode.whole")


def test_zoom_options_and_cursors_survive_a_reload(tab: Tab) -> None:
    show(tab, "open loop")
    choose(tab, "power", "1")
    choose(tab, "unit", "rad")
    tab.js("(bode.go(70), bode.place(false), bode.go(100), bode.place(true))")
    tab.js("(bode.zooming.along(1, [-120, 30]), bode.zoom([40, 110]))")
    before = tab.js("[bode.sight, bode.zooming.heights, bode.cursors.hz, bode.view.options, page.quantity]")
    tab.reload()
    tab.until("window.livebode?.bode.drawn.measured && bode.curves.measured.frame.quantity === 'open loop'")
    after = tab.js("[bode.sight, bode.zooming.heights, bode.cursors.hz, bode.view.options, page.quantity]")
    assert json.loads(json.dumps(after)) == before
    assert tab.js("bode.charts[1].scales.y.min") == -120
    tab.until("bode.curves.model")


def test_a_ratio_and_a_difference_have_first_order_bounds(tab: Tab) -> None:
    rng = np.random.default_rng(5)
    a, b = (rng.standard_normal(9) + 1j * rng.standard_normal(9) for _ in range(2))
    sigma = rng.uniform(0.005, 0.02, (2, 9))
    curve = [
        {
            "db": (20 * np.log10(np.abs(x))).tolist(),
            "deg": np.degrees(np.angle(x)).tolist(),
            "reach": (CIRCLE_FACTOR * s / np.abs(x)).tolist(),
        }
        for x, s in ((a, sigma[0]), (b, sigma[1]))
    ]
    found = tab.page.evaluate(
        """async ([a, b]) => {
          const { ratio, difference } = await import("/static/arithmetic.js");
          return [ratio(a, b), difference(a, b)];
        }""",
        curve,
    )
    errors = (rng.standard_normal((2, 2, 40_000, 9)) / np.sqrt(2) * sigma[:, None, None]).transpose(1, 0, 2, 3)
    noise = errors[0] + 1j * errors[1]
    for one, truth, scattered in (
        (found[0], a / b, (a + noise[0]) / (b + noise[1])),
        (found[1], a - b, (a + noise[0]) - (b + noise[1])),
    ):
        assert np.allclose(one["db"], 20 * np.log10(np.abs(truth)), atol=1e-9)
        assert np.allclose(same_turn(np.array(one["deg"]), np.degrees(np.angle(truth))), np.degrees(np.angle(truth)))
        # 40,000 draws: sigma is known to 0.5 %; second order adds less than (0.02 / 0.1)².
        rms = np.sqrt(np.median(np.abs(scattered - truth) ** 2, axis=0) / np.log(2))
        assert np.allclose(np.array(one["reach"]) * np.abs(truth) / CIRCLE_FACTOR, rms, rtol=0.05)


def test_a_curve_computed_from_measured_and_model_is_drawn_with_its_band(tab: Tab, run: Path) -> None:
    tab.js("bode.compute({ kind: 'ratio', a: 'measured', b: 'model' })")
    tab.until("bode.drawn.result")
    one = newest(run)
    model = tab.numbers("bode.at.map((i) => bode.curves.model.db[i])")
    assert np.allclose(drawn(tab, 0, "result"), 20 * np.log10(np.abs(one.value)) - model, **CLOSE)
    assert np.allclose(
        drawn(tab, 0, "result", 1) - drawn(tab, 0, "result"),
        20 * np.log10(1 + one.bound() / np.abs(one.value)),
        **CLOSE,
    )
    assert tab.js("bode.charts[0].axes[1].label(bode.charts[0])") == "|A/B| in dB"


def test_references_have_names_and_survive_another_quantity_and_a_reload(tab: Tab, run: Path) -> None:
    responses = RunRecord.open(run).responses()
    for time_s in (0.3, 0.8):
        tab.js(f"timeline.go({time_s})")
        tab.until(f"!page.seeking && Math.abs(bode.curves.measured.frame.timeS[0] - {time_s}) < 0.02")
        tab.page.keyboard.press("f")
    tab.until("bode.curves['reference 2']")
    times = tab.js("['reference', 'reference 2'].map((name) => bode.curves[name].frame.timeS[0])")
    tab.page.locator("#bode-curves").click()
    name = tab.page.locator("#bode-curves-panel [data-reference='reference 2'] input")
    name.fill("with <b>load</b>")
    name.press("Tab")
    tab.page.keyboard.press("Escape")
    tab.page.locator("#legend button", has_text="with <b>load</b>").wait_for()
    show(tab, "open loop")
    tab.reload()
    tab.until("window.livebode?.bode.drawn['reference 2']?.db && bode.drawn.measured && bode.drawn.model")
    assert tab.page.locator("#legend [data-name='reference 2']").inner_text() == "with <b>load</b>"
    feedback = LoopSection.model_validate(LOOP).build(RATE_HZ).feedback_at(F)
    values = [feedback * responses[int(np.argmin(np.abs(responses.time_s - t)))].value for t in times]
    for curve, value in zip(("reference", "reference 2"), values):
        assert np.allclose(drawn(tab, 0, curve), 20 * np.log10(np.abs(value)), **CLOSE)
    looks = tab.page.evaluate(
        """async () => {
          const { look } = await import("/static/looks.js"), { REFERENCES } = await import("/static/frames.js");
          return REFERENCES.map((name) => [look(name).ink, look(name).dash.join(), look(name).marker]);
        }"""
    )
    assert all(len(set(column)) == 8 for column in list(zip(*looks))[:2]), "a colour and a dash for each"
    tab.page.locator("#bode-curves").click()
    tab.page.locator("#bode-curves-panel [data-option=operation]").select_option("ratio")
    tab.page.get_by_label("A", exact=True).select_option("reference 2")
    tab.page.get_by_label("B", exact=True).select_option("reference")
    tab.until("bode.drawn.result && bode.operation.a === 'reference 2' && bode.operation.b === 'reference'")
    ratio = values[1] / values[0]
    assert np.allclose(drawn(tab, 0, "result"), 20 * np.log10(np.abs(ratio)), atol=2e-4)
    assert tab.page.locator("#legend [data-name=result]").is_visible()
    tab.page.keyboard.press("Escape")
    tab.page.keyboard.press("u")
    tab.page.keyboard.press("u")
    tab.until("!bode.curves.reference && !bode.operation")
    tab.js("timeline.newest()")  # the moment is in the address too
    tab.until("timeline.atS === null && bode.drawn.measured")


def test_what_is_saved_with_the_run_is_loaded_by_another_page(tab: Tab, browser: Browser, run: Path) -> None:
    responses = RunRecord.open(run).responses()
    tab.page.keyboard.press("f")
    tab.until("bode.curves.reference")
    time_s = tab.js("bode.curves.reference.frame.timeS[0]")
    tab.page.locator("#bode-curves").click()
    panel = tab.page.locator("#bode-curves-panel")
    panel.locator("[data-reference=reference] input").fill("as delivered")
    panel.locator("[data-reference=reference] input").press("Tab")
    panel.get_by_role("button", name="save this reference with the run").click()
    panel.locator("[data-saved]").wait_for()
    tab.js("bode.go(60)")
    panel.get_by_label("text of the annotation").fill("belt <b>mode</b>")
    panel.get_by_label("text of the annotation").press("Enter")
    tab.until("bode.annotations.length === 1")
    tab.page.keyboard.press("Escape")
    tab.page.keyboard.press("u")
    (one,) = read_saved(run).references
    truth = responses[int(np.argmin(np.abs(responses.time_s - time_s)))]
    assert one.name == "as delivered"
    assert np.array_equal(one.response.value[0], truth.value)
    assert np.array_equal(one.response.sigma[0], truth.sigma)
    with Tab(browser, tab.url) as other:
        other.until("bode.annotations.length === 1 && bode.annotations[0].text === 'belt <b>mode</b>'")
        other.page.locator("#bode-curves").click()
        other.page.locator("#bode-curves-panel [data-saved] button", has_text="Show").click()
        other.until("bode.curves.reference")
        assert np.allclose(other.numbers("bode.curves.reference.db"), 20 * np.log10(np.abs(truth.value)), **CLOSE)
        other.page.locator("#bode-curves-panel").get_by_label("delete this saved reference").click()
        other.until("saved.all.references.length === 0")
        assert other.wrong == []
    assert read_saved(run).references == ()
    assert read_saved(run).annotations[0].frequency_hz == 60


def test_the_grid_of_the_model_is_fine_enough_for_its_peak() -> None:
    """A quadratic through three points of the grid is used for peaks: neighbours are within 1 %."""
    assert np.max(np.diff(np.log(grid_hz(LINES)))) < 0.01


def test_a_value_has_the_digits_that_its_bound_leaves(tab: Tab) -> None:
    expected = {
        "32.6 ± 2.0": (32.551, 2.04),
        "0.002798 ± 0.000056": (0.002798, 5.6e-5),
        "378000 ± 14000": (378_300, 14_123),
        "(−1.100 ± 0.023)e−7": (-1.1e-7, 2.3e-9),
        "(3.200 ± 0.010)e9": (3.2e9, 1e7),
        "0.00 ± 0.50": (0, 0.5),
        "45": (45.0, 0),
        "46": (46.0, math.inf),
    }
    script = (
        "async (all) => { const { pair } = await import('/static/words.js'); return all.map((one) => pair(...one)); }"
    )
    assert tab.page.evaluate(script, list(expected.values())) == list(expected)


def test_the_scale_of_the_phase_does_not_follow_a_moment_of_noise(tab: Tab) -> None:
    script = """async () => {
      const { mostlyNoise, NoiseHold } = await import('/static/noise-hold.js');
      const hold = new NoiseHold(), of = (kind, reach) => mostlyNoise({ frame: { kind }, reach });
      const kinds = [of('newest', [0.6, 2, 0.1]), of('newest', [0.6, 0.2, 0.1]), of('moment', [0.6, 2, 0.1])];
      const first = hold.range(true, () => [0, 1]), held = hold.range(true, () => [-900, 900]);
      return [kinds, first, held, hold.range(false, () => [2, 3])];
    }"""
    kinds, *ranges = tab.page.evaluate(script)
    assert kinds == [True, False, False], "a moment that a person chose is shown whole"
    assert ranges == [[0, 1], [0, 1], [2, 3]]


_WORDS_ON_DATA = """() => {
  const { bode } = livebode, found = [];
  for (const u of bode.charts.slice(0, 2)) {
    const index = bode.charts.indexOf(u), boxes = [], { ctx } = u, fill = ctx.fillText, rect = ctx.fillRect;
    ctx.fillRect = function (x, y, w, h) { boxes.push([x, y, w, h]); return rect.call(this, x, y, w, h); };
    ctx.fillText = function (text, ...at) {
      const box = boxes.at(-1);
      if (/margin|gain may/.test(text) && box) found.push([text, index, ...box]);
      return fill.call(this, text, ...at);
    };
    u.redraw(false, false);
  }
  return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => {
    const hit = found.filter(([, index, x, y, w, h]) => {
      const u = bode.charts[index];
      return ["measured", "model"].some((name) => {
        const k = bode.seriesOf(index, name);
        return Array.from(u.data[0]).some((hz, i) => {
          const v = u.data[k][i];
          if (!Number.isFinite(v)) return false;
          const [a, b] = [u.valToPos(hz, "x", true), u.valToPos(v, "y", true)];
          return a > x && a < x + w && b > y && b < y + h;
        });
      });
    });
    done([found.map(([text]) => text), hit.map(([text]) => text)]);
  })));
}"""


def test_words_of_margins_are_never_on_the_curves(tab: Tab) -> None:
    show(tab, "open loop")
    tab.settle()
    drawn_words, on_data = tab.page.evaluate(_WORDS_ON_DATA)
    assert len(drawn_words) >= 2
    assert on_data == []
    below = tab.page.locator("#margin-words").inner_text()
    assert all(word in below for word in ("gain margin", "phase margin", "delay margin"))
    tab.page.set_viewport_size({"width": 390, "height": 844})
    try:
        tab.settle()
        assert tab.page.evaluate(_WORDS_ON_DATA)[0] == [], "on a phone they are below the plot only"
        assert tab.page.locator("#margin-words").is_visible()
    finally:
        tab.page.set_viewport_size({"width": 1440, "height": 900})
        tab.settle()


def test_on_a_phone_the_plot_is_first_and_its_tools_are_folded(browser: Browser, served: Dashboard) -> None:
    with Tab(browser, served.url, viewport={"width": 390, "height": 844}) as phone:
        phone.settle()
        page = phone.page
        top = page.locator("#magnitude").bounding_box()
        assert top
        assert top["y"] < 300, "above the middle of the first screen"
        for hidden, fold in (("#download", "Menu"), ("#bode-view", "Tools"), ("#what-if", "Tools")):
            assert page.locator(hidden).is_hidden()
            page.get_by_role("button", name=fold, exact=True).click()
            assert page.locator(hidden).is_visible()
            page.get_by_role("button", name=fold, exact=True).click()
            assert page.locator(hidden).is_hidden()
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
        assert phone.wrong == []
