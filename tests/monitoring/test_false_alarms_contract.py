"""How often a false alarm may come, in the words of a person."""

from __future__ import annotations

import pytest

from livebode.core import UsageError
from livebode.monitoring import seconds_between
from tests.support.errors import refused

DAY_S = 86400.0


@pytest.mark.parametrize(
    ("words", "seconds"),
    [
        ("one in 30 days of motion", 30 * DAY_S),
        ("One false alarm in 30 days", 30 * DAY_S),
        ("once a year", 365.25 * DAY_S),
        ("a false alarm a day", DAY_S),
        ("twice a day", DAY_S / 2),
        ("2 per week", 3.5 * DAY_S),
        ("1 in 200 s", 200.0),
        ("every 3 hours", 10800.0),
        ("30 days", 30 * DAY_S),
        ("86400", DAY_S),
    ],
)
def test_rates_in_words_are_read_as_seconds_between_alarms(words: str, seconds: float) -> None:
    assert seconds_between(words) == pytest.approx(seconds)


@pytest.mark.parametrize("words", ["", "never", "once in a while", "0 per day", "one in 3 parsecs"])
def test_words_that_cannot_be_read_are_refused(words: str) -> None:
    with refused(UsageError, "unreadable", argument="false_alarms", value=words):
        seconds_between(words)


@pytest.mark.parametrize("words", ["-3", "nan", "0"])
def test_a_time_that_is_not_positive_is_refused(words: str) -> None:
    with refused(UsageError, "out-of-range", argument="false_alarms", value=words):
        seconds_between(words)
