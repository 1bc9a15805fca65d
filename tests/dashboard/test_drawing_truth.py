"""What the dashboard draws in a real browser is what the run recorded: curves, bands, models, maps, to the pixel."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from playwright.sync_api import Browser

from livebode.configuration import LoopSection
from livebode.core import CIRCLE_FACTOR, Response, widened
from livebode.dashboard import Dashboard, ServerSettings, grid_hz
from livebode.estimation import convert
from livebode.fitting import EvaluationGrid, model_named
from livebode.monitoring import BACK, FORTH
from livebode.records import RunRecord
from tests.support.baselines import compared
from tests.support.browser import Tab
from tests.support.dashboards import FIT, LINES, LOOP, RATE_HZ, Watched, whole_run

FEEDBACK = LoopSection.model_validate(LOOP).build(RATE_HZ).feedback_at(LINES.frequency_hz)
# Curves travel as float32: of 100 dB or 200 degrees the last digit is 2e-5.
CLOSE = {"atol": 3e-5, "rtol": 2e-6}

# Colours at the points, and three pixels inside and outside of the ends of their bars, where these are longer than
# their points.
PIXELS = """((u) => {
  const { width, height } = u.ctx.canvas, all = u.ctx.getImageData(0, 0, width, height).data;
  const px = (x, y) => Array.from(all.slice(4 * (Math.round(y) * width + Math.round(x))).slice(0, 4));
  const X = (i) => u.valToPos(bode.lines[i], "x", true);
  const first = bode.seriesOf(0, "measured");
  const Y = (series, i) => u.valToPos(u.data[first + series][bode.at[i]], "y", true);
  const points = [], ends = [];
  for (let i = 1; i < bode.lines.length; i++) {
    points.push(px(X(i), Y(0, i)));
    for (const [series, out] of [[1, -3], [2, 3]]) {
      const y = Y(series, i), { top, height: h } = u.bbox;
      if (Math.abs(y - Y(0, i)) > 7 && y > top + 4 && y < top + h - 4)
        ends.push([px(X(i), y - out), px(X(i), y + out)]);
    }
  }
  return [points, ends];
})(bode.charts[0])"""


@pytest.fixture(scope="module")
def watched(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Watched]:
    with Watched(tmp_path_factory.mktemp("drawn") / "run") as found:
        found.go(6000)
        yield found


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return whole_run(tmp_path_factory.mktemp("whole") / "run")


def expected(one: Response, quantity: str) -> dict[str, np.ndarray]:
    """Magnitude and phase with the edges of the 95 % bound, and coherence, as NumPy has them."""
    value, slope = convert(quantity, one.value, FEEDBACK)  # type: ignore[arg-type]
    size, reach = np.abs(value), one.bound() * np.abs(slope)
    with np.errstate(invalid="ignore", divide="ignore"):
        low = np.where(reach < size, 20 * np.log10(np.maximum(size - reach, 1e-300)), -1000.0)
        half = np.degrees(np.where(reach < size, np.arcsin(np.minimum(reach / size, 1)), np.pi))
    phase = np.degrees(np.angle(value))
    return {
        "db": 20 * np.log10(size), "dbLow": low, "dbHigh": 20 * np.log10(size + reach),
        "deg": phase, "degLow": phase - half, "degHigh": phase + half, "coherence": one.coherence,
    }  # fmt: skip


def drawn(tab: Tab, index: int, curve: str, part: int = 0) -> np.ndarray:
    """What a chart of the Bode plot has at the lines: 0 the value, 1 and 2 the edges of the band."""
    return tab.numbers(f"bode.at.map((i) => {series(index, curve, part)}[i])")


def series(index: int, curve: str, part: int = 0) -> str:
    """JavaScript for the data of a series."""
    return f"bode.charts[{index}].data[bode.seriesOf({index}, '{curve}') + {part}]"


def same_turn(found: np.ndarray, truth: np.ndarray) -> np.ndarray:
    return found - 360 * np.round((found - truth) / 360)


def in_record(run: RunRecord, time_s: float) -> Response:
    responses = run.responses()
    at = int(np.argmin(np.abs(responses.time_s - time_s)))
    assert abs(responses.time_s[at] - time_s) < 1e-9
    return responses[at]


@pytest.mark.parametrize("quantity", ["plant", "open loop", "closed loop", "sensitivity"])
def test_the_newest_response_with_its_bands(browser: Browser, watched: Watched, quantity: str) -> None:
    with Tab(browser, watched.url) as tab:
        tab.page.locator(f'#quantities [data-value="{quantity}"]').click()
        tab.until(f"page.quantity === '{quantity}' && bode.curves.measured?.frame.quantity === '{quantity}'")
        tab.until(f"{series(0, 'measured')}.some(Number.isFinite)")
        time_s = tab.js("bode.curves.measured.frame.timeS[0]")
        assert np.allclose(tab.numbers("bode.at.map((i) => bode.grid[i])"), LINES.frequency_hz)
        curves = {
            "db": drawn(tab, 0, "measured"), "dbHigh": drawn(tab, 0, "measured", 1),
            "dbLow": drawn(tab, 0, "measured", 2), "deg": drawn(tab, 1, "measured"),
            "degHigh": drawn(tab, 1, "measured", 1), "degLow": drawn(tab, 1, "measured", 2),
            "coherence": drawn(tab, 2, "measured"),
        }  # fmt: skip
        watched.go(watched.hub.samples + 2000)  # so that the record has it too
        for name, truth in expected(in_record(watched.record(), time_s), quantity).items():
            if name.startswith("deg"):
                curves[name] = same_turn(curves[name], truth)
            assert np.allclose(curves[name], truth, **CLOSE), name
        unit = "1 rad/s/(N m)" if quantity == "plant" else ""
        assert unit in tab.js("bode.charts[0].axes[1].label(bode.charts[0])")
        assert tab.wrong == []


def test_drawn_pixels_are_at_the_positions_of_the_numbers(browser: Browser, whole: Path) -> None:
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(whole)
    with dashboard, Tab(browser, dashboard.url) as tab:
        tab.page.locator('#quantities [data-value="sensitivity"]').focus()
        tab.page.locator("#legend [data-name=model]").click()
        tab.page.mouse.move(5, 5)
        tab.page.wait_for_timeout(200)
        measured, ends = tab.js(PIXELS)
        assert len(measured) == len(LINES) - 1
        for red, green, blue, alpha in measured:
            assert (red, green, blue, alpha) == (0x00, 0x72, 0xB2, 255)
        assert len(ends) >= 4  # of the other lines the bound is smaller than the point
        for inside, outside in ends:
            assert inside[3] > 0, inside
            assert inside[2] > inside[0] + 40, inside
            assert outside[3] == 0 or abs(outside[2] - outside[0]) < 20, outside
        assert tab.wrong == []


def test_model_and_margins_are_those_of_the_parameters(browser: Browser, whole: Path) -> None:
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(whole)
    with dashboard, Tab(browser, dashboard.url) as tab:
        rows = [row for table in map(pa.table, RunRecord.open(whole).tables("parameters")) for row in table.to_pylist()]
        tab.until("bode.curves.model")
        at_s = tab.js("bode.curves.model.frame.timeS[0]")
        fitted = {r["name"]: r["value"] for r in rows if r["model"] == "two-mass" and abs(r["time_s"] - at_s) < 1e-9}
        model = model_named("two-mass", output="velocity", radius_m=FIT["radius_m"])
        grid = grid_hz(LINES)
        truth = model.at([fitted[name] for name in model.names], EvaluationGrid(grid, RATE_HZ))
        assert np.allclose(tab.numbers("bode.grid"), grid)
        assert np.allclose(tab.numbers(series(0, "model")), 20 * np.log10(np.abs(truth)), **CLOSE)
        phase = tab.numbers(series(1, "model"))
        assert np.allclose(same_turn(phase, np.degrees(np.angle(truth))), np.degrees(np.angle(truth)), **CLOSE)

        tab.page.locator("#tab-margins").click()
        last = {r["name"]: r for r in rows if r["model"] == "margins"}
        for name in ("phase_margin", "delay_margin", "peak_sensitivity"):
            text = tab.page.locator(f"#pane-margins [data-name={name}] td").first.inner_text().replace("−", "-")
            bound = float(text.split("±")[1].split()[0].rstrip("°"))
            assert float(text.split()[0]) == pytest.approx(last[name]["value"], abs=0.051 * bound)  # its second digit
            assert bound == pytest.approx(1.96 * last[name]["sigma"], rel=0.06)
        assert last["phase_margin_frequency"]["value"] == pytest.approx(
            float(tab.page.locator("#pane-margins [data-name=phase_margin] td").nth(1).inner_text().split()[0]),
            rel=0.01,
        )
        assert "without a model" in tab.page.locator("#pane-margins [data-name=at_lines]").inner_text()

        tab.page.locator("#tab-parameters").click()
        tab.until("parameters.items.get('two-mass\\0Keff').made")
        known = [r for r in rows if r["name"] == "Keff"]
        assert np.allclose(tab.numbers("parameters.items.get('two-mass\\0Keff').t"), [r["time_s"] for r in known])
        drawn_data = [tab.numbers(f"parameters.items.get('two-mass\\0Keff').made.data[{i}]") for i in (1, 2, 3)]
        value, sigma = (np.array([r[name] for r in known], dtype=float) for name in ("value", "sigma"))
        for found, expected in zip(drawn_data, (value, value + 1.959964 * sigma, value - 1.959964 * sigma)):
            assert np.allclose(found, expected, equal_nan=True, rtol=1e-9)
        assert tab.wrong == []


def test_tracking_and_map_are_those_of_the_record(browser: Browser, whole: Path) -> None:
    responses = RunRecord.open(whole).responses()
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(whole)
    with dashboard, Tab(browser, dashboard.url) as tab:
        tab.page.locator("#tracking-span [data-value=whole]").click()
        tab.until("page.past && tracking.made.data[0].length > 100 && map.cells")
        x, first, high, low = (tab.numbers(f"tracking.made.data[{i}]") for i in range(4))
        line = tab.js("tracking.chosen[0]")
        at = np.abs(responses.time_s - x[:, np.newaxis]).argmin(axis=1)
        real = np.abs(responses.time_s[at] - x) < 1e-9  # besides them there are breaks
        complete = np.flatnonzero(responses.first >= 0)  # earlier windows begin before the recording
        assert real.sum() >= len(complete) - 1
        assert x[0] == pytest.approx(responses.time_s[complete[0]])
        size = np.where(responses.valid[at, line], np.abs(responses.value[at, line]), np.nan)
        reach = responses.bound()[at, line]
        with np.errstate(invalid="ignore", divide="ignore"):
            assert np.allclose(first[real], 20 * np.log10(size)[real], equal_nan=True, **CLOSE)
            assert np.allclose(high[real], 20 * np.log10(size + reach)[real], equal_nan=True, **CLOSE)
            narrow = real & (reach < 0.9 * size)
            assert np.allclose(low[narrow], 20 * np.log10(size - reach)[narrow], **CLOSE)
        assert np.isnan(first).any(), "responses that are not valid leave a gap"

        tab.page.locator('#tracking-over [data-value="position"]').click()
        tab.until("tracking.made.data[0].length > 100 && tracking.made.data[0][0] < 0.32")
        x = tab.numbers("tracking.made.data[0]")
        assert np.all(np.diff(x) >= 0)
        assert x[0] == pytest.approx(np.nanmin(responses.schedule), abs=1e-6)

        cells = tab.js("({ low: map.cells.low, step: map.cells.step, columns: map.cells.columns })")
        level = np.array(tab.js("map.cells.level.map((c) => c.map((v) => Number.isFinite(v) ? v : null))"), dtype=float)
        place = np.minimum((responses.schedule - cells["low"]) // cells["step"], cells["columns"] - 1)
        size = np.where(responses.valid, np.abs(responses.value), np.nan)
        for i in range(int(cells["columns"])):
            values = 20 * np.log10(size[place == i])
            for k in range(len(LINES)):
                known = values[np.isfinite(values[:, k]), k]
                if known.size:
                    newest = known[-max(1, known.size // 4) :]
                    assert level[i, k] == pytest.approx(newest.mean(), abs=1e-3)

        tab.page.locator("#map-what [data-value=change]").click()
        tab.page.locator("#map-over [data-value=time]").click()
        tab.until("map.cells.columns === 200")
        shown = tab.js("({ low: map.cells.low, step: map.cells.step, right: map.cells.of('change') })")
        found = np.array([[np.nan if v is None else v for v in c] for c in shown["right"]], dtype=float)
        placed = np.flatnonzero(responses.valid.all(axis=1) & np.isfinite(place))
        levels, place = 20 * np.log10(size[placed]), place[placed].astype(int)
        usual = np.array([np.median(levels[place == p], axis=0) for p in range(int(cells["columns"]))])
        column = np.minimum((responses.time_s[placed] - shown["low"]) / shown["step"], 199).astype(int)
        for i in np.unique(column):
            assert np.allclose(found[i], (levels - usual[place])[column == i].mean(axis=0), atol=1e-3)
        assert np.isnan(found).any(axis=1).sum() == np.isnan(found).all(axis=1).sum() > 0, (
            "invalid responses leave a gap"
        )
        assert tab.wrong == []


def test_the_baseline_is_drawn_where_the_machine_is(browser: Browser, whole: Path, tmp_path: Path) -> None:
    table = compared(whole, tmp_path / "run")
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(tmp_path / "run")
    with dashboard, Tab(browser, dashboard.url) as tab:
        for time_s, way in ((None, BACK), (2.1, FORTH)):  # x = 0.9 + 0.6·sin(2π·t/2 s)
            if time_s is not None:
                tab.js(f"timeline.go({time_s})")
                tab.until(f"Math.abs(bode.curves.measured.frame.timeS[0] - {time_s}) < 0.02 && bode.curves.baseline")
            tab.until(f"{series(0, 'baseline')}.some(Number.isFinite)")
            tab.page.wait_for_timeout(100)
            bin = int((tab.js("bode.curves.measured.frame.schedule[0]") - table.low) / table.step)
            sigma = np.sqrt(np.einsum("lii->l", table.covariance[bin, way]))
            spread = widened(sigma, float(table.count[bin, way]), CIRCLE_FACTOR)
            found = drawn(tab, 0, "baseline")
            assert np.allclose(found, 20 * np.log10(np.abs(table.mean[bin, way])), **CLOSE)
            assert np.allclose(drawn(tab, 0, "baseline", 1) - found, 20 * np.log10(1 + spread), **CLOSE)
        assert tab.page.locator("#legend [data-name=baseline]").is_visible()
        assert tab.wrong == []


def test_labels_of_neighbouring_ticks_do_not_overlap(browser: Browser, whole: Path) -> None:
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(whole)
    with dashboard:
        for size in ({"width": 1440, "height": 900}, {"width": 768, "height": 1024}):
            with Tab(browser, dashboard.url, viewport=size) as tab:
                at = tab.numbers("bode.charts[2].axes[0]._splits.map((f) => bode.charts[2].valToPos(f, 'x'))")
                words = tab.js("bode.charts[2].axes[0]._values")
                wide = [7.5 * len(word) for word in words]
                for (x, w), (x2, w2) in pairwise(zip(at, wide)):
                    assert x2 - x > (w + w2) / 2
