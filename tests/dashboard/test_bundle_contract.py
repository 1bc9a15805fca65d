"""The bundles of the pages: served only where they are current, stored by browsers, and the same page as its files."""

from __future__ import annotations

import gzip
import json
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from http.client import HTTPConnection
from itertools import pairwise
from pathlib import Path
from urllib.parse import urljoin, urlsplit

import pytest
from playwright.sync_api import Browser

from livebode.dashboard import Dashboard, ServerSettings, plugin_pages, static_files
from tests.support.browser import Tab
from tests.support.dashboards import Watched, whole_run
from tests.support.peers.peer import PATIENCE_S
from tools.bundle import sources

REQUESTS_MAX = 8
PAGES = {"fleet.html", "index.html", "login.html", "measure.html", "runs.html", "task.html", "trends.html"}


@pytest.fixture(scope="module")
def files() -> dict[str, static_files.StaticFile]:
    """Everything that a server can have, with current bundles: without them tests are skipped, and fail in CI."""
    found = static_files.static_files(sources())
    if {page for page in PAGES if is_bundled(found[page].body)} != PAGES:
        message = "the bundles are missing or not current: make bundle"
        pytest.fail(message) if os.environ.get("CI") else pytest.skip(message)
    return found


def is_bundled(page: bytes) -> bool:
    """Whether it loads one script and one style whose names have a hash."""
    links = re.findall(rb'(?:stylesheet" href|module" src)="/static/\w+-[A-Z0-9]{8}\.', page)
    return len(links) == page.count(b"/static/") - 1 == 2  # and the icon


@pytest.fixture
def watched(tmp_path: Path) -> Iterator[Watched]:
    with Watched(tmp_path / "run") as found:
        found.go(6000)
        yield found


@pytest.mark.usefixtures("files")
def test_a_page_is_served_without_its_bundle_where_any_of_its_files_differs() -> None:
    now = sources()
    of_page = set(_manifest()["index.html"]["sources"])
    assert {"index.html", "main.js", "additions.js", "icon.svg", "print.css", "uplot/uPlot.esm.js"} <= of_page
    for name in ("index.html", "main.js", "address.js", "additions.js", "icon.svg", "print.css", "uplot/uPlot.esm.js"):
        changed = static_files.static_files(now | {name: now[name] + b" "})
        assert changed["index.html"].body.startswith(now["index.html"]), name
        assert not any(key.startswith("index-") for key in changed), name
    assert is_bundled(static_files.static_files(now | {"bode.js": b""})["runs.html"].body)  # it has no plot


def _manifest() -> dict[str, dict[str, dict[str, str]]]:
    return json.loads((static_files.BUNDLE / "manifest.json").read_bytes())  # type: ignore[no-any-return]


@pytest.mark.usefixtures("files")
def test_every_file_that_a_page_loads_is_a_source_of_its_bundle() -> None:
    now = {name: content.decode() for name, content in sources().items()}
    for page in PAGES:
        open_, known = [page], set[str]()
        while open_:
            name = open_.pop()
            known.add(name)
            suffix = Path(name).suffix
            pattern = {
                ".js": r'^import [^;"]*"([^"]+)"',
                ".css": r"url\((\S+)\)",
                ".html": r'="(/static/[^"]+)"',
            }
            found = re.findall(pattern[suffix], now[name], re.M) if suffix in pattern else []
            open_ += {urljoin(f"/static/{name}", path).removeprefix("/static/") for path in found} - known
        assert known - {"icon.svg"} == _manifest()[page]["sources"].keys() - {"icon.svg"}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return whole_run(tmp_path_factory.mktemp("whole") / "run")


@contextmanager
def page_of_run(browser: Browser, run: Path) -> Iterator[Tab]:
    """The page of a finished run, which does not change."""
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(run)
    with dashboard, Tab(browser, dashboard.url, wait=False) as tab:
        tab.until("bode.curves.measured")
        tab.page.wait_for_load_state("networkidle")
        tab.settle()
        yield tab
        assert tab.wrong == []


