"""Signals that give no response."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class SignalError(LivebodeError):
    """The samples do not fit what was asked: no excitation, no period, too short, channels with the wrong role."""

    area: ClassVar[str] = "signal"
    codes: ClassVar[Mapping[str, str]] = {
        "channel-constant": "A channel is constant.",
        "no-response-there": "No valid response is near this time.",
        "no-valid-response": "No response is valid at any line.",
        "not-finite": "A channel has samples that are not finite.",
        "rate-differs": "The samples have another rate than is needed.",
        "too-few-lines": "The responses have too few valid lines.",
        "too-short": "There are too few samples.",
        "wrong-quantity": "The responses are of another quantity than the one that is needed.",
    }
