"""All runs of a directory over HTTP: the list, tags and notes, comparison, deletion, trends, and who may do what."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from starlette.applications import Starlette

from livebode.core import RecordError, ServerError
from livebode.dashboard import Dashboard, ServerSettings, plugin_pages
from livebode.dashboard.access import Access
from livebode.dashboard.run_catalogue import RunCatalogue
from livebode.dashboard.runs_pages import OPEN_MAX, OpenedRuns
from livebode.language import for_page
from livebode.records import Lock, Notes, RunRecord, delete, read_notes, write_notes
from tests.support.command import livebode
from tests.support.dashboards import LINES, SAMPLES, Watched
from tests.support.guarded import TOKEN, VIEWER
from tests.support.many_runs import ALARM, BEGUN, DAY_S, SOFTER, ask, run_page, source_run, weeks
from tools.run_copies import copy_run

SERVING = ServerSettings("127.0.0.1", 0)
LISTED = ["broken", *(f"day {i}" for i in range(6)), "no clock"]


@pytest.fixture(scope="module")
def source() -> Path:
    return source_run()


@contextlib.contextmanager
def serving(folder: Path, of: ServerSettings = SERVING) -> Iterator[str]:
    dashboard = Dashboard(of)
    dashboard.view_all(folder)
    with dashboard:
        yield dashboard.url


@pytest.fixture(scope="module")
def shown(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, str]]:
    """Runs that no test changes."""
    folder = weeks(source, tmp_path_factory.mktemp("shown"))
    with serving(folder) as url:
        yield folder, url


@pytest.fixture(scope="module")
def changed(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, str]]:
    """Runs that tests change, each its own; served with tokens."""
    folder = weeks(source, tmp_path_factory.mktemp("changed"))
    with serving(folder, replace(SERVING, token=TOKEN, viewer_token=VIEWER)) as url:
        yield folder, url


def rows(url: str, since: int = 0, token: str = "") -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
    status, _, found = ask(url, f"/api/runs?since={since}", token=token)
    assert status == 200
    return found, {row["name"]: row for row in found["runs"]}


def test_the_list_has_each_run_and_only_runs(shown: tuple[Path, str]) -> None:
    folder, url = shown
    found, by_name = rows(url)
    assert (found["names"], sorted(by_name), found["directory"]) == (LISTED, LISTED, folder.name)
    first, soft, broken = by_name["day 0"], by_name["day 4"], by_name["broken"]
    assert (first["state"], first["tone"], first["alarms"]) == ("finished", "ok", 0)
    assert (soft["tone"], soft["alarms"], soft["message"]) == ("alarm", 1, ALARM)
    assert (soft["begun"], by_name["no clock"]["begun"]) == (BEGUN + 4 * DAY_S, None)
    assert first["duration_s"] == pytest.approx(SAMPLES / LINES.rate_hz)
    assert (first["lines"], first["low_hz"], first["high_hz"]) == (len(LINES), 20.0, 140.0)
    assert (first["recording"], first["signals"]) == ("log.parquet", "y / u / w")
    files = [path for path in (folder / "day 0").iterdir() if path.is_file()]
    assert first["size_bytes"] == sum(path.stat().st_size for path in files)
    newest = RunRecord.open(folder / "day 0").summary["fit"]["newest"]["quantities"]["Keff"]
    assert ["Keff", newest["value"], newest["bound_95"], "N/m"] in first["fit"]
    assert (broken["state"], "run.json" in broken["message"]) == ("broken", True)
    assert rows(url, found["version"])[0]["names"] is None  # nothing has changed


def test_new_and_changed_runs_appear_and_nothing_else_is_sent_again(source: Path, tmp_path: Path) -> None:
    copy_run(source, tmp_path / "first")
    catalogue = RunCatalogue(tmp_path)
    version = catalogue.rows(0)["version"]
    copy_run(source, tmp_path / "second")
    write_notes(tmp_path / "first", Notes(tags=["belt"], text="new belt"))
    catalogue.forget()
    found = catalogue.rows(version)
    assert found["names"] == ["first", "second"]
    assert {row["name"]: row["tags"] for row in found["runs"]} == {"first": ["belt"], "second": []}
    write_notes(tmp_path / "second", Notes(tags=["x"]))
    catalogue.forget()
    assert [row["name"] for row in catalogue.rows(found["version"])["runs"]] == ["second"]


def test_tags_and_notes_are_beside_the_run_and_do_not_change_it(changed: tuple[Path, str]) -> None:
    folder, url = changed
    run = folder / "day 1"
    before = (run / "run.json").read_bytes()
    hostile = "<img src=x onerror=alert(1)>\n\u202e 张伟"
    sent = {"run": "day 1", "tags": [" belt ", "belt", "a<b"], "text": hostile}
    assert ask(url, "/api/notes", sent, TOKEN)[0] == 200
    assert read_notes(run) == Notes(tags=["belt", "a<b"], text=hostile)
    row = rows(url, token=TOKEN)[1]["day 1"]
    assert (row["tags"], row["notes"]) == (["belt", "a<b"], hostile)
    assert (run / "run.json").read_bytes() == before
    assert RunRecord.open(run).finished


@pytest.mark.parametrize(
    "wrong",
    [
        {"tags": ["x" * 41]},
        {"tags": ["a,b"]},
        {"tags": [""]},
        {"tags": ["x\n"] * 1 + ["a\x00b"]},
        {"tags": [str(i) for i in range(21)]},
        {"tags": "belt"},
        {"tags": [1]},
        {"text": "x" * 2001},
        {"text": None},
        {"run": 3},
    ],
)
def test_wrong_or_long_notes_are_refused_and_nothing_is_written(
    changed: tuple[Path, str], wrong: dict[str, Any]
) -> None:
    folder, url = changed
    status, _, found = ask(url, "/api/notes", {"run": "day 2", "tags": [], "text": ""} | wrong, TOKEN)
    assert (status, set(found)) == (400, {"error", "words"})
    assert not (folder / "day 2" / "notes.json").exists()


@pytest.mark.parametrize(
    "name",
    ["..", ".", "../outside", "day 0/../../outside", "/etc", ".hidden", "not a run", "link", "x" * 300, "", "\0"],
)
def test_only_listed_names_are_runs(changed: tuple[Path, str], name: str) -> None:
    folder, url = changed
    outside = folder.parent / "outside"
    outside.mkdir(exist_ok=True)
    (outside / "run.json").write_text("{}")
    for path, body in (
        ("/api/notes", {"run": name, "tags": [], "text": "x"}),
        ("/api/delete", {"run": name, "confirmed": name}),
    ):
        assert ask(url, path, body, TOKEN)[0] == 400
    assert ask(url, run_page(name), token=TOKEN)[0] in (307, 400, 404)
    assert sorted(path.name for path in outside.iterdir()) == ["run.json"]
    assert not (folder / "day 0" / "notes.json").exists()


def test_a_viewer_sees_everything_and_changes_nothing_and_a_stranger_sees_nothing(changed: tuple[Path, str]) -> None:
    folder, url = changed
    assert rows(url, token=VIEWER)[0]["role"] == "viewer"
    compare = "/compare?before=day%200&after=day%201"
    for path in ("/", "/trends", "/api/trends", "/api/trend?run=day%200", compare, run_page("day 0")):
        assert path == compare or ask(url, path, token=VIEWER)[0] == 200, path
        assert ask(url, path)[0] in (303, 401), path
    for path, body in (
        ("/api/notes", {"run": "day 0", "tags": [], "text": "x"}),
        ("/api/delete", {"run": "day 0", "confirmed": "day 0"}),
    ):
        assert ask(url, path, body, VIEWER)[0] == 403
        assert ask(url, path, body)[0] == 401
        assert ask(url, path, body, TOKEN, **{"Content-Type": "text/plain"})[0] == 400
        assert ask(url, path, body, TOKEN, Origin="http://elsewhere")[0] == 403
        assert ask(url, path, token=TOKEN)[0] == 405  # GET changes nothing
    assert (folder / "day 0").is_dir()
    assert not (folder / "day 0" / "notes.json").exists()


def test_a_deleted_run_is_whole_in_its_new_place_and_can_be_moved_back(changed: tuple[Path, str]) -> None:
    folder, url = changed
    files = {path.name: path.read_bytes() for path in (folder / "day 3").iterdir()}
    assert ask(url, "/api/delete", {"run": "day 3", "confirmed": "day"}, TOKEN)[0] == 400
    assert ask(url, run_page("day 3") + "api/moment?axis=0&from=1&to=1", token=TOKEN)[0] == 200  # its page is open
    status, _, found = ask(url, "/api/delete", {"run": "day 3", "confirmed": "day 3"}, TOKEN)
    to = Path(found["to"])
    assert (status, to.parts[-3], to.name) == (200, ".deleted", "day 3")
    assert not (folder / "day 3").exists()
    assert "day 3" not in rows(url, token=TOKEN)[0]["names"]
    assert ask(url, run_page("day 3") + "api/moment?axis=0&from=1&to=1", token=TOKEN)[0] == 400
    assert {path.name: path.read_bytes() for path in to.iterdir()} == files
    to.rename(folder / "day 3")
    assert RunRecord.open(folder / "day 3").damages == []


def test_a_run_that_is_being_recorded_is_not_deleted(changed: tuple[Path, str]) -> None:
    folder, url = changed
    recording = Lock(folder / "day 4")
    status, _, found = ask(url, "/api/delete", {"run": "day 4", "confirmed": "day 4"}, TOKEN)
    assert (status, "another process records" in found["error"]) == (400, True)
    assert (folder / "day 4" / "run.json").is_file()
    recording.release()
    assert ask(url, "/api/delete", {"run": "day 4", "confirmed": "day 4"}, TOKEN)[0] == 200


def test_a_run_is_shown_while_it_is_recorded_and_after_it_was_killed(tmp_path: Path) -> None:
    killed = tmp_path / "runs" / "killed"
    with Watched(tmp_path / "runs" / "now") as watched:
        watched.go(8000)
        catalogue = RunCatalogue(tmp_path / "runs")
        assert [row["state"] for row in catalogue.rows(0)["runs"]] == ["recording"]
        assert any(point[1] == "Keff" for point in catalogue.trends(0)["runs"]["now"]["points"])
        with pytest.raises(RecordError, match="another process records"):
            delete(tmp_path / "runs" / "now")
        # A file that is being written can get its name while the directory is copied.
        shutil.copytree(tmp_path / "runs" / "now", killed, ignore=shutil.ignore_patterns("*.partial"))
    for path in killed.rglob("*"):
        os.utime(path, (BEGUN, BEGUN))
    catalogue.forget()
    states = {row["name"]: row["state"] for row in catalogue.rows(0)["runs"]}
    assert states == {"now": "finished", "killed": "stopped"}  # one was ended by a person
    assert delete(killed).is_dir()


def test_the_page_of_a_run_has_its_data_below_its_own_address(shown: tuple[Path, str], source: Path) -> None:
    folder, url = shown
    name = "a#b %2e?<i>&'\""
    copy_run(source, folder / name, begun=BEGUN)
    try:
        for one in (name, "day 5"):
            assert "<title>livebode" in ask(url, run_page(one))[2]
            connection = ask(url, run_page(one) + "api/export?axis=0&from=1&to=1&format=csv")
            assert (connection[0], "frequency" in connection[2]) == (200, True)
        assert ask(url, run_page("broken"))[0] == 400
        assert ask(url, run_page("nowhere"))[0] == 400
    finally:
        for path in (folder / name).iterdir():
            path.unlink()
        (folder / name).rmdir()


def test_at_most_eight_runs_are_open_and_the_idle_one_that_was_used_longest_ago_is_closed(
    source: Path, tmp_path: Path
) -> None:
    runs = [copy_run(source, tmp_path / str(i)) for i in range(OPEN_MAX + 2)]
    opened = OpenedRuns(Access(SERVING, print), lambda _: Starlette())

    async def use() -> None:
        async with contextlib.AsyncExitStack() as stack:
            pages = [await stack.enter_async_context(opened.opened(run)) for run in runs[:OPEN_MAX]]
            with pytest.raises(ServerError, match="8 runs are open"):
                await stack.enter_async_context(opened.opened(runs[OPEN_MAX]))
            assert await stack.enter_async_context(opened.opened(runs[3])) is pages[3]
        async with opened.opened(runs[0]) as again, opened.opened(runs[OPEN_MAX]):
            assert again is pages[0]
        async with opened.opened(runs[1]) as page:  # it gave its place to the ninth
            assert page is not pages[1]
        for run in runs:
            opened.close(run.name)

    asyncio.run(use())


def test_a_comparison_needs_two_runs_that_can_be_read(shown: tuple[Path, str]) -> None:
    _, url = shown
    for query in ("before=day%200&after=broken", "before=day%200", "before=day%200&after=nowhere", ""):
        assert ask(url, f"/compare?{query}")[0] == 400


def test_a_comparison_shows_a_logo_of_the_run_and_no_other_file_of_the_computer(source: Path, tmp_path: Path) -> None:
    logo = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1 1"><path d="M0 0h1v1z"/></svg>'
    runs = tmp_path / "runs"
    own = json.loads((source / "run.json").read_text("utf-8"))["configuration"]
    copy_run(source, runs / "before")
    for name, place in (("own", runs / "own"), ("foreign", tmp_path)):
        copy_run(source, runs / name, changes={"configuration": own | {"report": {"logo": str(place / "logo.svg")}}})
        (place / "logo.svg").write_text(logo)
    with serving(runs) as url:
        pages = {name: ask(url, f"/compare?before=before&after={name}")[2] for name in ("own", "foreign")}
    assert 'class="logo"' in pages["own"]
    assert "<img" not in pages["foreign"]
    assert "Before and after" in pages["foreign"]


def test_a_trend_is_the_median_of_the_fits_and_shows_the_known_change(shown: tuple[Path, str]) -> None:
    folder, url = shown
    found: dict[str, Any] = {}
    version, waiting = 0, 1
    while waiting:
        _, _, answer = ask(url, f"/api/trends?since={version}")
        version, waiting = answer["version"], answer["waiting"]
        found |= answer["runs"]
    points = {name: {(p[0], p[1]): p for p in trend["points"]} for name, trend in found.items()}
    table = next(map(pa.table, RunRecord.open(folder / "day 0").tables("parameters"))).to_pandas()
    fits = table[(table["name"] == "Keff") & (table["status"] == "ok")]
    model, _, unit, value, bound, low, high, time_s, unix_s, count = points["day 0"]["two-mass", "Keff"]
    assert (model, unit, count) == ("two-mass", "N/m", len(fits))
    assert value == pytest.approx(np.median(fits["value"]), rel=1e-12)
    assert bound == pytest.approx(1.959963984540054 * np.median(fits["sigma"]), rel=1e-12)
    assert low <= value <= high
    assert time_s in fits["time_s"].to_numpy()
    assert unix_s == BEGUN + time_s
    soft = points["day 4"]["two-mass", "Keff"]
    assert soft[3] / value == pytest.approx(SOFTER, rel=1e-12)
    assert soft[8] == pytest.approx(BEGUN + 4 * DAY_S + soft[7])
    assert points["no clock"]["two-mass", "Keff"][8] is None
    margin = RunRecord.open(folder / "day 0").summary["loop"]["margins"]["phase_margin"]
    assert points["day 0"]["margins", "phase_margin"][3:5] == [margin["value"], margin["bound_95"]]
    assert found["day 4"]["alarms"] == [[1.0, BEGUN + 4 * DAY_S + 1.0, "change", for_page(ALARM)]]
    assert (found["day 0"]["baseline"], found["day 5"]["baseline"]) == ("healthy.json", "other.json")
    many = ask(url, "/api/trend?run=day%200")[2]["quantities"]
    keff = next(q for q in many if q[1] == "Keff")
    assert 2 < len(keff[2]) <= 120
    assert keff[2][0] == BEGUN + keff[3][0]
    assert set(keff[4]) <= set(fits["value"])


def test_hostile_notes_are_not_followed_and_not_believed(source: Path, tmp_path: Path) -> None:
    secret = tmp_path / "secret"
    secret.write_text('{"format": "livebode notes", "version": 1, "tags": [], "text": "secret"}')
    for name, content in {
        "long": b" " * 40_000, "wrong": b'{"tags": [1]}', "nested": b"[" * 30_000, "newer": secret.read_bytes(),
    }.items():  # fmt: skip
        run = copy_run(source, tmp_path / "runs" / name)
        (run / "notes.json").write_bytes(content.replace(b'"version": 1', b'"version": 2'))
    run = copy_run(source, tmp_path / "runs" / "linked")
    (run / "notes.json").symlink_to(secret)
    pipe = copy_run(source, tmp_path / "runs" / "pipe")
    for name in ("run.json", "run-copy.json"):
        (pipe / name).unlink()
    os.mkfifo(pipe / "run.json")
    found = {row["name"]: row for row in RunCatalogue(tmp_path / "runs").rows(0)["runs"]}
    assert len(found) == 6
    for name in ("long", "wrong", "nested", "newer", "linked"):
        assert (found[name]["state"], found[name]["tags"]) == ("finished", [])
        assert "notes.json" in found[name]["notes"]
    assert found["pipe"]["state"] == "broken"


def test_a_directory_without_runs_is_refused_without_a_plug_in_that_measures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "empty").mkdir()
    monkeypatch.setattr(plugin_pages, "named", lambda _: {})
    found = livebode("view", tmp_path)
    assert (found.code, "no directory in it has one" in found.err) == (2, True)