@pytest.mark.parametrize("part", ["whatIf", "matrix", "start"])
def test_without_a_wing_its_page_has_the_other_files_one_by_one(
    part: str, monkeypatch: pytest.MonkeyPatch, browser: Browser, run: Path
) -> None:
    named = dict(plugin_pages.named("pages"))
    others = {name: where for name, where in named.items() if name != part}
    monkeypatch.setattr(plugin_pages, "named", lambda _: others)
    with page_of_run(browser, run) as tab:
        assert set(tab.js("Object.keys(livebode)")) & named.keys() == others.keys()
        assert not is_bundled(tab.page.request.get(tab.url).body())


LOOK = """() => [...document.querySelectorAll("[id]")].map((one) => {
  const style = getComputedStyle(one);
  return [one.id, Object.fromEntries([...style].map((name) => [name, style.getPropertyValue(name)]))];
})"""


@pytest.mark.usefixtures("files")
def test_the_bundle_shows_the_same_page_as_its_files(
    browser: Browser, monkeypatch: pytest.MonkeyPatch, run: Path, tmp_path: Path
) -> None:
    with page_of_run(browser, run) as tab:
        assert is_bundled(tab.page.request.get(tab.url).body())
        bundled = tab.js("Object.keys(livebode)"), tab.js("document.body.innerText"), tab.page.evaluate(LOOK)
    monkeypatch.setattr(static_files, "BUNDLE", tmp_path)
    with page_of_run(browser, run) as tab:
        assert not is_bundled(tab.page.request.get(tab.url).body())
        parts, text, looks = tab.js("Object.keys(livebode)"), tab.js("document.body.innerText"), tab.page.evaluate(LOOK)
    assert parts == bundled[0]
    assert text.splitlines() == bundled[1].splitlines()
    assert len(looks) > 100
    for (name, look), (name_bundled, look_bundled) in zip(looks, bundled[2]):
        assert (name, look.items() - look_bundled.items()) == (name_bundled, set())


@pytest.mark.usefixtures("files")
def test_a_curve_needs_few_requests_and_a_second_visit_none_for_the_bundle(browser: Browser, watched: Watched) -> None:
    with Tab(browser, "about:blank", wait=False) as tab:
        asked: list[str] = []
        tab.page.on("request", lambda request: asked.append(urlsplit(request.url).path))
        tab.page.on("websocket", lambda socket: asked.append(urlsplit(socket.url).path))
        tab.page.goto(watched.url)
        tab.until("window.livebode?.bode.curves.measured")
        assert len(asked) <= REQUESTS_MAX, asked
        assert asked.count("/catalogue") == 1
        stored = (
            "performance.getEntriesByType('resource').filter(({ name }) => /\\/static\\/index-/.test(name))"
            ".map(({ transferSize }) => transferSize)"
        )
        assert [size > 0 for size in tab.js(stored)] == [True, True]
        tab.page.goto("about:blank")
        tab.page.goto(watched.url)
        tab.until("window.livebode?.bode.curves.measured")
        assert tab.js(stored) == [0, 0]
        assert tab.wrong == []


def answer(url: str, path: str, **headers: str) -> tuple[int, dict[str, str], bytes]:
    connection = HTTPConnection(urlsplit(url).netloc, timeout=PATIENCE_S)
    connection.request("GET", path, headers={name.replace("_", "-"): value for name, value in headers.items()})
    found = connection.getresponse()
    body = found.read()
    connection.close()
    return found.status, {name.lower(): value for name, value in found.getheaders()}, body


def test_hashed_files_are_stored_for_a_year_and_all_others_asked_for_again(
    files: dict[str, static_files.StaticFile], watched: Watched
) -> None:
    hashed = [name for name in files if name.startswith("index-")]
    assert {Path(name).suffix for name in hashed} == {".js", ".css", ".map"}
    for path in (
        "/",
        "/login",
        "/static/main.js",
        "/static/icon.svg",
        "/catalogue",
        *(f"/static/{name}" for name in hashed),
    ):
        status, headers, plain = answer(watched.url, path)
        expected = "max-age=31536000, immutable" if "/index-" in path else "no-cache"
        assert (status, headers["cache-control"]) == (200, expected), path
        assert "accept-encoding" in headers["vary"]
        assert "content-encoding" not in headers
        status, compressed, body = answer(watched.url, path, accept_encoding="gzip, br")
        assert (status, compressed["content-encoding"], compressed["etag"]) == (200, "gzip", headers["etag"])
        assert compressed["content-type"] == headers["content-type"]
        assert gzip.decompress(body) == plain
        assert len(body) == int(compressed["content-length"])
        status, unchanged, body = answer(watched.url, path, if_none_match=headers["etag"])
        assert (status, body, unchanged["cache-control"]) == (304, b"", expected)
        assert unchanged["content-security-policy"] == headers["content-security-policy"]
        assert answer(watched.url, path, if_none_match='W/"0"')[0] == 200
    for path in ("/api/saved?axis=0", "/static/absent.js"):
        assert answer(watched.url, path)[1]["cache-control"] == "no-store"


