"""The parts of a bound on the page: what is drawn, printed and switched is what the run's table of responses has."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser

from livebode.core import CIRCLE_FACTOR, Block, Lines, Response, Responses, widened
from livebode.dashboard import Dashboard, ServerSettings
from livebode.estimation import Settings, Tracker
from livebode.excitation import multisine
from livebode.records import RunRecord
from livebode.simulation import BeltAxis, Friction, Sensor, SimulatedAxis, Standstill, TensionLoss
from tests.support.browser import Tab
from tests.support.command import livebode, write_parquet
from tests.support.dashboards import begin

RATE_HZ = 4000


def odd(first: int, last: int, window: int) -> Lines:
    """Odd bins; every fourth of them is a detection line, which shows the distortion."""
    bins = range(first, last, 2)
    excited = tuple(k for k in bins if k % 8 != 3)
    return Lines(excited, window, RATE_HZ, tuple(set(range(first, last)) - set(excited)))


FEW, MANY = odd(5, 30, 800), odd(15, 125, 3200)  # more than 40 lines are a band
SECONDS = 12.0
CLOSE = {"atol": 3e-5, "rtol": 2e-6}  # curves travel as float32


@cache
def belt(lines: Lines, loss: float, rough: bool) -> Block:
    """A belt axis at standstill, with or without friction, that loses this share of its stiffness evenly."""
    axis = BeltAxis(
        motion=Standstill(position_m=0.8),
        friction=Friction(motor_coulomb_n_m=0.02 if rough else 0.0),
        sensor=Sensor(noise_rad_per_s=0.05),
        excitation_n_m=multisine(lines),
        faults=(TensionLoss(loss=loss, ramp_s=SECONDS),) if loss else (),
        seconds=SECONDS,
        run_in_s=3.0,
        seed=7,
    )
    return SimulatedAxis(axis).run()[0]


def averages(lines: Lines, loss: float, rough: bool) -> Responses:
    """The running average over the periods, as a live run publishes it."""
    settings = Settings(lines=lines, output="velocity", input="u", excitation="w", hop=400, average=True)
    return Tracker(settings).process(belt(lines, loss, rough))


def recorded(directory: Path, lines: Lines, loss: float, rough: bool) -> Path:
    """The directory of a run that averages over a recording of the belt."""
    block = belt(lines, loss, rough)
    columns = {channel.name: values for channel, values in zip(block.channels, block.data)}
    log = write_parquet(directory / "belt.parquet", {name: columns[name] for name in ("w", "u", "velocity")})
    roles = "--excitation", "w", "--input", "u", "--output", "velocity", "--accept-roles"
    at_hz = ",".join(f"{f:g}" for f in lines.frequency_hz)
    grid = "--rate", RATE_HZ, "--lines", at_hz, "--window", lines.window
    done = livebode("run", log, *roles, *grid, "--average", "--out", directory / "run")
    assert done.code == 0, done.err
    return directory / "run"


@pytest.fixture(scope="module", params=[FEW, MANY], ids=["bars", "bands"])
def drifting(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp("drifting"), request.param, 0.1, True)


@contextmanager
def page(browser: Browser, run: Path) -> Iterator[Tab]:
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(run)
    with dashboard, Tab(browser, dashboard.url) as tab:
        tab.settle()
        yield tab
        assert tab.wrong == []


def radii(one: Response) -> list[np.ndarray]:
    """95 % radius over |G| of the noise, of noise and distortion, and of all, from the columns of the table."""
    parts = np.nan_to_num([one.distortion, one.variation])
    noise = np.sqrt(np.maximum(one.sigma**2 - (parts**2).sum(axis=0), 0.0))
    sigmas = noise, np.hypot(noise, parts[0]), one.sigma
    return [widened(sigma, one.dof, CIRCLE_FACTOR) / np.abs(one.value) for sigma in sigmas]


def newest(run: Path) -> Response:
    found = RunRecord.open(run).responses().newest()
    assert found is not None
    return found


def legend(tab: Tab) -> list[str]:
    return [text.strip() for text in tab.page.locator("#legend .key").all_inner_texts()]


def curve(tab: Tab, name: str) -> np.ndarray:
    return tab.numbers(f"bode.curves.measured.{name}")


COLOUR = """async ([hz, db, above]) => {
  const { bode } = livebode, half = above / 0.6;
  bode.zooming.along(0, [db - half, db + half]);
  bode.zoomed();
  await new Promise((drawn) => requestAnimationFrame(drawn));
  const u = bode.charts[0], at = (value, axis) => Math.round(u.valToPos(value, axis, true));
  const one = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
  one.drawImage(u.ctx.canvas, at(hz, "x"), at(db + above, "y"), 1, 1, 0, 0, 1, 1);
  return Array.from(one.getImageData(0, 0, 1, 1).data);
}"""


def colour(tab: Tab, one: Response, line: int, reach: float) -> str:
    """What is drawn at a line where the magnitude plus this share of it is: the name of the colour."""
    db = float(one.magnitude_db[line])
    away = int(np.argmax(np.abs(one.lines.frequency_hz - one.lines.frequency_hz[line])))
    tab.js(f"bode.go({one.lines.frequency_hz[away]})")  # the cursor is a line through the point
    above = 20 * float(np.log10(1 + reach))
    red, green, blue, alpha = tab.page.evaluate(COLOUR, [float(one.lines.frequency_hz[line]), db, above])
    if not alpha:
        return "none"
    if blue > red + 40 and blue > green + 20:
        return "blue"
    return "yellow" if red > green > blue + 40 else "pink" if red > green + 20 and blue > green + 20 else "none"


def test_the_parts_are_those_of_the_table(browser: Browser, drifting: Path) -> None:
    one = newest(drifting)
    truth = radii(one)
    assert (one.variation > 0).any()
    assert (one.distortion > 0).any()
    with page(browser, drifting) as tab:
        assert legend(tab) == ["noise", "distortion", "time variation"]
        for name, expected in zip(("noise", "distorted", "reach"), truth):
            assert np.allclose(curve(tab, name), expected, **CLOSE), name
        line = int(np.argmax(one.variation / np.abs(one.value)))
        alone = widened(np.array([one.noise, one.distortion, one.variation])[:, line], one.dof, CIRCLE_FACTOR)
        percent = 100 * alone / np.abs(one.value[line])
        tab.js(f"bode.go({one.lines.frequency_hz[line]})")
        tab.settle()
        words = tab.page.locator("#readout .parts").inner_text()
        assert words.startswith("parts of the 95 % bound, of |G|: noise ")
        found = [float(text) for text in re.findall(r"([0-9.e-]+) %", words.partition(":")[2])]
        assert found == pytest.approx(percent, rel=0.06, abs=1e-6)  # two digits
        tab.page.locator("#bode-table").click()
        cells = tab.page.locator("#table-values tbody tr").nth(line).locator("td").all_inner_texts()
        assert [float(text) for text in cells[3:]] == pytest.approx(percent, rel=0.06, abs=1e-6)


def test_each_part_has_its_colour_and_the_switch_shows_the_whole(browser: Browser, drifting: Path) -> None:
    one = newest(drifting)
    noise, distorted, whole = radii(one)
    varying, distorting = int(np.argmax(whole - distorted)), int(np.argmax(distorted - noise))
    of_variation = (distorted + whole)[varying] / 2
    of_distortion = (0.2 * noise + 0.8 * distorted)[distorting]
    with page(browser, drifting) as tab:
        assert colour(tab, one, varying, of_variation) == "yellow"
        assert colour(tab, one, distorting, of_distortion) == "pink"
        assert colour(tab, one, varying, 1.2 * whole[varying]) == "none"
        tab.page.locator("#legend [data-name=parts]").click()
        tab.settle()
        for _ in range(2):  # a reload shows the same
            assert legend(tab) == []
            assert not tab.page.locator("#readout .parts").count()
            assert colour(tab, one, varying, of_variation) == "blue"
            assert colour(tab, one, distorting, of_distortion) == "blue"
            tab.reload()
            tab.until("bode.curves.measured && bode.parts.size")
            tab.settle()
        tab.page.locator("#legend [data-name=parts]").click()
        assert colour(tab, one, varying, of_variation) == "yellow"


def test_a_machine_at_rest_has_no_time_variation(browser: Browser, tmp_path: Path) -> None:
    run = recorded(tmp_path, FEW, 0.0, True)
    assert not newest(run).variation.any()
    with page(browser, run) as tab:
        assert legend(tab) == ["noise", "distortion"]
        assert np.array_equal(curve(tab, "distorted"), curve(tab, "reach"))
        assert "variation" not in tab.page.locator("#readout .parts").inner_text()


def test_a_live_run_shows_the_parts_as_soon_as_they_are_known(browser: Browser, tmp_path: Path) -> None:
    responses = averages(FEW, 0.1, True)
    early = int(np.flatnonzero(responses.valid.all(axis=1) & ~(responses.variation > 0).any(axis=1))[-1])
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    hub = dashboard.hub("belt")
    with dashboard:
        begin(hub, tmp_path, FEW, rows=responses[:early])
        with Tab(browser, dashboard.url) as tab:
            assert "time variation" not in legend(tab)
            hub(responses[early:])
            tab.until(f"bode.curves.measured.frame.timeS[0] > {responses.time_s[-1] - 1e-6}")
            tab.settle()
            assert legend(tab) == ["noise", "distortion", "time variation"]
            for name, expected in zip(("noise", "distorted", "reach"), radii(responses[-1])):
                assert np.allclose(curve(tab, name), expected, **CLOSE), name
            tab.page.locator('#bode-kind [data-value="nyquist"]').click()
            tab.settle()
            assert tab.wrong == []
