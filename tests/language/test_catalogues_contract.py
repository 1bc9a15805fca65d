"""The catalogues: every sentence in each language, with its values and plural forms, and nothing else."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache

import pytest

from livebode.analysis import MARGIN_NAMES as MARGINS
from livebode.analysis import MARGIN_WORDS
from livebode.dashboard.quantities import QUANTITIES
from livebode.fitting import model_named
from livebode.fitting.extended import WORDS as EFFECTS
from livebode.fitting.extended import ExtendedModel
from livebode.fitting.models import MODELS
from livebode.fitting.rows import SENTENCES as FITS
from livebode.language import available
from livebode.monitoring import ALARMS, RETURNS
from livebode.monitoring.sensitivity import DIRECTIONS
from livebode.monitoring.sentences import WHAT
from tools import catalogues as tool
from tools.catalogues import FOLDER, VALUES, catalogues, extracted, json_text, po_text, translated, updated

_PLACE = re.compile(r"\{\w*(?::[^}]*)?\}")
_OF_MESSAGE = re.compile(r"\{\w+(?::\+?,?(?:\.\d\d?)?[a-z]?)?\}")
LANGUAGES = sorted(catalogues())


@cache
def keys() -> dict[str, object]:
    """The extracted sentences, by the English singular."""
    return {key if isinstance(key, str) else key[0]: key for key in extracted()}


@pytest.mark.parametrize("code", LANGUAGES)
def test_each_sentence_is_translated_and_none_is_superfluous(code: str) -> None:
    catalogue = catalogues()[code]
    known = {m.id if isinstance(m.id, str) else m.id[0]: m for m in catalogue if m.id}
    assert not keys().keys() - known.keys(), "missing: run make catalogues"
    assert not known.keys() - keys().keys(), "superfluous: run make catalogues"
    assert not [key for key, message in known.items() if not translated(message)], "without translation"


@pytest.mark.parametrize("code", LANGUAGES)
def test_a_translation_has_the_values_of_the_sentence_and_all_plural_forms(code: str) -> None:
    catalogue = catalogues()[code]
    for message in catalogue:
        if not message.id:
            continue
        every = [message.id] if isinstance(message.id, str) else list(message.id)
        found = [message.string] if isinstance(message.id, str) else list(message.string)
        assert len(found) == (1 if isinstance(message.id, str) else catalogue.num_plurals), message.id
        for text in found:
            assert set(_PLACE.findall(text)) == set(_PLACE.findall(every[-1])), (message.id, text)


@pytest.mark.parametrize("code", LANGUAGES)
def test_a_translation_has_no_blank_at_its_ends_that_the_sentence_has_not(code: str) -> None:
    """What is cut off at an end often leaves a blank; the sentence has none there."""
    for message in (message for message in catalogues()[code] if message.id):
        english = [message.id] if isinstance(message.id, str) else list(message.id)
        for text in [message.string] if isinstance(message.id, str) else list(message.string):
            assert (text == text.strip()) or english[0] != english[0].strip(), (english[0], text)


@pytest.mark.parametrize("code", LANGUAGES)
def test_the_files_are_those_that_make_catalogues_writes(code: str) -> None:
    new = updated(catalogues()[code])
    assert (FOLDER / f"{code}.po").read_bytes() == po_text(new)
    assert (FOLDER / f"{code}.json").read_text("utf-8") == json_text(new)
    assert code.replace("_", "-") in available()


@cache
def texts() -> tuple[str, ...]:
    """The text of the modules of the package and its wings."""
    return tuple(path.read_text("utf-8") for path in tool.sources("*.py"))


@cache
def calls() -> tuple[ast.Call, ...]:
    """The calls of modules that translate or report, also within f-strings."""
    used = (text for text in texts() if re.search(r"\b(?:trn?|Message|Event|report|_report_to_axes)\(", text))
    return tuple(n for text in used for n in ast.walk(ast.parse(text)) if isinstance(n, ast.Call) and n.args)


def called() -> Iterator[str]:
    """First arguments of `tr`, `trn` and `Message`; that of a message may be a name that is data."""
    for node in calls():
        if isinstance(node.func, ast.Name) and node.func.id in ("tr", "trn", "Message"):
            first = node.args[0]
            if isinstance(first, ast.Constant):
                yield first.value
            else:
                assert node.func.id == "Message", ast.unparse(node)
                assert not any(keyword.arg for keyword in node.keywords), ast.unparse(node)


def test_every_call_is_found_by_the_extraction() -> None:
    python = set(called())
    script = "\n".join(path.read_text("utf-8") for path in tool.sources("static/*.js") if path.name != "language.js")
    assert set(re.findall(r"\btrn?\(\s*(.)", script)) == {'"'}, "an argument of tr is not a literal"
    called_there = set(re.findall(r'\btrn?\(\s*"((?:[^"\\]|\\.)*)"', script))
    assert len(called_there) > 100
    assert not (python | called_there) - keys().keys()


def kinds() -> set[str]:
    """The kinds of events that the package writes: first argument of Event(…), report(…) and the like."""
    found = set()
    for node in calls():
        if isinstance(node.args[0], ast.Constant):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            kind = str(node.args[0].value)
            if name in ("Event", "report", "_report_to_axes") and re.fullmatch("[a-z]+(-[a-z]+)*", kind):
                found.add(kind)
    return found | ALARMS.keys() | RETURNS.keys()


def test_kinds_parameters_statuses_and_margins_have_names() -> None:
    shown = {*QUANTITIES, *DIRECTIONS, *WHAT.values(), *EFFECTS.values(), *FITS, *MARGIN_WORDS.values(), *kinds()}
    for model in map(model_named, MODELS):
        extended = ExtendedModel(
            model, tuple(e for e in EFFECTS if e in ("lag", "residual compliance", "further mode")), 100.0
        )
        shown |= {name.replace("_", " ") for name in (*extended.names, *model.derived_names)} | {model.name}
    shown |= {name.replace("_", " ") for name in MARGINS}
    assert not shown - keys().keys()
    assert not set(FITS.values()) - keys().keys()


def test_the_places_of_a_message_can_be_filled_each_once() -> None:
    for node in calls():
        if isinstance(node.func, ast.Name) and node.func.id == "Message" and isinstance(node.args[0], ast.Constant):
            template = node.args[0].value
            places = _OF_MESSAGE.findall(template)
            assert places == _PLACE.findall(template), template
            assert len(set(places)) == len(places), template
            assert not {"template", "digits"} & {keyword.arg for keyword in node.keywords}, template


def test_a_value_is_one_that_the_package_writes() -> None:
    every = "\n".join(texts()).replace("_", " ")
    assert not [name for name in VALUES if name not in every]
