"""Descriptions of the keys of a file, from the docstrings of the classes that read them."""

from __future__ import annotations

import inspect
import re

_PARAMETERS = re.compile(r"^Parameters\n-+\n(.*?)(?=^\S[^\n]*\n-+$|\Z)", re.M | re.S)
_PARAMETER = re.compile(r"^(\w.*)\n((?: .*\n?|\n)+)", re.M)


def summary(kind: type) -> str:
    """First paragraph of a class's docstring, on one line."""
    return " ".join((inspect.getdoc(kind) or "").partition("\n\n")[0].split())


def descriptions(kind: type) -> dict[str, str]:
    """Description of each parameter in the docstrings (numpydoc) of a class and its bases, on one line.

    >>> class Recording:
    ...     '''A recording.
    ...
    ...     Parameters
    ...     ----------
    ...     rate_hz, hop
    ...         Of samples and
    ...         responses.
    ...     '''
    >>> descriptions(Recording)
    {'rate_hz': 'Of samples and responses.', 'hop': 'Of samples and responses.'}
    """
    found: dict[str, str] = {}
    for base in reversed(kind.__mro__):
        found |= documented(inspect.cleandoc(base.__doc__ or ""))
    return found


def documented(docstring: str) -> dict[str, str]:
    """Description of each parameter in a docstring (numpydoc) without its indentation, on one line."""
    found: dict[str, str] = {}
    section = _PARAMETERS.search(docstring)
    for names, text in _PARAMETER.findall(section[1]) if section else ():
        found |= dict.fromkeys(names.split(", "), " ".join(text.split()))
    return found
