"""Optional packages that are not installed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class ExtraError(LivebodeError):
    """An optional package that this needs is not installed.

    Examples
    --------
    >>> import livebode
    >>> livebode.ExtraError.codes["not-installed"]
    'The package that this needs is not installed.'
    """

    area: ClassVar[str] = "extra"
    codes: ClassVar[Mapping[str, str]] = {
        "not-installed": "The package that this needs is not installed.",
    }
