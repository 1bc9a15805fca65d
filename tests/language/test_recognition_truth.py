"""Recorded sentences in another language: every template, real messages, and the page's implementation."""

from __future__ import annotations

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core.clock import RunClock, moment, moments_by
from livebode.language import current_language, in_language, number, recognised, tr, trn
from livebode.language.recorded import SENTENCES
from tests.support.languages import filled


@pytest.mark.parametrize("code", ["de", "zh-CN"])
def test_each_template_gives_its_own_translation_with_the_values(code: str) -> None:
    with in_language(code):
        for english, translation in current_language().recorded:
            assert recognised(filled(english)) == filled(translation, number(12.5)), english


@settings(max_examples=30)
@given(st.lists(st.sampled_from(SENTENCES), min_size=1, max_size=4))
def test_several_sentences_are_translated_one_by_one(templates: list[str]) -> None:
    ends = [filled(template).rstrip(".;") + "." for template in templates]
    with in_language("de"):
        every = recognised(" ".join(ends))
        assert every == " ".join(recognised(end) for end in ends)


@settings(max_examples=30)
@given(st.text())
def test_what_no_template_fits_stays_as_it_is_and_english_is_unchanged(text: str) -> None:
    assert recognised(text) == text
    with in_language("de"):
        assert recognised(f"Ω{text}Ω") == f"Ω{text}Ω"


def test_messages_of_an_alarm_a_gap_and_a_group_in_german() -> None:
    with in_language("de"):
        assert recognised(
            "Since 2026-03-01 07:30:05 CET the belt's stiffness around position 0.31 is 10.06 ± 0.07 % less than in "
            "the baseline; a possible alternative: the moved mass is 3.1 ± 0.2 % more."
        ) == (
            "Seit 01.03.2026 07:30:05 CET: Steifigkeit des Riemens um Position 0,31 um 10,06 ± 0,07 % kleiner als in "
            "der Referenz; mögliche andere Ursache: bewegte Masse um 3,1 ± 0,2 % größer."
        )
        assert recognised(
            "12 samples are missing before sample 81600; responses are invalid until a window of 400 samples is "
            "complete again (1,234 events of this cause in 4.5 s)"
        ) == (
            "12 Abtastwerte fehlen vor Abtastwert 81600; die Frequenzgänge sind ungültig, bis ein Fenster von 400 "
            "Abtastwerten wieder vollständig ist (1.234 Ereignisse dieser Ursache in 4,5 s)"
        )
        assert recognised("file 'a.b,c.csv' was lost") == "file 'a.b,c.csv' was lost"


def test_numbers_dates_and_plural_forms_follow_the_language_and_only_in_its_context() -> None:
    with moments_by(RunClock([(0.0, 1.7e9)])):
        english = moment(12.25)
        with in_language("de"):
            assert number(-1234.5, ",.1f") == "-1.234,5"
            assert (trn("{n:,} gap", "{n:,} gaps", 1), trn("{n:,} gap", "{n:,} gaps", 2)) == ("1 gap", "2 gaps")
            assert trn("{n:,} line", "{n:,} lines", 1001) == "1.001 Linien"
            assert re.fullmatch(r"\d\d\.\d\d\.2023 \d\d:\d\d:\d\d \S+", moment(12.25))
        with in_language("zh-CN"):
            assert moment(12.25).startswith("2023年11月")
        assert moment(12.25) == english
    assert tr("time in s") == "time in s"
    with pytest.raises(KeyError), in_language("xx"):
        pass
