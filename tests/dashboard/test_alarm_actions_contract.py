"""What a person does with an alarm is in the run's record: a later view, a restart and the next run know it."""

from __future__ import annotations

import json
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from livebode.analysis import Overview
from livebode.core import Event
from livebode.dashboard import AlarmShelf, Dashboard, Hub, ServerSettings
from livebode.dashboard.alarm_requests import shelving, unshelving
from livebode.dashboard.board import AxisVerdict, verdict
from livebode.dashboard.notices import event_id
from livebode.dashboard.state import State
from livebode.runtime import RunControl, RunEnded, RunStarted
from tests.support.browser import until
from tests.support.dashboards import LINES, Watched, begin

CHANGE = Event("change", 6000, 1.5, "stiffness is 9 % less", {"what": "stiffness", "amount_percent": -9.0})
PERSON = {"by": "Ann <b>", "reason": "waiting for the new belt", "minutes": 30}


@pytest.fixture
def watched(tmp_path: Path) -> Iterator[Watched]:
    with Watched(tmp_path / "run") as found:
        found.go(6400)
        found.hub.control.record(CHANGE)  # type: ignore[union-attr]
        found.go(6800)
        yield found


def post(url: str, path: str, **body: Any) -> tuple[int, str]:
    """Status and error of a request for the alarm."""
    data = json.dumps({"axis": 0, "event": event_id(CHANGE)} | body).encode()
    headers = {"Content-Type": "application/json", "Origin": url.rstrip("/")}
    try:
        with urllib.request.urlopen(urllib.request.Request(f"{url}{path}", data, headers)) as answer:
            return answer.status, ""
    except urllib.error.HTTPError as error:
        return error.code, json.loads(error.read())["error"]


def recorded(watched: Watched, kind: str) -> list[Event]:
    return [event for event in watched.record().events() if event.kind == kind]


def state_of(state: State, cause: str = "change: stiffness") -> str | None:
    notice = state.notices.named(cause)
    return None if notice is None else state.notices.state(notice)


def test_a_shelf_is_recorded_and_survives_a_restart(watched: Watched) -> None:
    until(lambda: state_of(watched.dashboard._states[0]) == "unacknowledged", "the alarm")
    assert post(watched.url, "api/acknowledge", by="Ann", comment="seen at the machine")[0] == 202
    assert post(watched.url, "api/shelve", **PERSON)[0] == 202
    watched.go(8000)
    until(lambda: len(recorded(watched, "shelved")) == 1, "the record")
    (shelved,), (seen,) = recorded(watched, "shelved"), recorded(watched, "acknowledged")
    assert seen.message == "acknowledged by Ann (seen at the machine): stiffness is 9 % less"
    assert (seen.details["by"], seen.details["comment"]) == ("Ann", "seen at the machine")
    assert {name: shelved.details[name] for name in ("by", "reason")} == {
        name: PERSON[name] for name in ("by", "reason")
    }
    assert 0 < shelved.details["until_s"] - time.time() <= 30 * 60
    watched.end()
    viewing = Dashboard(ServerSettings("127.0.0.1", 0))
    viewing.view(watched.directory)
    assert state_of(viewing._states[0]) == "shelved"
    hub, control = Hub("axis"), RunControl()
    again = State("axis", 0, hub)
    hub(RunStarted(watched.directory, watched.record().summary, control, Overview()))  # the record continues
    again.refresh()
    assert state_of(again) == "shelved"
    notice = again.notices.named("change: stiffness")
    again.add([unshelving("change: stiffness", 1, 1.0, notice, "Bea")])
    assert state_of(again) == "acknowledged"


def test_what_is_not_possible_is_refused_in_a_sentence(watched: Watched) -> None:
    until(lambda: state_of(watched.dashboard._states[0]) is not None, "the alarm")
    assert post(watched.url, "api/shelve", event="unknown", **PERSON) == (
        400,
        "there is no event 'unknown'; reload the page",
    )
    status, error = post(watched.url, "api/shelve", by="Ann")
    assert (status, error) == (400, "reason is not a text of 1 to 200 letters; shorten it, or add it")
    status, error = post(watched.url, "api/acknowledge", by="x" * 5000)
    assert (status, error.partition(";")[0]) == (400, "the request is not a short JSON object")
    quiet = next(e for e in recorded(watched, "non-finite"))
    status, error = post(watched.url, "api/shelve", event=event_id(quiet), **PERSON)
    assert (status, error) == (400, "this event is not an alarm; shelve alarms only")
    assert post(watched.url, "api/unshelve", by="Ann")[0] == 202, "nothing to do"
    assert recorded(watched, "unshelved") == []