def test_the_chosen_language_is_a_cookie_and_others_are_ignored(watched: Watched) -> None:
    for cookie, accepted, code in (
        ("", "de", "de"), ("language=de", "en", "de"), ("language=zh-CN; livebode=x", "de", "zh-CN"),
        ("language=xx", "de", "de"), ("language=../de", "en", "en"), ("=;; language", "en", "en"),
    ):  # fmt: skip
        _, _, body = answer(watched.url, "/catalogue", cookie=cookie, accept_language=accepted)
        assert json.loads(body)["code"] == code, cookie


def test_a_language_that_a_person_chooses_remains(browser: Browser, watched: Watched) -> None:
    with Tab(browser, watched.url, locale="en-GB") as tab:
        tab.page.evaluate("() => document.querySelector('#help').click()")
        tab.page.select_option("#language", "de")
        tab.until("window.livebode?.bode.curves.measured && document.documentElement.lang === 'de'")
        tab.page.reload()
        tab.until("window.livebode?.bode.curves.measured && document.documentElement.lang === 'de'")
        assert tab.wrong == []


def test_source_maps_lead_to_lines_of_the_files_that_are_served(files: dict[str, static_files.StaticFile]) -> None:
    maps = [name for name in files if name.endswith(".map")]
    assert len(maps) == 2 * len(PAGES)
    for name in maps:
        bundle = files[name.removesuffix(".map")].body.decode()
        assert f"sourceMappingURL={name}" in bundle[-200:]
        facts = json.loads(files[name].body)
        paths = [urljoin(f"/static/{name}", path) for path in facts["sources"]]
        texts = [files[path.removeprefix("/static/")].body.decode().splitlines() for path in paths]
        letters = exact = 0
        lines = bundle.splitlines()
        for (line, column, *place), (line_after, column_after, *_) in pairwise(segments(facts["mappings"])):
            source, at, start = place
            own = lines[line][column : column_after if line == line_after else None]
            if re.match(r'"[^"\\]{4,}"', own):  # a text is the same in both, unless it was joined from constants
                letters += 1
                exact += texts[source][at][start + 1 : start + 5] == own[1:5]
        assert exact >= 0.9 * letters
        assert letters > 5 or name.endswith(".css.map")


def segments(mappings: str) -> Iterator[tuple[int, int, int, int, int]]:
    """Line and column of the bundle, source, line and column there, of each segment of a source map (ECMA-426)."""
    digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"
    state = [0, 0, 0, 0]
    for line, text in enumerate(mappings.split(";")):
        state[0] = 0
        for segment in filter(None, text.split(",")):
            values, value, shift = list[int](), 0, 0
            for digit in map(digits.index, segment):
                value, shift = value | (digit & 31) << shift, shift + 5
                if not digit & 32:
                    values.append(-(value >> 1) if value & 1 else value >> 1)
                    value = shift = 0
            state = [known + more for known, more in zip(state, (values + [0] * 4)[:4])]
            yield line, *state  # type: ignore[misc]


def test_the_licence_of_what_is_bundled_remains(files: dict[str, static_files.StaticFile]) -> None:
    for page in PAGES:
        if "uplot/uPlot.esm.js" in _manifest()[page]["sources"]:
            (script,) = (name for name in files if re.fullmatch(rf"{page.removesuffix('.html')}-\w+\.js", name))
            assert b"Leon Sorokin" in files[script].body
            assert b"MIT Licensed" in files[script].body


def test_what_the_page_of_a_run_loads_is_small(files: dict[str, static_files.StaticFile]) -> None:
    loaded = [files[name].body for name in files if re.fullmatch(r"index(-\w+\.(js|css)|\.html)", name)]
    assert len(loaded) == 3
    assert sum(len(gzip.compress(content)) for content in loaded) < 110_000
