"""States that cannot be restored."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class StateError(LivebodeError):
    """The state of a stage cannot be restored; the stage is then unchanged.

    Examples
    --------
    >>> import livebode
    >>> livebode.StateError.codes["newer-version"]
    'The state was written by a newer version of livebode.'
    """

    area: ClassVar[str] = "state"
    codes: ClassVar[Mapping[str, str]] = {
        "damaged": "The state is not as it was written, or incomplete.",
        "newer-version": "The state was written by a newer version of livebode.",
        "not-a-state": "The bytes are not a state that livebode wrote.",
        "older-version": "The state was written by an older version of livebode.",
        "other-settings": "The state belongs to a stage with other settings.",
        "other-stage": "The state belongs to another stage.",
    }
