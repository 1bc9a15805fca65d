"""The sliders of "What if" agree with livebode.analysis, livebode_control.tuning and python-control."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator
from dataclasses import asdict, replace
from functools import reduce
from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest
from numpy.typing import ArrayLike
from playwright.sync_api import Browser, Route

from livebode.analysis import by_place, stable
from livebode.configuration import LoopSection, recorded_loop
from livebode.core import PID, Algebra, Cascade, Model, Responses
from livebode.dashboard import Dashboard, ServerSettings
from livebode.records import RunRecord
from livebode_control.tuning import LoopSpecification
from livebode_control.tuning.filters import Biquad, low_pass, notch
from livebode_control.tuning.plant_band import PlantBand
from livebode_control.tuning.predicted import predicted
from livebode_control.tuning.predicted_steps import predicted_steps
from tests.support.browser import Tab
from tests.support.dashboards import LINES, LOOP, RATE_HZ, Watched, whole_run
from tests.support.demonstrated import shown

F = LINES.frequency_hz
TRIAL = {"gain": 0.35, "integral_time_s": 0.11, "position_gain": 4.0}
NOTCHES = [(62.0, 12.0, 0.4), (118.0, 20.0, 0.2)]
LOW_PASS_HZ, DELAY_MS = 300.0, 0.5
ADDRESS = (
    "#quantity=open+loop&sliders=1&what-if="
    + "~~".join(f"{name}~{v}" for name, v in TRIAL.items())
    + "".join(f"~~notch~{f}~{depth}~{damping}" for f, depth, damping in NOTCHES)
    + f"~~low-pass~{LOW_PASS_HZ}~~delay~{DELAY_MS}"
)
NAMES = {
    "bandwidthHz": "bandwidth_hz", "gainMarginDb": "gain_margin_db", "phaseMarginDeg": "phase_margin_deg",
    "ms": "max_sensitivity", "disk": "disk_margin",
}  # fmt: skip


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("what-if") / "run"
    with Watched(directory) as watched:
        watched.go(8000)
    notches = [dict(zip(("frequency_hz", "depth_db", "damping"), one)) for one in NOTCHES]
    asked = {"specification": asdict(LoopSpecification()), "controller": asdict(tried_controllers())}
    proposal = asked | {"notches": notches, "low_passes_hz": [], "loop": None, "entry": None}
    (directory / "tune.json").write_text(json.dumps(proposal), encoding="utf-8")
    return directory


@pytest.fixture(scope="module")
def tab(browser: Browser, run: Path) -> Iterator[Tab]:
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(run)
    with dashboard, Tab(browser, dashboard.url + ADDRESS) as found:
        found.until("bode.drawn['what if'] && whatIf.margins.after")
        yield found
        assert found.wrong == []


def described() -> Cascade:
    feedback = LoopSection.model_validate(LOOP).build(RATE_HZ).feedback
    assert isinstance(feedback, Cascade)
    return feedback


def tried_controllers() -> Cascade:
    before = described()
    velocity = replace(before.velocity, gain=TRIAL["gain"], integral_time_s=TRIAL["integral_time_s"])
    assert isinstance(before.position, PID)
    return Cascade(velocity, replace(before.position, gain=TRIAL["position_gain"]))


def tried() -> Model:
    """The controllers and filters of `ADDRESS` in Python."""
    filters = [notch(f, depth, damping, RATE_HZ) for f, depth, damping in NOTCHES]
    return reduce(lambda f, filter: f * filter, [*filters, low_pass(LOW_PASS_HZ, RATE_HZ)], tried_controllers())


def late(f: np.ndarray) -> np.ndarray:
    return np.exp(-2j * np.pi * f * DELAY_MS / 1000)


def band(run: Path) -> PlantBand:
    return PlantBand.of(by_place(Responses.join(list(RunRecord.open(run).steady_batches()))), RATE_HZ)


def test_curves_and_bounds_are_those_of_the_changed_controllers_in_every_quantity(tab: Tab, run: Path) -> None:
    responses = RunRecord.open(run).responses()
    newest = responses[int(np.flatnonzero(responses.valid.any(axis=1))[-1])]
    before, after = described().response(F), tried().response(F) * late(F)
    loop, factor = newest.value * after, after / before
    slope = np.abs(before * factor / (1 + loop) ** 2)
    expected = {
        "open loop": (loop, np.abs(after)),
        "closed loop": (loop / (1 + loop), slope),
        "sensitivity": (1 / (1 + loop), slope),
    }
    for quantity, (curve, by) in expected.items():
        tab.page.locator(f'#quantities [data-value="{quantity}"]').click()
        tab.until(f"bode.curves.measured?.frame.quantity === '{quantity}' && bode.curves['what if']")
        db, deg = (tab.numbers(f"bode.curves['what if'].{name}") for name in ("db", "deg"))
        # T and S travel as float32 and become L again: relative to what is near −1 and near zero.
        assert np.allclose(10 ** (db / 20) * np.exp(1j * np.radians(deg)), curve, rtol=3e-4, atol=2e-4), quantity
        radius = tab.numbers("bode.curves['what if'].reach") * np.abs(curve)
        assert np.allclose(radius, newest.bound() * by, rtol=2e-3, atol=1e-4), quantity
    tab.page.locator('#quantities [data-value="plant"]').click()
    tab.until("bode.curves.measured?.frame.quantity === 'plant' && !bode.curves['what if']")
    tab.page.locator("#what-if-open-loop").click()
    tab.until("bode.curves.measured?.frame.quantity === 'open loop' && bode.curves['what if']")


def test_margins_before_and_after_and_of_the_worst_plant_are_those_of_tune(tab: Tab, run: Path) -> None:
    plant = band(run)
    at = ~plant.above
    f = plant.frequency_hz
    for side, feedback in (("before", described().response(f)), ("after", tried().response(f) * late(f))):
        assert stable(plant.value * feedback, f).all()
        for kind, share in (("measured", 0.0), ("worst", 1.0)):
            radius = share * plant.radius[:, at] * np.abs(feedback[at])
            expected = predicted(f[at], plant.value[:, at] * feedback[at], radius)
            if share:
                expected = expected.with_unknown(float(np.abs(plant.value * feedback)[:, ~at].max()))
            found = tab.js(f"whatIf.margins.{side}.{kind}")
            for name, own in NAMES.items():
                value = found[name] if found[name] is not None else np.inf
                assert value == pytest.approx(getattr(expected, own), rel=1e-9), (side, kind, own)
    note = tab.page.locator("#what-if-margins .note").inner_text()
    fall = np.abs(plant.value * feedback)[:, ~at]
    assert f"exceeds the fall by more than {20 * np.log10(0.5 / fall.max()):.0f} dB" in note
    permitted = (fall * plant.rise[:, ~at]).max() / fall.max()
    assert f"The lines permit one of {20 * np.log10(permitted):.0f} dB" in note
    cells = tab.page.locator("#what-if-margins tbody tr").nth(3).locator("td").all_inner_texts()
    assert all(cells), "Ms is shown in every column"


class Late(Algebra):
    """F with the delay of `ADDRESS`."""

    def response(self, frequency_hz: ArrayLike) -> np.ndarray:
        f = np.asarray(frequency_hz, dtype=float)
        return tried().response(f) * late(f)


def test_steps_with_their_bands_are_those_of_tune(tab: Tab, run: Path) -> None:
    """Of the trial that has rested: the page draws what Python predicts for its own controllers and filters."""
    tab.until("whatIf.steps.answer")
    answer, plant = tab.js("whatIf.steps.answer"), band(run)
    first = replace(plant, **{name: getattr(plant, name)[:1] for name in ("value", "radius", "spread", "sigma")})
    time_s = np.array(answer["time_ms"]) / 1000
    for side, feedback in (("before", described()), ("after", Late())):
        for kind, step in zip(("reference", "disturbance"), predicted_steps(first, feedback, time_s), strict=True):
            for name in ("value", "low", "high"):
                expected = np.ravel(getattr(step, name))
                assert np.allclose(answer[side][kind][name], expected, rtol=1e-9, atol=1e-9), (side, kind, name)
    charts = tab.js("whatIf.steps.charts.map(({made}) => made.data[2].length)")
    assert charts == [len(time_s)] * 2


def test_torque_noise_is_that_of_tune_and_within_its_range(tab: Tab, run: Path) -> None:
    """The rms at the worst place is that of an even grid of frequencies, as a long record has; 1e-3."""
    tab.until("whatIf.steps.answer")
    answer, plant = tab.js("whatIf.steps.answer"), band(run)
    f = plant.frequency_hz
    even = np.linspace(f[0], f[-1], 200_001)
    for side, feedback in (("before", described()), ("after", Late())):
        behind = feedback.response(f)
        mean = max(np.interp(even, f, np.abs(behind / (1 + value * behind)) ** 2).mean() for value in plant.value)
        noise = answer[side]["noise"]
        assert noise["value"] == pytest.approx(np.sqrt(mean), rel=1e-3)
        assert noise["low"] < noise["value"] < noise["high"]


def test_steps_of_an_outdated_trial_are_dropped_and_one_request_is_made_at_a_time(tab: Tab) -> None:
    tab.until("whatIf.steps.answer")
    held: list[Route] = []
    tab.page.route("**/api/steps*", lambda route: held.append(route))
    field = tab.page.locator('#what-if-rows [type=number][data-part="gain"]')
    before = tab.js("whatIf.steps.answer")
    for gain in ("0.3", "0.31", "0.32", str(TRIAL["gain"])):
        field.fill(gain)
        field.press("Tab")
        tab.until(f"whatIf.steps.rested && whatIf.steps.text.includes('gain~{gain}')")
    assert len(held) == 1, "the next one waits for its answer"
    with tab.page.expect_request("**/api/steps*"):
        held[0].fulfill(json=before | {"places": 99})
    assert tab.js("whatIf.steps.answer.places") == before["places"], "that of 0.3 is not shown"
    held[1].fulfill(json=before | {"places": 100})
    tab.until("whatIf.steps.answer.places === 100")
    tab.page.unroute("**/api/steps*")
    assert len(held) == 2


def compared(tab: Tab, plant: np.ndarray, hz: np.ndarray) -> dict[str, Any]:
    """Margins in JavaScript of a curve without bounds, and whether it is stable."""
    return tab.page.evaluate(  # type: ignore[no-any-return]
        """async ([hz, re, im]) => {
          const { predicted, stable } = await import("/static/predicted.js");
          const disc = { re: Float64Array.from(re), im: Float64Array.from(im), radius: new Float64Array(hz.length) };
          return { ...predicted(hz, [disc], hz.length, false), stable: stable(hz, disc) };
        }""",
        [hz.tolist(), plant.real.tolist(), plant.imag.tolist()],
    )


@pytest.mark.filterwarnings("ignore:Setting the shape:DeprecationWarning")  # python-control with NumPy 2.5
@pytest.mark.parametrize(("gain", "is_stable"), [(0.5, True), (1.2, True), (2.5, False)])
def test_margins_of_a_known_loop_are_those_of_python_control(tab: Tab, gain: float, is_stable: bool) -> None:
    """L = K/(s·(1 + s)²) at 200 Hz, between whose poles and zeros nothing is hidden."""
    dt = 0.005
    system = control.sample_system(control.tf([gain], [1, 2, 1, 0]), dt, "zoh")
    hz = np.geomspace(1e-2, 0.5 / dt, 4001)
    loop = control.frequency_response(system, 2 * np.pi * hz).complex.ravel()
    found = compared(tab, loop, hz)
    assert found["stable"] is is_stable
    assert is_stable == (np.abs(control.feedback(system).poles()) < 1).all()
    if not is_stable:
        return
    gain_margin, phase_margin, *_ = control.stability_margins(control.frd(loop, 2 * np.pi * hz))
    assert found["gainMarginDb"] == pytest.approx(20 * np.log10(gain_margin), abs=5e-3)
    assert found["phaseMarginDeg"] == pytest.approx(phase_margin, abs=1e-3)
    disk, *_ = control.disk_margins(system, 2 * np.pi * hz)
    assert found["disk"] == pytest.approx(disk, rel=1e-3)
    assert found["ms"] == pytest.approx(np.abs(1 / (1 + loop)).max(), rel=1e-12)


def test_filters_are_the_biquads_of_python_and_are_copied(tab: Tab) -> None:
    expected = [notch(f, depth, damping, RATE_HZ) for f, depth, damping in NOTCHES] + [low_pass(LOW_PASS_HZ, RATE_HZ)]
    tab.context.grant_permissions(["clipboard-read", "clipboard-write"])
    tab.page.locator("#what-if-biquads").click()
    tab.page.locator("#notice", has_text="copied").wait_for()
    copied = json.loads(tab.page.evaluate("() => navigator.clipboard.readText()"))
    found = [Biquad(tuple(one["b"]), tuple(one["a"][1:]), one["rate_hz"]) for one in copied]
    for one, own in zip(found, expected, strict=True):
        assert one.b + one.a == pytest.approx(own.b + own.a, rel=1e-12)
    tab.page.locator("#what-if-toml").click()
    tab.until("document.getElementById('notice').textContent.includes('copied')")
    text = tab.page.evaluate("() => navigator.clipboard.readText()")

    loop = tomllib.loads(text)["loop"]
    assert loop == {
        "velocity": {"gain": TRIAL["gain"], "integral_time_s": TRIAL["integral_time_s"]},
        "position": {"gain": TRIAL["position_gain"]},
    }
    assert "loop check: not checked" in text


def test_an_unchecked_loop_is_shown_and_nothing_is_written(tab: Tab, run: Path) -> None:
    before = sorted((path.name, path.stat().st_mtime_ns) for path in run.rglob("*"))
    check = tab.page.locator("#what-if-check")
    assert check.inner_text().startswith("loop check: not checked")
    assert "not promises" in check.inner_text()
    assert "nothing is written to a machine" in tab.page.locator("#what-if-card").inner_text()
    bar = tab.page.locator('#what-if-rows [type=range][data-part="delay"]')
    bar.press("ArrowRight")
    assert sorted((path.name, path.stat().st_mtime_ns) for path in run.rglob("*")) == before
    bar.press("ArrowLeft")


def test_sliders_follow_keys_and_fields_and_the_address_keeps_them(tab: Tab) -> None:
    page = tab.page
    tab.settle()  # the margins follow a slider at the next frame only
    before = tab.js("whatIf.margins.after.measured.bandwidthHz")
    bar = page.locator('#what-if-rows [type=range][data-part="gain"]')
    field = page.locator('#what-if-rows [type=number][data-part="gain"]')
    for _ in range(5):
        bar.press("ArrowRight")
    tab.until(f"whatIf.margins.after.measured.bandwidthHz > {before}")
    assert float(field.input_value()) == tab.js("whatIf.trial.values.gain")
    field.fill(str(TRIAL["gain"]))
    field.press("Tab")
    tab.until(f"Math.abs(whatIf.margins.after.measured.bandwidthHz - {before}) < 1e-9")
    page.get_by_role("button", name="add a notch").click()
    page.get_by_role("button", name="add a notch").click()
    assert page.get_by_role("button", name="add a notch").is_disabled(), "up to four"
    for _ in range(2):
        page.get_by_role("button", name="remove notch 3").click()
    shown = tab.js("JSON.stringify(whatIf.trial)")
    tab.reload()
    tab.until("window.livebode?.whatIf.margins.after && bode.curves['what if']")
    assert tab.js("JSON.stringify(whatIf.trial)") == shown
    page.locator("#what-if-reset").click()
    tab.until("!bode.curves['what if'] && !location.hash.includes('what-if')")
    page.get_by_role("button", name="proposed by livebode tune").click()
    found = tab.js("whatIf.trial.notches.map(({hz, depthDb, damping}) => [hz, depthDb, damping])")
    assert np.allclose(found, NOTCHES)
    assert tab.js("whatIf.trial.values") == TRIAL
    page.keyboard.press("Escape")
    page.locator("#what-if-card").wait_for(state="hidden")
    assert page.evaluate("() => document.activeElement.id") == "what-if"


def test_an_unstable_trial_is_named_and_has_no_margins(tab: Tab) -> None:
    if tab.page.locator("#what-if-card").is_hidden():
        tab.page.locator("#what-if").click()
    field = tab.page.locator('#what-if-rows [type=number][data-part="delay"]')
    field.fill("60")
    field.press("Tab")
    gain = tab.page.locator('#what-if-rows [type=number][data-part="gain"]')
    gain.fill("2")
    gain.press("Tab")
    tab.until("whatIf.margins.after === null")
    cells = tab.page.locator("#what-if-margins tbody td[data-name^=after]").all_inner_texts()
    assert set(cells) == {"unstable", "–"}, "said once"
    assert tab.page.locator(".step").first.is_hidden()
    assert "unstable" in tab.page.locator("#what-if-steps").inner_text()


def test_margins_of_a_known_loop(tab: Tab) -> None:
    """L = K / (jr (1 + jr)²) with r = f/10: −180° at 10 Hz, gain margin 2/K; |L| = 1 where r (1 + r²) = K."""
    f = np.geomspace(1, 100, 2001)
    r, gain = f / 10, 0.5
    value = gain / (1j * r * (1 + 1j * r) ** 2)
    db, deg = 20 * np.log10(np.abs(value)), np.degrees(np.unwrap(np.angle(value)))
    found = tab.page.evaluate(
        """async ([hz, db, deg]) => {
          const { marginsOf } = await import("/static/whatif.js");
          return marginsOf(hz, db, deg, hz.map(() => 0.1));
        }""",
        [f.tolist(), db.tolist(), deg.tolist()],
    )
    crossing = next(float(x.real) for x in np.roots([1, 0, 1, -gain]) if abs(x.imag) < 1e-12)
    phase = 180 - 90 - 2 * np.degrees(np.arctan(crossing))
    assert [one["kind"] for one in found] == ["gain", "phase"]
    assert [one["hz"] for one in found] == pytest.approx([10, 10 * crossing], rel=1e-5)
    assert [one["value"] for one in found] == pytest.approx([20 * np.log10(2 / gain), phase], abs=1e-3)
    assert [one["reach"] for one in found] == pytest.approx([0.1, 0.1])


def test_a_phase_beyond_a_turn_gets_that_of_the_factor(tab: Tab) -> None:
    """Also beside values that cannot be distinguished from zero."""
    deg = np.linspace(-700.0, 100.0, len(F))
    curve = {"hz": F.tolist(), "db": [0.0] * len(F), "deg": deg.tolist(), "reach": [0.1, 2.0] * (len(F) // 2 + 1)}
    added = np.linspace(-500.0, 20.0, len(F))
    factor = np.exp(1j * np.radians(added))
    found = tab.page.evaluate(
        "async ([curve, factor]) => (await import('/static/whatif.js')).tried(curve, 'open loop', factor).deg",
        [
            curve | {"frame": None, "noise": [], "coherence": []},
            {"re": factor.real.tolist(), "im": factor.imag.tolist(), "deg": added.tolist()},
        ],
    )
    assert np.allclose(list(found.values()) if isinstance(found, dict) else found, deg + added, atol=1e-6)


def test_without_a_described_loop_nothing_is_offered_to_copy_or_to_reset(browser: Browser, tmp_path: Path) -> None:
    directory = whole_run(tmp_path / "run", loop=None)
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(directory)
    with dashboard, Tab(browser, dashboard.url) as tab:
        tab.page.locator("#what-if").click()
        tab.page.locator("#what-if-check", has_text="describe its controllers under [loop]").wait_for()
        assert tab.page.locator("#what-if-card header button:visible").all_inner_texts() == ["×"]
        assert tab.wrong == []


def test_the_titles_of_low_charts_on_a_telephone_are_whole(browser: Browser, run: Path) -> None:
    """Of the magnitude with its unit where there is room for it above the sliders."""
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(run)
    telephone = {"width": 390, "height": 844}
    with dashboard, Tab(browser, dashboard.url + "#sliders=1", viewport=telephone) as tab:
        tab.until("whatIf.facts && bode.charts[0].height < 200")
        tab.settle()
        titles = tab.page.evaluate(_UPRIGHT_TITLES)
        assert [title.removesuffix(" re 1 rad/s/(N m)") for title, _, _ in titles] == ["|G| in dB", "phase in °"]
        assert all(0 <= top < bottom <= 1 for _, top, bottom in titles), titles
        assert tab.wrong == []


_UPRIGHT_TITLES = """async () => {
  const found = [], before = CanvasRenderingContext2D.prototype.fillText;
  CanvasRenderingContext2D.prototype.fillText = function (text, ...at) {
    const { b, f } = this.getTransform(), half = this.measureText(text).width / 2, { height } = this.canvas;
    if (b) found.push([text, (f - half) / height, (f + half) / height]);
    before.call(this, text, ...at);
  };
  for (const chart of livebode.bode.charts.slice(0, 2)) chart.redraw();
  await new Promise(requestAnimationFrame);  // it draws behind the task that asks for it
  CanvasRenderingContext2D.prototype.fillText = before;
  return found;
}"""


def test_the_worst_plant_of_the_demo_is_stable_in_its_loop() -> None:
    """Also at the turning points of the strokes, whose friction disturbs the lowest lines most."""
    record = RunRecord.open(shown()[0])
    loop = recorded_loop(record.summary).build(record.lines.rate_hz).feedback
    assert loop is not None
    band = PlantBand.of(by_place(Responses.join(list(record.steady_batches()))), record.lines.rate_hz)
    behind = loop.response(band.frequency_hz)
    known = ~band.above
    distance, reach = np.abs(1 + band.value * behind)[:, known], (band.radius * np.abs(behind))[:, known]
    assert (reach < 0.8 * distance).all(), (reach / distance).max(axis=1)


def test_the_sliders_are_first_and_the_open_loop_is_shown_when_one_moves(browser: Browser, run: Path) -> None:
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(run)
    with dashboard, Tab(browser, dashboard.url + "#sliders=1") as tab:
        tab.until("whatIf.facts")
        tab.settle()
        for control in (tab.page.get_by_role("button", name="add a notch"), tab.page.get_by_label("gain").first):
            box = control.bounding_box()
            assert box
            assert 0 < box["y"] < 900 - box["height"], "on the first screen of 1440 × 900"
        table = tab.page.locator("#what-if-margins").bounding_box()
        assert table
        assert box["y"] < table["y"]
        assert tab.js("bode.quantity") == "plant"
        tab.page.locator('#what-if-rows [type=range][data-part="gain"]').press("ArrowRight")
        tab.until("bode.quantity === 'open loop' && bode.curves['what if']")
        assert tab.wrong == []
