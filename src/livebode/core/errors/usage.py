"""Arguments of a call or options of a command that cannot be used."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class UsageError(LivebodeError):
    """An argument of a call, or an option of a command, cannot be used.

    Examples
    --------
    >>> import livebode
    >>> lines = livebode.Lines.parse("20:140:20", rate_hz=4000, window=400)
    >>> try:
    ...     livebode.multisine(lines, amplitude=[1.0, 2.0])
    ... except livebode.UsageError as error:
    ...     print(error.code)
    usage.wrong-shape
    """

    area: ClassVar[str] = "usage"
    codes: ClassVar[Mapping[str, str]] = {
        "conflict": "Two arguments, or an argument and what it is used with, do not go together.",
        "duplicate": "A name or value is given twice where it may be given once.",
        "invalid-name": "A name has a form that is not allowed.",
        "missing": "A required argument is missing or empty.",
        "not-finite": "An argument has a value that is not a finite number.",
        "not-one-of": "An argument is not one of the allowed values.",
        "options": "The options of a command cannot be used as given.",
        "out-of-range": "The value is outside the range of the argument.",
        "query-rejected": "The database rejects the SQL of a query.",
        "too-large": "What the arguments ask for needs more memory than there is.",
        "too-many": "There are more values than the argument allows.",
        "unknown-name": "There is nothing of this name; the allowed names are given.",
        "unreadable": "The text or data of an argument cannot be read.",
        "wrong-shape": "An array or list does not have the shape that is needed.",
    }
