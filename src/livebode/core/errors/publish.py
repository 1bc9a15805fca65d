"""A receiver of results that cannot be reached or refuses them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class PublishError(LivebodeError):
    """A receiver of a [[publish]] section did not take a message. The run continues.

    Examples
    --------
    >>> import livebode
    >>> livebode.PublishError.codes["not-taken"]
    'The receiver refuses this message permanently; it is not sent again.'
    """

    area: ClassVar[str] = "publish"
    codes: ClassVar[Mapping[str, str]] = {
        "cannot-listen": "The operating system does not let livebode listen at the address of a [[publish]] section.",
        "not-taken": "The receiver refuses this message permanently; it is not sent again.",
        "nothing-configured": "The configuration has no [[publish]] section.",
        "outbox-foreign": "The file for the events that wait for delivery was written by another program.",
        "outbox-unusable": "The file with the events that wait for delivery cannot be used.",
        "refused": "The receiver answers, and refuses messages now; they are sent again.",
        "unreachable": "The receiver cannot be reached, or does not answer in time; messages are sent again.",
    }
    temporary_codes: ClassVar[frozenset[str]] = frozenset({"outbox-unusable", "unreachable", "refused"})
