"""What is in each picture."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

from playwright.sync_api import Page

from examples.screenshots.studio import AXIS, DESK, HALL, LANDSCAPE, MOMENT_S, PHONE, Studio, picture
from livebode.core import Event, Lines
from livebode.dashboard import Dashboard, ServerSettings
from livebode.runtime._demo import RATE_HZ
from tools.run_copies import copy_run

Scene = Callable[[Studio], bytes]
SCENES: dict[str, Scene] = {}
"""Each draws one picture: the bytes of a PNG."""
MOBILE = {"has_touch": True, "is_mobile": True, "device_scale_factor": 2}
ANY = "() => document.readyState === 'complete'"


def scene(draw: Scene) -> Scene:
    """Add a picture under the name of its function."""
    SCENES[draw.__name__.replace("_", "-")] = draw
    return draw


def _with_reference(studio: Studio, **options: Any) -> Page:
    """The demo after its fault, with a response from before as frozen reference."""
    page = studio.page(studio.faulty_url, **options)
    page.evaluate(f"() => livebode.timeline.go({MOMENT_S - 15.7})")
    page.wait_for_timeout(800)
    page.keyboard.press("f")
    page.wait_for_timeout(800)
    page.evaluate(f"() => livebode.timeline.go({MOMENT_S})")
    page.wait_for_timeout(500)
    for _ in range(2):
        page.keyboard.press("ArrowRight")
    page.mouse.move(5, 300)
    return page


@scene
def dashboard_light(studio: Studio) -> bytes:
    return picture(_with_reference(studio, color_scheme="light"))


@scene
def dashboard_dark(studio: Studio) -> bytes:
    page = _with_reference(studio, color_scheme="dark")
    page.locator("#tab-parameters").click()
    page.mouse.move(5, 300)
    return picture(page)


@scene
def start_page(studio: Studio) -> bytes:
    page = studio.page(studio.start_url, "measure?recording=standstill.csv", until=ANY)
    page.wait_for_selector("#measure:enabled")
    page.wait_for_timeout(1500)
    return picture(page)


@scene
def live(studio: Studio) -> bytes:
    return picture(studio.page(studio.live_url))


@scene
def signals(studio: Studio) -> bytes:
    return picture(studio.page(studio.live_url, "#tab=signals"))


@scene
def phone(studio: Studio) -> bytes:
    return picture(studio.page(studio.faulty_url, size=PHONE, **MOBILE))


@scene
def phone_below(studio: Studio) -> bytes:
    page = studio.page(studio.faulty_url, size=PHONE, **MOBILE)
    page.evaluate("() => document.getElementById('readout').scrollIntoView()")
    return picture(page)


@scene
def phone_alarms(studio: Studio) -> bytes:
    page = studio.page(studio.faulty_url, size=PHONE, color_scheme="dark", **MOBILE)
    page.evaluate("() => document.querySelector('.events').scrollIntoView()")
    return picture(page)


@scene
def phone_dark(studio: Studio) -> bytes:
    return picture(studio.page(studio.live_url, size=PHONE, color_scheme="dark", **MOBILE))


@scene
def phone_landscape(studio: Studio) -> bytes:
    return picture(studio.page(studio.faulty_url, size=LANDSCAPE, **MOBILE))


@scene
def lines_101(studio: Studio) -> bytes:
    return picture(studio.page(studio.views([studio.standstill])))


@scene
def lines_1(studio: Studio) -> bytes:
    return picture(
        studio.page(
            studio.views([studio.at_standstill("one line", Lines.parse("60", rate_hz=RATE_HZ, window=800), 1.0)])
        )
    )


@scene
def bound_parts(studio: Studio) -> bytes:
    page = studio.page(studio.views([studio.drifting]), color_scheme="light")
    page.locator("#legend [data-name=model]").click()
    page.mouse.move(5, 300)
    page.wait_for_timeout(500)
    return page.locator(".card.bode").screenshot()


@scene
def bound_parts_phone(studio: Studio) -> bytes:
    return picture(studio.page(studio.views([studio.drifting]), size=PHONE, color_scheme="dark", **MOBILE))


@scene
def silent(studio: Studio) -> bytes:
    with studio.live({"axis-x": "silent"}) as dashboard:
        page = studio.page(dashboard.url)
        page.locator("#verdict.check").wait_for()
        return picture(page)


@scene
def not_begun(studio: Studio) -> bytes:
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.hub("axis-x")
    with dashboard:
        return picture(studio.page(dashboard.url, until="() => window.livebode?.page.facts"))


@scene
def alarm(studio: Studio) -> bytes:
    page = studio.page(studio.faulty_url)
    page.locator("#events .alarm").first.click()
    page.mouse.move(5, 300)
    return picture(page)


@scene
def alarm_flood(studio: Studio) -> bytes:
    dashboard = studio.live({"axis-x": "live"})
    hub = dashboard.hub("axis-x")
    with dashboard:
        page = studio.page(dashboard.url)
        for i in range(400):
            reason = f"signal {i} follows the excitation with a delay"
            hub(
                Event(
                    "roles-doubtful",
                    40 * i,
                    i / 100,
                    f"The roles of the signals are doubtful: {reason}.",
                    {"reason": reason},
                )
            )
        page.wait_for_function("() => livebode.events.all.size > 399")
        page.evaluate("() => document.getElementById('alarm-count').click()")
        return picture(page)


@scene
def lost_server(studio: Studio) -> bytes:
    with studio.live({"axis-x": "live"}) as dashboard:
        page = studio.page(dashboard.url)
    page.locator("#lost").wait_for()
    return picture(page)


@scene
def nyquist(studio: Studio) -> bytes:
    return picture(studio.page(studio.faulty_url, "#quantity=open loop&view=nyquist&what-if=gain~0.9232&tab=margins"))


@scene
def nichols(studio: Studio) -> bytes:
    return picture(
        studio.page(studio.faulty_url, "#quantity=open loop&view=nichols&what-if=gain~2.308~~notch~60~20~0.3~~delay~1")
    )


TRIAL = (
    "#quantity=open loop&sliders=1&what-if=gain~2.4~~integral_time_s~0.04~~position_gain~25~~notch~75~8~1~~low-pass~300"
)


def _what_if(studio: Studio, address: str = TRIAL, **options: Any) -> Page:
    drawn = "() => window.livebode?.bode.drawn['what if'] && livebode.whatIf.steps.answer"
    return studio.page(studio.views([studio.tuned]), address, until=drawn, **options)


@scene
def what_if(studio: Studio) -> bytes:
    return picture(_what_if(studio, color_scheme="light"))


@scene
def what_if_nyquist_dark(studio: Studio) -> bytes:
    return picture(_what_if(studio, TRIAL + "&view=nyquist&nyquist-box=-2_1_-1.5_1.5", color_scheme="dark"))


@scene
def what_if_phone(studio: Studio) -> bytes:
    page = _what_if(studio, size=PHONE, **MOBILE)
    page.evaluate("() => document.querySelector('.bode').scrollIntoView()")
    return picture(page)


def _matrix(studio: Studio, **options: Any) -> Page:
    return studio.page(studio.views([studio.gantry]), until="() => document.querySelector('#matrix figure')", **options)


@scene
def matrix(studio: Studio) -> bytes:
    return picture(_matrix(studio, color_scheme="light"))


@scene
def matrix_dark(studio: Studio) -> bytes:
    return picture(_matrix(studio, color_scheme="dark"))


@scene
def matrix_phone(studio: Studio) -> bytes:
    return picture(_matrix(studio, size=PHONE, **MOBILE))


@scene
def runs(studio: Studio) -> bytes:
    return picture(studio.page(studio.weeks_url, until="() => document.querySelector('#rows tr')"))


@scene
def runs_phone(studio: Studio) -> bytes:
    page = studio.page(studio.weeks_url, size=PHONE, until="() => document.querySelector('#rows tr')", **MOBILE)
    return picture(page)


def _trends(studio: Studio, **options: Any) -> bytes:
    drawn = "() => document.querySelector('#cards canvas')"
    return picture(studio.page(studio.weeks_url, "trends", until=drawn, **options))


@scene
def trends(studio: Studio) -> bytes:
    return _trends(studio)


@scene
def trends_dark(studio: Studio) -> bytes:
    return _trends(studio, color_scheme="dark")


@scene
def wall(studio: Studio) -> bytes:
    return picture(studio.page(studio.faulty_url, "#wall=1", HALL))


@scene
def wall_axes(studio: Studio) -> bytes:
    with studio.live({"gantry x1": "live", "gantry x2": "live", "portal y": "silent"}) as dashboard:
        dashboard.view(studio.faulty)
        page = studio.page(dashboard.url, "#wall=1", HALL)
        page.wait_for_function("() => livebode.page.verdicts.some(({ word }) => word === 'silent')")
        return picture(page)


@scene
def wall_16(studio: Studio) -> bytes:
    runs = [copy_run(studio.faulty, studio.folder / "wall" / f"axis {i:02d}") for i in range(1, 10)]
    runs += [copy_run(studio.standstill, studio.folder / "wall" / f"portal {i}") for i in range(1, 7)]
    dashboard = studio.live({"portal y": "silent"})
    for run in runs:
        dashboard.view(run)
    with dashboard:
        return picture(studio.page(dashboard.url, "#wall=1", HALL, color_scheme="dark"))


@scene
def german(studio: Studio) -> bytes:
    return picture(studio.page(studio.faulty_url, "#tab=margins", locale="de-DE", timezone_id="Europe/Berlin"))


@scene
def chinese(studio: Studio) -> bytes:
    return picture(studio.page(studio.faulty_url, "#tab=parameters", locale="zh-CN", timezone_id="Asia/Shanghai"))


def _fleet(studio: Studio, address: str, **options: Any) -> Page:
    return studio.page(studio.fleet_url, address, until="() => window.livebode?.tiles.shown.length", **options)


@scene
def fleet(studio: Studio) -> bytes:
    return picture(_fleet(studio, "", color_scheme="light"))


@scene
def fleet_alarms_dark(studio: Studio) -> bytes:
    return picture(_fleet(studio, "#list=alarms&size=medium&place=Brno", color_scheme="dark"))


@scene
def fleet_workers(studio: Studio) -> bytes:
    return picture(_fleet(studio, "#list=workers&size=large&place=Brno/body"))


@scene
def fleet_axis(studio: Studio) -> bytes:
    page = _fleet(studio, "#list=alarms")
    page.locator("#events .state").first.click()
    return picture(page)


def _year(studio: Studio, **options: Any) -> bytes:
    page = _fleet(studio, "#" + urlencode({"axis": AXIS}), **options)
    page.locator("#axis-trend .u-over").wait_for()
    page.locator("#axis-trend .said").scroll_into_view_if_needed()
    return picture(page)


@scene
def fleet_year(studio: Studio) -> bytes:
    return _year(studio, color_scheme="light")


@scene
def fleet_year_dark(studio: Studio) -> bytes:
    return _year(studio, color_scheme="dark")


@scene
def fleet_year_phone(studio: Studio) -> bytes:
    return _year(studio, size=PHONE, color_scheme="light", **MOBILE)


@scene
def fleet_floor_plan(studio: Studio) -> bytes:
    return picture(_fleet(studio, "#view=plan"))


@scene
def fleet_phone(studio: Studio) -> bytes:
    return picture(_fleet(studio, "#list=gaps", size=PHONE, **MOBILE), full_page=True)


@scene
def fleet_phone_dark(studio: Studio) -> bytes:
    return picture(_fleet(studio, "#list=alarms", size=PHONE, color_scheme="dark", **MOBILE), full_page=True)


@scene
def help_and_keys(studio: Studio) -> bytes:
    page = studio.page(studio.faulty_url)
    page.keyboard.press("?")
    return picture(page)


@scene
def printed(studio: Studio) -> bytes:
    page = studio.page(studio.faulty_url)
    file = studio.folder / "printed.pdf"
    page.pdf(path=file, format="A4", prefer_css_page_size=True)
    return studio.first_page(file)


def _report(studio: Studio) -> Path:
    file = studio.folder / "report.html"
    if not file.exists():
        words = {
            "machine": "Gantry 7, axis x",
            "serial-number": "BG-2031-118",
            "operator": "M. Weber",
            "company": "Beltworks",
            "customer": "Example Packaging Ltd",
            "conditions": "no load, 21 °C, strokes of 1.35 m",
        }
        options = [f"--{name}={value}" for name, value in words.items()]
        livebode = Path(sys.executable).with_name("livebode")
        command = [livebode, "report", studio.faulty, "--out", file, *options]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return file


@scene
def report_html(studio: Studio) -> bytes:
    return picture(studio.page(_report(studio).as_uri(), size=DESK, until=ANY))


@scene
def report_pdf(studio: Studio) -> bytes:
    return studio.first_page(_report(studio).with_suffix(".pdf"))
