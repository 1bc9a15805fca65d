"""Times of day in messages."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from datetime import UTC, datetime

import pytest

from livebode.core import Event, RunClock, moment, moments_by
from livebode.language import Message, for_page, in_language, worded


@pytest.fixture
def berlin(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("TZ", "Europe/Berlin")
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()


@pytest.mark.usefixtures("berlin")
def test_a_page_gets_the_moments_of_a_recorded_message_also_in_the_hour_that_is_passed_twice() -> None:
    times = [datetime(2026, 10, 25, hour, 30, tzinfo=UTC).timestamp() for hour in (0, 1)]
    with moments_by(RunClock([(0.0, 0.0)])):
        first, second = map(moment, times)
        message = Message(
            "At {time} {part} is as {before} again; it had changed since {since}.",
            time=second,
            part=Message("the belt's stiffness"),
            before=Message("in the baseline"),
            since=first,
        )
    assert [text.split()[1:] for text in (first, second)] == [["02:30:00", "CEST"], ["02:30:00", "CET"]]
    details = json.loads(json.dumps(Event("change-cleared", 0, 0.0, message).details))
    _, facts = for_page(Event("change-cleared", 0, 0.0, str(message), details).words)
    assert [facts[name] for name in ("time", "since")] == [
        {"unix_s": times[1], "text": str(second)},
        {"unix_s": times[0], "text": str(first)},
    ]


@pytest.mark.usefixtures("berlin")
@pytest.mark.parametrize("time_s", [20.3, float("nan"), 1e12])
def test_a_time_of_no_known_day_is_seconds_of_the_run(time_s: float) -> None:
    with moments_by(RunClock([(0.0, 0.0)]) if time_s == 1e12 else RunClock([])):
        since = moment(time_s)
    assert for_page(Message("{since}", since=since)) == ["{since}", {"since": {"unix_s": None, "text": str(since)}}]
    with in_language("de"):
        assert worded(since) == str(since).replace(".", ",")
