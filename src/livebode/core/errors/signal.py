"""Signals that give no response."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class SignalError(LivebodeError):
    """The samples do not fit what was asked: no excitation, no period, too short, channels with the wrong role."""

    area: ClassVar[str] = "signal"
    codes: ClassVar[Mapping[str, str]] = {
        "channel-unknown": "A channel with this name does not exist.",
        "empty": "There are no samples.",
        "layout-differs": "The spectra that the drive sends do not fit the settings of the tracker.",
        "no-excitation": "The channel is constant or a straight line, so it carries no excitation.",
        "no-line-above-noise": "The excitation repeats, but none of its lines exceeds the noise.",
        "not-finite": "Samples that are needed are not finite.",
        "not-periodic": "The excitation does not repeat.",
        "rate-differs": "The samples have another rate than the lines.",
        "repeated": "Samples or spectra came twice.",
        "too-few-lines": "The response is valid at too few lines.",
        "too-short": "There are too few samples.",
        "wrong-quantity": "These are responses of another quantity than the one needed.",
    }
