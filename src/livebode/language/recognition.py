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
from livebode.language.translation import current_language, date, numerals

_SIZE = r"[-+−]?\d[\d,]*(?:\.\d+)?(?:e[-+]?\d+)?"
_NUMBER = re.compile(rf"{_SIZE}(?: ± {_SIZE}| … {_SIZE})?(?: ?(?:s|ms|Hz|dB|°|%))?")
_DATE = re.compile(r"(\d{4}-\d\d-\d\d \d\d:\d\d:\d\d) ?(\S*)")
_PLACE = re.compile(r"\{(\w+)\}")
_CUTS = re.compile(r"(?<=\.) "), re.compile(r"(?<=;) ")
_SENTENCES = re.compile(r"[.;] ")


def recognised(text: str) -> str:
    """The sentence in the language in use; unchanged where no template fits.

    >>> from livebode.language import in_language
    >>> with in_language("de"):
    ...     recognised("12 samples were lost")
    '12 Abtastwerte verloren'
    """
    language = current_language()
    if not language.messages:
        return text
    if (found := _translated(text, language)) is not None:
        return found
    cut = next((cut for cut in _CUTS if cut.search(text)), None)
    return text if cut is None else " ".join(recognised(piece) for piece in cut.split(text))


def _translated(text: str, language: Catalogue) -> str | None:
    """All of it: as one sentence, sentence by sentence, clause by clause, or as a sentence that quotes others."""
    if (found := _known(text, language, quoting=False)) is not None:
        return found
    for cut in _CUTS:
        if cut.search(text):
            pieces = [_translated(piece, language) for piece in cut.split(text)]
            if None not in pieces:
                return " ".join(piece for piece in pieces if piece is not None)
    return _known(text, language, quoting=True)


def _known(text: str, language: Catalogue, *, quoting: bool) -> str | None:
    """The sentence, with or without the mark at its end."""
    own = language.messages.get(text)
    if isinstance(own, str):
        return own
    bare = text[:-1] if text.endswith((".", ";")) else text
    found = _whole(bare, language, quoting)
    return found if found is None or bare == text else found + language.singular(text[-1])


def _whole(text: str, language: Catalogue, quoting: bool) -> str | None:
    own = language.messages.get(text)
    if isinstance(own, str):
        return own
    for pattern, names, translation in _templates(language):
        match = pattern.fullmatch(text)
        if match is not None and (quoting or not any(map(_SENTENCES.search, match.groups()))):
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
