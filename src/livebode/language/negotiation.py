"""Which language a browser gets, and the catalogue that its page reads."""

from __future__ import annotations

import json
from dataclasses import asdict
from functools import cache

from livebode.language.translation import ENGLISH, available, catalogue

_HEADER_LETTERS = 500
_PREFERENCES_MAX = 32


def negotiated(asked: str, configured: str | None, accepted: str) -> str:
    """Code of the language for a page.

    Parameters
    ----------
    asked
        Code that the user chose; empty or unknown if none was.
    configured
        `[serve] language`.
    accepted
        The header Accept-Language: the languages of the browser.

    >>> negotiated("", None, "zh-TW;q=0.5, de-AT;q=0.9, en;q=0.1")
    'de'
    >>> negotiated("zh-CN", "de", "en"), negotiated("", "de", "en"), negotiated("", None, "fr, *")
    ('zh-CN', 'de', 'en')
    """
    for code in (asked, configured or ""):
        if code in available():
            return code
    preferences = [
        part.partition(";q=") for part in accepted[:_HEADER_LETTERS].replace(" ", "").split(",")[:_PREFERENCES_MAX]
    ]
    for required, _, _ in sorted(preferences, key=lambda preference: -_weight(preference[2])):
        base = required.lower().partition("-")[0]
        if matching := next((code for code in available() if code.lower().partition("-")[0] == base), None):
            return matching
    return ENGLISH.code


@cache
def catalogue_for_page(code: str) -> bytes:
    """The catalogue as JSON, with the names of all languages."""
    page = asdict(catalogue(code)) | {"languages": available()}
    return json.dumps(page, ensure_ascii=False).encode()


def _weight(text: str) -> float:
    try:
        return float(text) if text else 1.0
    except ValueError:
        return 0.0
