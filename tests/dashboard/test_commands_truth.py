"""`livebode view`, `run --serve` and `demo --serve`: the address is printed, and the page there is the run's."""

from __future__ import annotations

import json
import sys
import urllib.request
from pathlib import Path

import numpy as np
import pytest

from livebode.core import install_command
from livebode.records import RunRecord
from tests.support.browser import Tab, chromium, until
from tests.support.command import livebode, signals, write_parquet
from tests.support.dashboards import Watched
from tests.support.demonstrated import already_learned, shown
from tests.support.peers.peer import PATIENCE_S
from tests.support.served import served


def test_the_demo_is_served_by_default_during_its_run_and_ends_by_itself(tmp_path: Path) -> None:
    out = tmp_path / "demo"
    with served(tmp_path, "demo", "--seconds", 16, "--out", out, before=already_learned(tmp_path)) as (process, url):
        assert url.startswith("http://127.0.0.1:")
        with chromium() as browser, Tab(browser, url) as tab:
            assert tab.js("page.facts.live")
            assert [q["why_not"] for q in tab.js("page.facts.quantities")] == [""] * 4
            assert tab.js("page.schedule.unit") == "m"
            first = tab.js("bode.curves.measured.frame.timeS[0]")
            tab.until(f"bode.curves.measured.frame.timeS[0] > {first} + 0.5")
            assert tab.wrong == []
        assert process.wait(PATIENCE_S) == 0
    assert "stiffness is 1" in (tmp_path / "log.txt").read_text()


def test_the_page_of_the_demo_stays_after_its_run_where_it_was_asked_for(
    tmp_path: Path,
) -> None:
    out = tmp_path / "demo"
    asked = ("demo", "--serve", "--fast", "--port", 0, "--out", out)
    with served(tmp_path, *asked, before=already_learned(tmp_path)) as (_, url):
        with chromium() as browser, Tab(browser, url) as tab:
            tab.until("!timeline.span.live")  # the run is done, and the page stays
            assert (out / "run.json").is_file()
            last = RunRecord.open(out).responses()
            at_s = float(last.time_s[last.valid.any(axis=1)][-1])
            tab.until(f"bode.curves.measured.frame.timeS[0] === {at_s!r}")
            assert tab.js("document.getElementById('status-text').textContent") == "demo · recorded"
            (change,) = [event.message for event in RunRecord.open(out).events() if event.kind == "change"]
            tab.until(f"document.getElementById('events').textContent.includes({json.dumps(change)})")
            assert tab.wrong == []
        # The page knows of the end before the summary is printed.
        until(lambda: change in (tmp_path / "log.txt").read_text(), "the alarm on the terminal")
    # The same seed gives the same run.
    assert np.array_equal(last.value, RunRecord.open(shown()[0]).responses().value, equal_nan=True)


def test_a_recording_is_shown_by_run(tmp_path: Path) -> None:
    log = write_parquet(tmp_path / "log.parquet", signals(20_000))
    arguments = [
        "run",
        log,
        "--excitation",
        "w",
        "--output",
        "y",
        "--input",
        "u",
        "--lines",
        "50,100,200",
        "--window",
        100,
    ]
    out = tmp_path / "run"
    with served(tmp_path, *arguments, "--serve", "--port", 0, "--out", out) as (_, url):
        until(lambda: (out / "run.json").is_file(), "the end of the run")
        until(lambda: "until Ctrl-C" in (tmp_path / "log.txt").read_text(), "the end of what it prints")
        until(lambda: b"livebode" in urllib.request.urlopen(url).read(), "the page")
    assert "serve" not in json.loads((out / "run.json").read_text())["configuration"]


def test_view_follows_a_run_that_another_process_records(tmp_path: Path) -> None:
    with Watched(tmp_path / "run") as watched:
        watched.go(6000)
        viewing = served(tmp_path, "view", tmp_path / "run", "--port", 0)
        with viewing as (_, url), chromium() as browser, Tab(browser, url) as tab:
            before = tab.js("timeline.span.last_s ?? 0")
            watched.go(11_000)
            tab.until(f"timeline.span.last_s > {before} + 0.5")
            assert tab.js("document.getElementById('status-text').textContent") == "run · being recorded"
            at_s = tab.js("bode.curves.measured.frame.timeS[0]")
            assert at_s in watched.record().responses().time_s
            assert tab.wrong == []


def test_view_asks_for_the_token_of_the_file_that_it_is_given(tmp_path: Path) -> None:
    run = shown()[0]
    (tmp_path / "token").touch(0o600)
    (tmp_path / "token").write_text("x" * 32)
    (tmp_path / "serve.toml").write_text('[serve]\nport = 0\ntoken_file = "token"\n')
    with served(tmp_path, "view", run, "--axis", tmp_path / "serve.toml") as (_, url):
        assert urllib.request.urlopen(url).url.endswith("/login")
        known = urllib.request.Request(url, headers={"Authorization": f"Bearer {'x' * 32}"})
        assert not urllib.request.urlopen(known).url.endswith("/login")


def test_view_of_a_file_or_without_what_serves_it_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "servo.csv").write_text("t,y\n0,1\n")
    result = livebode("view", tmp_path / "servo.csv")
    assert (result.code, result.err.count("\n")) == (2, 1)
    assert "not the directory of a run" in result.err
    (tmp_path / "axis.toml").write_text(
        '[source]\nlog = "x.csv"\n[signals]\noutput = "y"\n[serve]\naddress = "0.0.0.0"\n'
    )
    result = livebode("run", tmp_path / "axis.toml", "--serve")
    assert result.code == 2
    assert "requires a token" in result.err
    assert "secrets.token_urlsafe" in result.err
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    log = write_parquet(tmp_path / "log.parquet", signals(2000))
    options = ("--lines", "50,100,200", "--window", 100, "--out", tmp_path / "run")
    assert livebode("run", log, "--excitation", "w", "--output", "y", "--input", "u", *options).code == 0
    result = livebode("view", tmp_path / "run")
    assert result.code == 2
    assert install_command("dashboard") in result.err
