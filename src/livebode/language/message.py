"""Message: a sentence as its template and its facts, so that no reader has to find the values in the words.

The template is the English sentence with places for its facts, as in the message templates of structured logs
(messagetemplates.org). It stands where the message is made and nowhere else, and is the key of the translations.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from datetime import datetime
from functools import reduce
from math import isfinite
from numbers import Integral, Real
from typing import Any

from livebode.language.translation import ENGLISH, Catalogue, current_language, numerals

_PLACE = re.compile(r"\{(\w+)(?::(\+?,?(?:\.\d\d?)?[a-z]?))?\}")
_TEMPLATE, _MOMENT = "template", "digits"  # names that tell the plain form of a message and of a moment
_INVALID = ArithmeticError, AttributeError, LookupError, OSError, RecursionError, TypeError, ValueError


class Message(str):
    """The English sentence, with the template and the facts from which `worded` makes it in another language.

    Parameters
    ----------
    template
        A literal: `make catalogues` finds it here. Its places are ``{name}`` or ``{name:.3g}``.
    **facts
        Numbers, texts that no language changes (names of channels, paths), messages, moments, and lists of these,
        which are separated by semicolons. Of an error or an event, its `words`; of anything else, its text.

    Examples
    --------
    >>> from livebode.language import in_language, worded
    >>> lost = Message("{missing_samples} samples were lost", missing_samples=12)
    >>> with in_language("de"):
    ...     lost, lost.facts, worded(lost)
    ('12 samples were lost', {'missing_samples': 12}, '12 Abtastwerte verloren')
    """

    template: str
    facts: dict[str, Any]

    def __new__(cls, template: str, /, **facts: Any) -> Message:
        facts = {name: _fact(fact) for name, fact in facts.items()}
        own = super().__new__(cls, _filled(template, facts, ENGLISH))
        own.template, own.facts = template, facts
        return own

    def __getnewargs_ex__(self) -> tuple[tuple[str], dict[str, Any]]:
        return (self.template,), self.facts

    @classmethod
    def sentences(cls, parts: Iterable[str]) -> Message:
        """Several messages, one after the other.

        >>> Message.sentences(["No change.", "Not monitored for 3 s."])
        'No change. Not monitored for 3 s.'
        """
        facts = {f"s{number}": part for number, part in enumerate(parts)}
        return cls(" ".join(f"{{{name}}}" for name in facts), **facts)

    @classmethod
    def conjunction(cls, parts: Iterable[str]) -> str:
        """The parts with "and" between them.

        >>> Message.conjunction(["a delay", "a lag", "a further mode"])
        'a delay and a lag and a further mode'
        """
        return reduce(lambda before, other: cls("{one} and {other}", one=before, other=other), parts)

    def plain(self) -> dict[str, Any]:
        """Template and facts for JSON; see `recorded`."""
        return {_TEMPLATE: self.template} | {name: _plain(fact) for name, fact in self.facts.items()}


class Moment(str):
    """A time of a run as text, with its seconds since 1970 where they are known."""

    time_s: float
    unix_s: float | None
    digits: int

    def __new__(cls, time_s: float, unix_s: float | None, digits: int) -> Moment:
        own = super().__new__(cls, _moment(time_s, unix_s, digits, current_language()))
        own.time_s, own.unix_s, own.digits = time_s, unix_s, digits
        return own

    def __getnewargs__(self) -> Any:
        return self.time_s, self.unix_s, self.digits


def worded(text: str) -> str:
    """A message in the language in use; of another text, such as a status, the translation if there is one."""
    return _worded(text, current_language())


def quantity_name(name: str) -> str:
    """The words for a fitted quantity, in the language in use; files and Python have its symbol or name.

    >>> quantity_name("Keff"), quantity_name("resonance_damping"), quantity_name("phase_margin")
    ('belt stiffness', 'resonance damping ratio', 'phase margin')
    """
    return worded(name.replace("_", " "))


def recorded(plain: Mapping[str, Any], text: str) -> str:
    """The message with this plain form, which was recorded beside its English `text`; that, where there is none.

    >>> recorded({"template": "{samples} samples were lost", "samples": 12}, "12 samples were lost").facts
    {'samples': 12}
    """
    if _TEMPLATE not in plain:
        return text
    try:
        return _read(plain)
    except _INVALID:  # a record is untrusted data
        return text


def for_page(text: str) -> Any:
    """A message for `static/worded.js`: template and facts, with formatted numbers; a plain text as it is."""
    if not isinstance(text, Message):
        return str(text)
    specs = dict(_PLACE.findall(text.template))
    return [text.template, {name: _page_fact(fact, specs.get(name, "")) for name, fact in text.facts.items()}]


def _worded(text: str, language: Catalogue) -> str:
    if isinstance(text, Moment):
        return _moment(text.time_s, text.unix_s, text.digits, language)
    if isinstance(text, Message):
        return _filled(language.singular(text.template), text.facts, language)
    return language.singular(text)


def _filled(template: str, facts: Mapping[str, Any], language: Catalogue) -> str:
    return _PLACE.sub(lambda place: _value(facts[place[1]], place[2] or "", language), template)


def _value(fact: Any, spec: str, language: Catalogue) -> str:
    if isinstance(fact, list):
        return language.singular("; ").join(_value(each, spec, language) for each in fact)
    if isinstance(fact, (Message, Moment)):
        return _worded(fact, language)
    return numerals(format(fact, spec), language) if isinstance(fact, Real) else format(fact, spec)


def _moment(time_s: float, unix_s: float | None, digits: int, language: Catalogue) -> str:
    if unix_s is None:
        return f"{numerals(f'{time_s:.{digits}f}', language)} s" if isfinite(time_s) else "—"
    return datetime.fromtimestamp(unix_s).astimezone().strftime(language.date)


def _fact(value: Any) -> Any:
    match value:
        case str() | bool():
            return value
        case Integral():
            return int(value)
        case Real():
            return float(value)
        case list() | tuple():
            return [_fact(each) for each in value]
    return getattr(value, "words", None) or str(value)


def _plain(fact: Any) -> Any:
    match fact:
        case Message():
            return fact.plain()
        case Moment():
            return {"time_s": fact.time_s, "unix_s": fact.unix_s, _MOMENT: fact.digits}
        case list():
            return [_plain(each) for each in fact]
    return fact


def _read(plain: Mapping[str, Any]) -> Message:
    template = plain[_TEMPLATE]
    names = [name for name, _ in _PLACE.findall(template)]
    if len(set(names)) < len(names):  # so the text is not much longer than its plain form
        raise ValueError(template)
    return Message(template, **{name: _read_fact(plain[name]) for name in names})


def _read_fact(plain: Any) -> Any:
    if isinstance(plain, Mapping):
        if _MOMENT in plain:
            return Moment(plain["time_s"], plain["unix_s"], plain[_MOMENT])
        return _read(plain)
    return [_read_fact(each) for each in plain] if isinstance(plain, list) else plain


def _page_fact(fact: Any, spec: str) -> Any:
    match fact:
        case Message():
            return for_page(fact)
        case Moment():
            return {"unix_s": fact.unix_s, "text": _worded(fact, ENGLISH)}
        case list():
            return {"list": [_page_fact(each, spec) for each in fact]}
        case Real():
            return {"number": format(fact, spec)}
    return format(fact, spec)
