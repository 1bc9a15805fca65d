"""A pseudo language, and sentences with values, for the tests of the catalogues."""

from __future__ import annotations

import re
from dataclasses import asdict
from typing import Any

from livebode.language import Catalogue, catalogue

_WORD = re.compile(r"[A-Za-z]{4,}")


def pseudo() -> Catalogue:
    """German, with each translation replaced by the English sentence in brackets."""
    german = catalogue("de")

    def bracketed(english: str, translation: Any) -> Any:
        return f"⟦{english}⟧" if isinstance(translation, str) else [f"⟦{english}⟧"] * len(translation)

    messages = {english: bracketed(english, own) for english, own in german.messages.items()}
    return Catalogue(**asdict(german) | {"code": "eo", "messages": messages})


def untranslated(text: str, data: set[str]) -> set[str]:
    """Words that are neither in brackets nor data."""
    while (shorter := re.sub(r"⟦[^⟦⟧]*⟧", " ", text)) != text:
        text = shorter
    return {word for word in _WORD.findall(text) if word not in data}
