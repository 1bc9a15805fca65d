"""Signals that give no response."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class SignalError(LivebodeError):
    """The samples do not fit what was asked: no excitation, no period, too short, channels with the wrong role."""

    area: ClassVar[str] = "signal"
    codes: ClassVar[Mapping[str, str]] = {
        "constant": "A signal is constant.",
        "no-response-there": "No valid response is near this time.",
        "no-valid-line": "No line of the responses is valid.",
        "not-finite": "A signal has samples that are not finite.",
        "rate-differs": "The samples have another rate than is needed.",
        "too-few-lines": "The responses have too few valid lines.",
        "too-short": "There are too few samples.",
    }
