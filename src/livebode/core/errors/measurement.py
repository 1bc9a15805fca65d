"""Measurements that could not be made, or ended early."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class MeasurementError(LivebodeError):
    """A measurement with an excitation was not possible, or was ended before it was complete.

    Examples
    --------
    >>> import livebode
    >>> livebode.MeasurementError.codes["silent"]
    'The samples ended while the excitation was played; it was ramped down.'
    """

    area: ClassVar[str] = "measurement"
    codes: ClassVar[Mapping[str, str]] = {
        "limit-exceeded": "A watched quantity left its limits; the excitation was ramped down.",
        "not-connected": "The controller is not connected so that it can play the excitation.",
        "not-ended": "The excitation is not zero although its end was requested.",
        "not-playable": "An excitation cannot be played on this kind of controller.",
        "played-differs": "The recorded excitation is not the designed one.",
        "silent": "The samples ended while the excitation was played; it was ramped down.",
    }
