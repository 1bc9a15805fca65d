"""A dashboard that cannot be served."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class ServerError(LivebodeError):
    """The dashboard cannot be served or reached.

    Examples
    --------
    >>> import livebode
    >>> livebode.ServerError.codes["port-taken"]
    'Another program listens at this port.'
    """

    area: ClassVar[str] = "server"
    codes: ClassVar[Mapping[str, str]] = {
        "busy": "Too many requests wait already.",
        "cannot-listen": "The operating system does not let the dashboard listen at this address.",
        "entry-only": "This is one entry of a matrix run, with which nothing can be saved.",
        "event-unknown": "An event with this key does not exist.",
        "no-alarm": "The event is not an alarm, so it cannot be shelved.",
        "not-begun": "The run has no samples or responses yet.",
        "not-started": "The dashboard did not start in time.",
        "port-taken": "Another program listens at this port.",
        "quantity-unavailable": "The quantity cannot be computed from what the run knows.",
        "reference-unknown": "A reference with this id is not saved with the run.",
        "request-malformed": "A request or message of a browser is not what the dashboard takes.",
        "run-ended": "The run has ended, so its record cannot be changed.",
        "run-unknown": "A run of this name is not in the directory that is served.",
        "too-many-tries": "Wrong tokens came too often from this address.",
    }
    temporary_codes: ClassVar[frozenset[str]] = frozenset({"busy", "not-started", "port-taken"})
