"""Times of day in recorded sentences."""

from __future__ import annotations

import time
from collections.abc import Iterator
from datetime import UTC, datetime

import pytest

from livebode.core.clock import date_and_time
from livebode.dashboard.message_times import times_in


@pytest.fixture
def berlin(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("TZ", "Europe/Berlin")
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()


@pytest.mark.usefixtures("berlin")
def test_times_are_found_as_they_were_written_also_in_the_hour_that_is_passed_twice() -> None:
    moments = [datetime(2026, 10, 25, hour, 30, tzinfo=UTC).timestamp() for hour in (0, 1)]
    words = [date_and_time(moment) for moment in moments]
    assert [text.split()[1:] for text in words] == [["02:30:00", "CEST"], ["02:30:00", "CET"]]
    message = f"At {words[1]} the stiffness is as in the baseline again; it had changed since {words[0]}."
    assert times_in(message) == [(words[1], moments[1]), (words[0], moments[0])]


@pytest.mark.usefixtures("berlin")
@pytest.mark.parametrize(
    "text", ["2026-01-05 07:30:00 PST", "2026-13-05 07:30:00 CET", "2026-07-05 07:30:00 CET", "20.3 s"]
)
def test_what_is_no_time_of_this_zone_is_left_as_it_is(text: str) -> None:
    assert times_in(f"Since {text} the stiffness is less.") == []
