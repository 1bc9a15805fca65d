"""Sentences, numbers and dates in the language that is in use in this context; English by default."""

from __future__ import annotations

import string
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from datetime import datetime
from numbers import Real
from typing import Any

from livebode.language._catalogue import ENGLISH, Catalogue, catalogue

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


def trn(one: str, many: str, number: int, /, **values: Any) -> str:
    """The same with plural forms; the number is the value ``{n}``.

    >>> trn("{n:,} gap", "{n:,} gaps", 1), trn("{n:,} gap", "{n:,} gaps", 2)
    ('1 gap', '2 gaps')
    """
    return _FORMATTER.vformat(current_language().form(one, many, number), (), values | {"n": number})


def number(value: Any, spec: str = "") -> str:
    """A number in the format `spec`, with the decimal sign of the language."""
    return numerals(format(value, spec))


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
        text = format(value, spec)
        return numerals(text) if isinstance(value, Real) else text


_FORMATTER = _Formatter()
