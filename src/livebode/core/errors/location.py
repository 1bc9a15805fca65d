"""Files at URLs that cannot be read or written."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class LocationError(LivebodeError):
    """A file or directory at a URL cannot be read or written.

    Examples
    --------
    >>> import livebode
    >>> from livebode.locations import find
    >>> try:
    ...     find("memory://bench/missing.csv")
    ... except livebode.LocationError as error:
    ...     print(error.code)
    location.not-found
    """

    area: ClassVar[str] = "location"
    codes: ClassVar[Mapping[str, str]] = {
        "changed": "The file at the URL changed while it was downloaded.",
        "denied": "The storage permits no access, or knows no such user.",
        "exists": "There is something at the URL already, and it is not replaced.",
        "failed": "The storage reports another error.",
        "interrupted": "The connection ended within the file.",
        "no-credentials": "The storage needs credentials, and none were found.",
        "no-space": "The downloaded copy does not fit on the disk.",
        "not-a-run": "There are files below the URL, but no complete run.",
        "not-found": "There is nothing at the URL.",
        "not-possible": "A URL cannot be used for this.",
        "not-reachable": "The storage does not answer.",
        "not-uploaded": "A run was written, and could not be uploaded completely.",
        "scheme-unknown": "The first part of the URL names no storage that can be used here.",
    }
    temporary_codes: ClassVar[frozenset[str]] = frozenset(
        {"changed", "failed", "interrupted", "no-space", "not-reachable", "not-uploaded"}
    )
