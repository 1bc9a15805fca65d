"""Recognition: an English sentence of a record, in the language in use.

A record has each message as one English sentence. The templates in `recorded` find the values in it, so that report and
page can show it in another language, also from records of earlier versions. What no template fits remains English.
`static/recognition.js` is the same for the page.
"""

from __future__ import annotations

import re
from datetime import datetime
from functools import cache

from livebode.language.catalogue import Catalogue
from livebode.language.spoken import date, numerals, used

_SIZE = r"[-+−]?\d[\d,]*(?:\.\d+)?(?:e[-+]?\d+)?"
_NUMBER = re.compile(rf"{_SIZE}(?: ± {_SIZE}| … {_SIZE})?(?: ?(?:s|ms|Hz|dB|°|%))?")
_DATE = re.compile(r"(\d{4}-\d\d-\d\d \d\d:\d\d:\d\d) ?(\S*)")
_PLACE = re.compile(r"\{(\w+)\}")
_PIECES = re.compile(r"(?<=\.) "), re.compile(r"(?<=;) ")


def recognised(text: str) -> str:
    """The sentence in the language in use; unchanged where no template fits.

    >>> from livebode.language import spoken
    >>> with spoken("de"):
    ...     recognised("12 samples were lost")
    '12 Abtastwerte verloren'
    """
    language = used()
    if not language.messages:
        return text
    return _known(text, language) or _by_pieces(text, language, _PIECES)


def _by_pieces(text: str, language: Catalogue, cuts: tuple[re.Pattern[str], ...]) -> str:
    """Sentence by sentence; those that are unknown clause by clause."""
    if not cuts:
        return text
    pieces = cuts[0].split(text)
    return " ".join(_known(piece, language) or _by_pieces(piece, language, cuts[1:]) for piece in pieces)


def _known(text: str, language: Catalogue) -> str | None:
    """The sentence, with or without the mark at its end."""
    if (found := _whole(text, language)) is not None:
        return found
    if text.endswith((".", ";")) and (found := _whole(text[:-1], language)) is not None:
        return found + language.singular(text[-1])
    return None


def _whole(text: str, language: Catalogue) -> str | None:
    own = language.messages.get(text)
    if isinstance(own, str):
        return own
    for pattern, names, translation in _templates(language):
        if (match := pattern.fullmatch(text)) is not None:
            return _filled(translation, {name: _value(value) for name, value in zip(names, match.groups())})
    return None


def _filled(translation: str, values: dict[str, str]) -> str:
    return _PLACE.sub(lambda place: values[place[1]], translation)


def _value(text: str) -> str:
    if _NUMBER.fullmatch(text):
        return numerals(text)
    if (found := _DATE.fullmatch(text)) is not None:
        return date(datetime.fromisoformat(found[1])).replace("%Z", "").rstrip() + f" {found[2]}".rstrip()
    return recognised(text)


@cache
def _templates(language: Catalogue) -> list[tuple[re.Pattern[str], list[str], str]]:
    """Pattern, names of the values and translation of each template, the most literal first."""
    found = sorted(language.recorded, key=lambda pair: -len(_PLACE.sub("", pair[0])))
    return [(_pattern(english), _PLACE.findall(english), translation) for english, translation in found]


def _pattern(template: str) -> re.Pattern[str]:
    literals = _PLACE.split(template)[::2]
    return re.compile("(.+?)".join(map(re.escape, literals)), re.DOTALL)
