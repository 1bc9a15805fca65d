"""Catalogues of translations, and texts in the language of a person."""

from __future__ import annotations

import json
import string
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import field
from datetime import datetime
from functools import cache
from importlib.resources import files
from numbers import Real
from typing import Any

from livebode.dataclass import dataclass
from livebode.language.quantity_names import QUANTITY_NAMES

_PLURAL_PERIOD = 100
_WITH_EXPONENT = 1e6


@dataclass(frozen=True, eq=False)
class Catalogue:
    """One language.

    Attributes
    ----------
    code
        BCP 47, such as ``zh-CN``.
    name
        Of the language, in itself.
    decimal, group
        Decimal sign and separator of thousands.
    date
        Date and time of day with zone, for `strftime`.
    plural
        Digit n is the plural form for the number n, n < 200; from there on, the forms repeat every hundred.
    messages
        Translation by English sentence; a list of plural forms where the sentence depends on a number.
    """

    code: str
    name: str
    decimal: str = "."
    group: str = ","
    date: str = "%Y-%m-%d %H:%M:%S %Z"
    plural: str = ""
    messages: dict[str, Any] = field(default_factory=dict)

    def singular(self, text: str) -> str:
        """The translation; the English text if there is none."""
        forms = self.messages.get(text, text)
        return forms if isinstance(forms, str) else str(forms[-1])

    def form(self, singular: str, many: str, number: int) -> str:
        """The plural form for this number."""
        forms = self.messages.get(singular)
        if not isinstance(forms, list):
            return singular if number == 1 else many
        digit = number if number < 2 * _PLURAL_PERIOD else _PLURAL_PERIOD + number % _PLURAL_PERIOD
        return str(forms[int(self.plural[digit])])


ENGLISH = Catalogue("en", "English", messages=QUANTITY_NAMES)


@cache
def available() -> dict[str, str]:
    """Names of the languages by code, English first."""
    names = {ENGLISH.code: ENGLISH.name}
    folder = files("livebode.language") / "catalogues"
    for path in sorted(folder.iterdir(), key=lambda path: path.name):
        if path.name.endswith(".json"):
            read = json.loads(path.read_text("utf-8"))
            names[read["code"]] = read["name"]
    return names


@cache
def catalogue(code: str) -> Catalogue:
    """Read a language; KeyError if it is not one of `available`."""
    if code == ENGLISH.code:
        return ENGLISH
    if code not in available():
        raise KeyError(code)
    read = json.loads((files("livebode.language") / "catalogues" / f"{code.replace('-', '_')}.json").read_text("utf-8"))
    return Catalogue(**read)


_USED: ContextVar[Catalogue] = ContextVar("language of report and page", default=ENGLISH)


def current_language() -> Catalogue:
    """The language in use."""
    return _USED.get()


@contextmanager
def in_language(language: str | Catalogue) -> Iterator[None]:
    """Within, and in this thread only, sentences are in this language, given by its code or as a catalogue.

    >>> with in_language("de"):
    ...     tr("Findings"), number(1234.5, ",.1f")
    ('Befunde', '1.234,5')
    """
    before = _USED.set(language if isinstance(language, Catalogue) else catalogue(language))
    try:
        yield
    finally:
        _USED.reset(before)


def tr(text: str, /, **values: Any) -> str:
    """The sentence in the language in use, with its values; numbers with the decimal sign of the language.

    Parameters
    ----------
    text
        The English sentence, a literal: `make catalogues` finds it here. Values are ``{name}`` or ``{name:.3g}``.

    >>> tr("{samples:,} samples at {rate:.1f} Hz", samples=2000, rate=4e3)
    '2,000 samples at 4000.0 Hz'
    """
    return _FORMATTER.vformat(current_language().singular(text), (), values)


def trn(singular: str, many: str, number: int, /, **values: Any) -> str:
    """A translated sentence with plural forms; the number is the value ``{n}``.

    >>> trn("{n:,} gap", "{n:,} gaps", 1), trn("{n:,} gap", "{n:,} gaps", 2)
    ('1 gap', '2 gaps')
    """
    return _FORMATTER.vformat(current_language().form(singular, many, number), (), values | {"n": number})


def number(value: Any, spec: str = "") -> str:
    """A number in the format `spec`, with the decimal sign of the language; below a million without an exponent.

    >>> number(212.4, ".2g"), number(-574.3, "+.2g"), number(2.1e7, ".2g"), number(9.99e5, ".2g")
    ('210', '-570', '2.1e+07', '1e+06')
    """
    return numerals(_formatted(value, spec))


def _formatted(value: Any, spec: str) -> str:
    text = format(value, spec)
    if not spec.endswith("g") or "e+" not in text or abs(float(text)) >= _WITH_EXPONENT:
        return text
    return format(float(text), f"{spec.partition('.')[0]}.0f")


def numerals(text: str, language: Catalogue | None = None) -> str:
    """A formatted English number with the decimal sign and the separator of the language, by default that in use."""
    language = language or current_language()
    return text.translate({ord("."): language.decimal, ord(","): language.group})


def listed(items: Iterable[str]) -> str:
    """The items with the separator of the language, which is not its decimal sign."""
    return tr(", ").join(items)


def date(moment: datetime) -> str:
    """Local date and time of day with the zone."""
    return moment.strftime(current_language().date)


class _Formatter(string.Formatter):
    def format_field(self, value: Any, spec: str) -> str:
        return numerals(_formatted(value, spec)) if isinstance(value, Real) else format(value, spec)


_FORMATTER = _Formatter()
