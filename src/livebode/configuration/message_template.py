"""Templates of messages to people: a sentence with names in braces."""

from __future__ import annotations

from collections.abc import Mapping
from string import Formatter

from livebode.core import nearest_name

NAMES = ("axis", "machine", "run", "kind", "priority", "message", "time", "sample", "value", "unit")
"""What a template may contain; the how-to page on connections explains each."""


def check_template(template: str) -> str:
    """The template; ValueError for a name that is not one of `NAMES`, or anything but names between braces.

    >>> check_template("{axis}: {message} ({value} {unit})")
    '{axis}: {message} ({value} {unit})'
    """
    try:
        parts = list(Formatter().parse(template))
    except ValueError as error:
        raise ValueError(f"has braces that do not fit together ({error}); write {{{{ for a brace") from None
    for _, name, form, conversion in parts:
        if name is None:
            continue
        if name not in NAMES:
            raise ValueError(f"has the name {name!r}: {nearest_name(name, NAMES, 'Names')}")
        if form or conversion:
            raise ValueError(f"has a format for {name}, and only {{{name}}} is possible")
    return template


def filled(template: str, values: Mapping[str, str]) -> str:
    """The template with the values of its names.

    >>> filled("{axis}: {message}", {"axis": "x", "message": "{axis} is text here"})
    'x: {axis} is text here'
    """
    return "".join(text + (values[name] if name else "") for text, name, _, _ in Formatter().parse(template))
