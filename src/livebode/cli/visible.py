"""Text from files, sources and users with its control characters made visible."""

from __future__ import annotations

import re

# Also characters that change the direction of writing: they can disguise a text.
_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]")


def visible(text: str) -> str:
    r"""Replace control characters, except new lines and tabs, by JSON escapes.

    >>> visible("belt\x1b[2J\u202e ok")
    'belt\\u001b[2J\\u202e ok'
    """
    return _CONTROL.sub(lambda found: f"\\u{ord(found[0]):04x}", text)
