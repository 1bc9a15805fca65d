"""Signals that give no response."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError
from livebode.language import Message

ANY_EXCITATION = Message(
    "for noise or a single chirp, with power in a whole band, set tracking.estimator to 'lpm' (--estimator lpm)"
)
"""Remedy for an excitation that does not repeat."""


class SignalError(LivebodeError):
    """The samples do not fit what was asked: no excitation, no period, too short, channels with the wrong role.

    Examples
    --------
    >>> import livebode
    >>> block = livebode.Block([[0.0] * 10, [1.0] * 10], ("u", "y"), rate_hz=1000)
    >>> try:
    ...     livebode.welch(block, input="u", output="y", window=20)
    ... except livebode.SignalError as error:
    ...     print(error.code)
    signal.too-short
    """

    area: ClassVar[str] = "signal"
    codes: ClassVar[Mapping[str, str]] = {
        "channel-constant": "A channel is constant.",
        "channel-empty": "A channel has no finite sample.",
        "channel-unknown": "There is no channel of this name.",
        "empty": "There are no samples.",
        "layout-differs": "The spectra that the drive sends do not fit the settings of the tracker.",
        "line-not-excited": "The excitation has no power at a line.",
        "lines-ambiguous": "More than one set of lines explains the excitation equally well.",
        "lines-inseparable": "The times of the samples of a channel do not determine the amplitudes at all lines.",
        "no-clean-samples": "There is no stretch without gaps and non-finite samples that is long enough.",
        "no-excitation": "The channel is a straight line, so it carries no excitation.",
        "no-line-above-noise": "The excitation repeats, but none of its lines exceeds the noise.",
        "no-response-there": "No valid response is near this time.",
        "no-valid-response": "No response is valid at any line.",
        "not-finite": "A channel has samples that are not finite.",
        "not-periodic": "The excitation does not repeat from window to window.",
        "pause-too-short": "There is no stretch without excitation that is long enough to look for hum.",
        "rate-differs": "The samples have another rate than is needed.",
        "repeated": "Samples or spectra came twice.",
        "role-shared": "Two roles that the estimator needs apart have the same channel.",
        "role-wrong": "The samples of a channel contradict the role that it was given.",
        "too-few-lines": "The responses have too few valid lines.",
        "too-short": "There are too few samples.",
        "wrong-quantity": "The responses are of another quantity than the one that is needed.",
    }
