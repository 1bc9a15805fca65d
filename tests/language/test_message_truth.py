"""Messages: English text, the language in use, their plain form, and what a page gets."""

from __future__ import annotations

import json
import pickle
import re
from copy import deepcopy

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import Event, GridError, RunClock, moment, moments_by
from livebode.language import Message, for_page, in_language, number, recorded, tr, trn, worded

CHANGE = Message(
    "Since {since} {change}; a possible alternative: {alternative}.",
    since="2026",
    change=Message(
        "{part} is {size} % {way} than {reference}",
        part=Message("{part} around position {position:.3g}", part=Message("the belt's stiffness"), position=0.31),
        size=Message("{size:.2f} ± {bound:.2f}", size=10.06, bound=0.07),
        way=Message("less"),
        reference=Message("in the baseline"),
    ),
    alternative=Message(
        "{part} is {size} % {way}",
        part=Message("the moved mass"),
        size=Message("{size:.1f} ± {bound:.1f}", size=3.1, bound=0.2),
        way=Message("more"),
    ),
)


def test_a_message_is_its_english_text_and_its_facts_make_the_same_sentence_in_german() -> None:
    assert CHANGE == (
        "Since 2026 the belt's stiffness around position 0.31 is 10.06 ± 0.07 % less than in the baseline; a possible "
        "alternative: the moved mass is 3.1 ± 0.2 % more."
    )
    with in_language("de"):
        assert worded(CHANGE) == (
            "Seit 2026: Steifigkeit des Riemens um Position 0,31 um 10,06 ± 0,07 % kleiner als in der Referenz; "
            "mögliche andere Ursache: bewegte Masse um 3,1 ± 0,2 % größer."
        )
        assert worded("file 'a.b,c.csv' was lost") == "file 'a.b,c.csv' was lost"
        assert worded("no response") == "kein Frequenzgang"


@pytest.mark.parametrize("copied", [deepcopy(CHANGE), pickle.loads(pickle.dumps(CHANGE))])
def test_a_copy_has_the_same_facts(copied: Message) -> None:
    assert (copied, copied.template, copied.facts) == (CHANGE, CHANGE.template, CHANGE.facts)


def test_an_event_records_the_facts_of_its_message_beside_the_text() -> None:
    event = Event("gap", 900, 0.2, Message("{missing_samples} samples were lost", missing_samples=1200), {"more": 3})
    assert type(event.message) is str
    assert event.details == {"more": 3, "template": "{missing_samples} samples were lost", "missing_samples": 1200}
    again = Event("gap", 900, 0.2, event.message, json.loads(json.dumps(event.details)))
    with in_language("de"):
        assert worded(again.words) == "1200 Abtastwerte verloren"
    assert Event("gap", 900, 0.2, "a gap").words == "a gap"


def test_of_an_error_the_place_and_the_remedy_are_worded_too() -> None:
    error = GridError("line-off", Message("there is no response yet"), Message("wait for the first window"))
    assert str(error.at("axis x")) == "axis x: there is no response yet; wait for the first window"
    with in_language("de"):
        inner = worded(error.words)
        assert inner != str(error)
        assert worded(error.at("axis x").words) == f"axis x: {inner}"
        assert worded(Message("No parameters: {why}.", why=error)) == f"Keine Parameter: {inner}."


FACTS = st.one_of(st.integers(), st.floats(), st.text(), st.lists(st.text(), max_size=3), st.just(CHANGE))


@settings(max_examples=50)
@given(FACTS, FACTS)
def test_the_plain_form_gives_the_message_again(one: object, other: object) -> None:
    message = Message("{one} and {other}", one=one, other=other)
    read = recorded(json.loads(json.dumps(message.plain())), "")
    with in_language("de"):
        assert (read, worded(read)) == (str(message), worded(message))


@pytest.mark.parametrize(
    "plain",
    [
        {"template": 3},
        {"template": "{absent}"},
        {"template": "{x:.1f}", "x": "text"},
        {"template": "{x}{x}", "x": 1},
        {"template": "{x}", "x": {"digits": 1}},
        {"template": "{x}", "x": {"no template": 1}},
        {"template": "{x}", "x": {"time_s": 0.0, "unix_s": 1e300, "digits": 1}},
    ],
)
def test_of_a_damaged_plain_form_the_text_remains(plain: dict[str, object]) -> None:
    assert recorded(plain, "the text") == "the text"


def test_a_page_gets_formatted_numbers_and_moments_with_their_seconds_since_1970() -> None:
    with moments_by(RunClock([(0.0, 1.7e9)])):
        dated = Message("Monitored again since {at}.", at=moment(12.25))
    assert for_page(Message("{samples:,.1f} ± {channel}", samples=1234.5, channel="a.b")) == [
        "{samples:,.1f} ± {channel}",
        {"samples": {"number": "1,234.5"}, "channel": "a.b"},
    ]
    text = str(dated).removeprefix("Monitored again since ").removesuffix(".")
    assert for_page(dated) == ["Monitored again since {at}.", {"at": {"unix_s": 1.7e9 + 12.25, "text": text}}]
    assert for_page("a channel") == "a channel"
    assert for_page(Message("{items}", items=["a", 2])) == ["{items}", {"items": {"list": ["a", {"number": "2"}]}}]


def test_numbers_dates_and_plural_forms_follow_the_language_and_only_in_its_context() -> None:
    with moments_by(RunClock([(0.0, 1.7e9)])):
        english = moment(12.25)
        since = Message("Monitored again since {at}.", at=english)
        with in_language("de"):
            assert number(-1234.5, ",.1f") == "-1.234,5"
            assert (trn("{n:,} gap", "{n:,} gaps", 1), trn("{n:,} gap", "{n:,} gaps", 2)) == ("1 gap", "2 gaps")
            assert trn("{n:,} line", "{n:,} lines", 1001) == "1.001 Linien"
            assert re.fullmatch(r"\d\d\.\d\d\.2023 \d\d:\d\d:\d\d \S+", moment(12.25))
            assert re.fullmatch(r"Seit \d\d\.\d\d\.2023 \d\d:\d\d:\d\d \S+ wieder überwacht\.", worded(since))
        with in_language("zh-CN"):
            assert moment(12.25).startswith("2023年11月")
        assert moment(12.25) == english
    assert tr("time in s") == "time in s"
    with pytest.raises(KeyError), in_language("xx"):
        pass