def begun(folder: Path) -> tuple[Hub, State]:
    hub = Hub("axis")
    state = State("axis", 0, hub)
    begin(hub, folder, LINES)
    hub(CHANGE)
    state.refresh()
    return hub, state


def test_a_shelf_ends_by_itself_once(tmp_path: Path) -> None:
    hub, state = begun(tmp_path)
    notice = state.notices.named("change: stiffness")
    hub(shelving("change: stiffness", AlarmShelf("Ann", time.time() - 0.1, "test"), 1, 1.0, notice))
    state.refresh()
    assert hub.control is not None
    for _ in range(3):
        state.end_shelves()
    (ended,) = hub.control.take_recorded()
    assert (ended.kind, ended.message) == ("unshelved", "unshelved at its time: stiffness is 9 % less")
    hub(ended)
    state.refresh()
    state.end_shelves()
    assert hub.control.take_recorded() == []
    assert state_of(state) == "unacknowledged"


def test_the_run_that_continues_after_an_edit_has_the_shelf(tmp_path: Path) -> None:
    hub, state = begun(tmp_path)
    hub(shelving("change: stiffness", AlarmShelf("Ann", time.time() + 100, "test"), 1, 1.0))
    state.refresh()
    control, summary = hub.control, hub.begun
    assert control is not None
    assert summary is not None
    for next_control, shelved in ((control, 1), (RunControl(), 0)):  # another session has another control
        hub(RunEnded(dict(summary)))
        hub(RunStarted(tmp_path / "next", dict(summary), next_control, Overview()))
        state.refresh()
        found = next_control.take_recorded()
        assert [event.details["cause"] for event in found] == ["change: stiffness"] * shelved
        for event in found:
            state.add([event])


def test_the_verdict_names_what_matters_most(tmp_path: Path) -> None:
    hub = Hub("axis")
    state = State("axis", 0, hub)

    def after(*events: Event) -> AxisVerdict:
        for event in events:
            hub(event)
        state.refresh()
        return verdict(state)

    assert (after().tone, after().word) == ("open", "not-begun")
    begin(hub, tmp_path, LINES)
    hub.followed_s = time.monotonic()
    assert (after().tone, after().word) == ("open", "no-baseline")
    state._summary = dict(state._summary) | {"configuration": {"monitoring": {"baseline": "healthy.npz"}}}
    assert (after().tone, after().word) == ("ok", "healthy")
    found = after(Event("idle", 1, 0.1, "at standstill", {"what": ["stiffness"], "reason": "slow", "since_s": 0.05}))
    assert (found.tone, found.word, found.since_s) == ("open", "not-monitored", 0.05)
    assert after(Event("monitored-again", 1, 0.1, "again", {"what": ["stiffness"]})).word == "healthy"
    found = after(Event("gap", 1, 0.1, "a gap"), Event("loss", 1, 0.1, "a loss"))
    assert (found.tone, found.word, found.count) == ("check", "alarms", 2)
    found = after(Event("change", 2, 0.9, "softer", {"what": "stiffness", "amount_percent": -2.0, "since_s": 0.4}))
    assert (found.tone, found.word, found.since_s, found.facts["amount_percent"]) == ("alarm", "change", 0.4, -2.0)
    shelf = AlarmShelf("Ann", time.time() + 60, "test")
    found = after(shelving("change: stiffness", shelf, 3, 1.0))
    assert (found.tone, found.word) == ("check", "alarms"), "a shelved difference is not announced"
    for cause in ("gap", "loss"):
        found = after(shelving(cause, shelf, 3, 1.0))
    assert (found.tone, found.word) == ("check", "shelved"), "and it is not healthy either"
    hub.followed_s = time.monotonic() - 12
    found = after()
    assert (found.tone, found.word) == ("check", "silent")
    assert found.seconds == pytest.approx(12, abs=5)
