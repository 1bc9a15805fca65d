"""Catalogue: the translations of one language, its numbers and its dates, from a JSON file."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Any

_PLURAL_PERIOD = 100


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
        found = self.messages.get(text, text)
        return found if isinstance(found, str) else str(found[-1])

    def form(self, one: str, many: str, number: int) -> str:
        """The plural form for this number."""
        found = self.messages.get(one)
        if not isinstance(found, list):
            return one if number == 1 else many
        at = number if number < 2 * _PLURAL_PERIOD else _PLURAL_PERIOD + number % _PLURAL_PERIOD
        return str(found[int(self.plural[at])])


ENGLISH = Catalogue("en", "English")


@cache
def available() -> dict[str, str]:
    """Names of the languages by code, English first."""
    found = {ENGLISH.code: ENGLISH.name}
    folder = files("livebode.language") / "catalogues"
    for path in sorted(folder.iterdir(), key=lambda path: path.name):
        if path.name.endswith(".json"):
            read = json.loads(path.read_text("utf-8"))
            found[read["code"]] = read["name"]
    return found


@cache
def catalogue(code: str) -> Catalogue:
    """Read a language; KeyError if it is not one of `available`."""
    if code == ENGLISH.code:
        return ENGLISH
    if code not in available():
        raise KeyError(code)
    read = json.loads((files("livebode.language") / "catalogues" / f"{code.replace('-', '_')}.json").read_text("utf-8"))
    return Catalogue(**read)
