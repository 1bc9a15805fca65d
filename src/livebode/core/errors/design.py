"""Excitations that cannot be made."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class DesignError(LivebodeError):
    """An excitation or experiment that meets the specification and the limits cannot be made.

    Examples
    --------
    >>> import livebode
    >>> axis = {"belt": {"drive": {"torque_n_m_max": 0.1}}, "excitation": {"band_hz": [20, 140], "window": 400}}
    >>> try:
    ...     livebode.design(axis, amplitude_n_m=1.0)
    ... except livebode.DesignError as error:
    ...     print(error.code)
    design.limit-exceeded
    """

    area: ClassVar[str] = "design"
    codes: ClassVar[Mapping[str, str]] = {
        "accuracy-not-reached": "The required sigma of each entry cannot be reached in the time and within the limits.",
        "amplitude-undetermined": "No amplitude can be chosen, as neither noise nor limits are known.",
        "crest-factor-not-reached": "No excitation with such a low crest factor was found.",
        "feedback-unknown": "The feedback of the loop is needed and not described.",
        "limit-exceeded": "The excitation would exceed a limit of the machine.",
        "line-without-power": "The excitation has no power at one of its lines.",
        "motion-unknown": "A quantity has a limit, but its range in the motion alone is not given.",
        "name-forbidden": "The name is not allowed in the language or format of the file.",
        "no-room-in-motion": "The motion alone exceeds a limit, or leaves no room for an excitation.",
        "not-enough-time": "The available time is shorter than two repetitions of the experiments.",
        "rounded-away": "Rounding to the steps of the drive changes the excitation too much.",
    }
